"""The plate turns as the closed forms of a trapezoid say, settles, stalls and falls short."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sim.motion import Plate, Ringing

SPEED_RAD_S = math.radians(120)
ACCELERATION_RAD_S2 = math.radians(360)
STIFF = Ringing(share=0.0)
NANORADIAN = 1e-9
MICRORADIAN = 1e-6

angles_rad = st.floats(-10, 10)
speeds_rad_s = st.floats(0.1, 5)
accelerations_rad_s2 = st.floats(0.5, 20)


def plate(angle_rad: float = 0.0, sigma_rad: float = 0.0, ringing: Ringing = STIFF) -> Plate:
    return Plate(angle_rad, sigma_rad, np.random.default_rng(1), ringing)


def move(table: Plate, angle_rad: float, now_s: float = 0.0) -> None:
    table.move_to(angle_rad, SPEED_RAD_S, ACCELERATION_RAD_S2, now_s)


@pytest.mark.parametrize(
    ("turn_deg", "duration_s"),
    [
        pytest.param(90, 90 / 120 + 120 / 360, id="trapezoid: d/v + v/a"),
        pytest.param(-90, 90 / 120 + 120 / 360, id="the other way"),
        pytest.param(40, 40 / 120 + 120 / 360, id="just reaches full speed: d = v^2/a"),
        pytest.param(10, 2 * math.sqrt(10 / 360), id="triangle: 2 sqrt(d/a)"),
    ],
)
def test_a_move_from_rest_takes_as_long_as_the_closed_form_says(
    turn_deg: float, duration_s: float
) -> None:
    table = plate(1.0)
    move(table, 1.0 + math.radians(turn_deg), now_s=5.0)
    assert table.end_s == pytest.approx(5.0 + duration_s, abs=NANORADIAN)
    assert table.angle_at(table.end_s) == pytest.approx(1.0 + math.radians(turn_deg))
    assert table.angle_at(5.0 + duration_s / 2) == pytest.approx(1 + math.radians(turn_deg / 2))


def test_a_stop_at_full_speed_takes_half_v_squared_over_a() -> None:
    table = plate()
    move(table, 6.0)
    table.stop(ACCELERATION_RAD_S2, 1.0)
    ramp_s = SPEED_RAD_S / ACCELERATION_RAD_S2
    assert table.end_s == pytest.approx(1.0 + ramp_s)
    travelled_rad = SPEED_RAD_S * (1.0 - ramp_s / 2) + SPEED_RAD_S * ramp_s / 2
    assert table.angle_at(9.0) == pytest.approx(travelled_rad)


def test_a_move_in_mid_move_turns_back_from_the_present_speed() -> None:
    table = plate()
    move(table, 6.0)
    move(table, 0.0, now_s=1.0)
    ramp_s = SPEED_RAD_S / ACCELERATION_RAD_S2
    turned_rad = SPEED_RAD_S * (1.0 - ramp_s / 2) + SPEED_RAD_S * ramp_s / 2
    assert table.angle_at(1.0 + ramp_s) == pytest.approx(turned_rad)
    assert table.end_s == pytest.approx(1.0 + ramp_s + turned_rad / SPEED_RAD_S + ramp_s)
    assert table.angle_at(9.0) == pytest.approx(0.0, abs=NANORADIAN)


@given(angles_rad, angles_rad, speeds_rad_s, accelerations_rad_s2)
def test_a_move_from_rest_is_monotone_and_keeps_the_limits(
    start_rad: float, target_rad: float, speed_rad_s: float, acceleration_rad_s2: float
) -> None:
    table = plate(start_rad)
    table.move_to(target_rad, speed_rad_s, acceleration_rad_s2, 0.0)
    time_s = np.linspace(0, table.end_s, 300)
    rate_rad_s = table.rate_rad_s(time_s)
    assert np.all(rate_rad_s * np.sign(target_rad - start_rad) >= -NANORADIAN)
    assert np.max(np.abs(rate_rad_s)) <= speed_rad_s + NANORADIAN
    steps = np.abs(np.diff(rate_rad_s))
    assert np.all(steps <= acceleration_rad_s2 * np.diff(time_s) + NANORADIAN)
    assert table.angle_at(table.end_s) == pytest.approx(target_rad, abs=NANORADIAN)


@given(
    st.lists(
        st.tuples(st.floats(0, 0.7), angles_rad, speeds_rad_s, accelerations_rad_s2, st.booleans()),
        min_size=1,
        max_size=5,
    )
)
def test_whatever_interrupts_what_the_rate_is_the_derivative_of_a_continuous_angle(
    orders: list[tuple[float, float, float, float, bool]],
) -> None:
    table, now_s = plate(0.3, 1e-5, Ringing(share=1.0)), 0.0
    for pause_s, target_rad, speed_rad_s, acceleration_rad_s2, stops in orders:
        now_s += pause_s
        table.move_to(target_rad, speed_rad_s, acceleration_rad_s2, now_s)
        if stops:
            now_s += pause_s
            table.stop(acceleration_rad_s2, now_s)
    time_s = np.arange(0.0, now_s + 1.0, 1e-4)
    rate_rad_s = table.rate_rad_s(time_s)
    travelled = np.cumsum((rate_rad_s[1:] + rate_rad_s[:-1]) / 2 * 1e-4)
    angle_rad = table.angle_rad(time_s)
    assert_allclose(angle_rad[1:], angle_rad[0] + travelled, atol=3 * MICRORADIAN)
    assert np.max(np.abs(np.diff(rate_rad_s))) <= 41 * 1e-4 + NANORADIAN  # twice the largest a


def test_after_the_profile_the_plate_rings_at_its_natural_frequency_and_settles() -> None:
    ringing = Ringing(frequency_hz=12.0, damping_ratio=0.1, share=1.0)
    table = plate(ringing=ringing)
    move(table, 1.0)
    time_s = table.end_s + np.arange(0.0, 2.0, 1e-4)
    ring_rad = table.angle_rad(time_s) - 1.0
    assert ring_rad[0] == pytest.approx(ACCELERATION_RAD_S2 / (2 * math.pi * 12.0) ** 2)
    rising = np.flatnonzero((ring_rad[:-1] < 0) & (ring_rad[1:] >= 0))
    period_s = 1 / (12.0 * math.sqrt(1 - 0.1**2))
    assert_allclose(np.diff(time_s[rising])[:5], period_s, atol=2e-4)
    peaks_rad = [np.max(ring_rad[start : start + 500]) for start in rising[:3]]
    decrement = math.exp(-2 * math.pi * 0.1 / math.sqrt(1 - 0.1**2))
    assert_allclose(np.divide(peaks_rad[1:], peaks_rad[:-1]), decrement, rtol=1e-3)
    assert abs(ring_rad[-1]) < NANORADIAN * 1000


def test_the_swing_grows_with_the_deceleration() -> None:
    swings_rad = []
    for acceleration_rad_s2 in (1.0, 3.0):
        table = plate(ringing=Ringing())
        table.move_to(1.0, SPEED_RAD_S, acceleration_rad_s2, 0.0)
        swings_rad.append(table.angle_at(table.end_s) - 1.0)
    assert swings_rad[1] == pytest.approx(3 * swings_rad[0])


def test_positioning_errors_have_the_stated_sigma_and_a_repeated_target_does_not_move() -> None:
    table, errors_rad = plate(sigma_rad=1e-5), []
    targets_rad = np.radians(15.0 * (1 + np.arange(400) % 24))
    for count, target_rad in enumerate(targets_rad):
        move(table, target_rad, now_s=10.0 * count)
        errors_rad.append(table.angle_at(10.0 * count + 9.0) - target_rad)
    assert np.std(errors_rad) == pytest.approx(1e-5, rel=0.15)  # 4 sigma of 400 draws
    move(table, targets_rad[-1], now_s=4000.0)
    assert table.end_s == 4000.0


def test_an_obstacle_stalls_the_plate_and_lets_it_go_back_only() -> None:
    table = plate()
    table.block_at(0.5 + 2 * math.pi)  # the same place, a turn later
    move(table, 1.0)
    assert table.stalled
    assert table.angle_at(9.0) == pytest.approx(0.5, abs=1e-8)
    assert table.end_s < 1.0
    move(table, 1.0, now_s=10.0)
    assert table.stalled
    assert table.end_s == pytest.approx(10.0, abs=1e-3)
    move(table, 0.2, now_s=20.0)
    assert not table.stalled
    assert table.angle_at(29.0) == pytest.approx(0.2)
    table.block_at(None)
    move(table, 1.0, now_s=30.0)
    assert table.angle_at(39.0) == pytest.approx(1.0)


def test_an_obstacle_that_appears_in_mid_move_leaves_the_past_as_it_was_told() -> None:
    table = plate()
    move(table, 3.0)
    told_rad = table.angle_at(0.8)
    table.block_at(2.0)
    assert table.angle_at(0.8) == told_rad
    assert table.stalled
    assert table.angle_at(9.0) == pytest.approx(2.0, abs=1e-8)


def test_an_obstacle_taken_away_in_time_lets_the_move_finish() -> None:
    table = plate()
    table.block_at(-2.0)
    move(table, -3.0)
    table.angle_at(0.5)
    table.block_at(None)
    assert not table.stalled
    assert table.angle_at(9.0) == pytest.approx(-3.0)


def test_moves_fall_short_by_what_was_asked_until_mended() -> None:
    table = plate()
    table.fall_short_by(math.radians(0.31))
    move(table, 1.0)
    assert table.angle_at(9.0) == pytest.approx(1.0 - math.radians(0.31))
    move(table, 0.0, now_s=10.0)
    assert table.angle_at(19.0) == pytest.approx(math.radians(0.31))
    table.fall_short_by(0.0)
    move(table, 0.0, now_s=20.0)
    assert table.angle_at(29.0) == pytest.approx(0.0)


def test_a_stop_of_a_standing_plate_changes_nothing() -> None:
    table = plate(ringing=Ringing())
    move(table, 1.0)
    before_rad = table.angle_at(table.end_s + 0.02)
    table.stop(ACCELERATION_RAD_S2, table.end_s + 0.01)
    assert table.angle_at(table.end_s + 0.02) == before_rad


def test_a_lower_speed_in_mid_move_slows_down_first() -> None:
    table = plate()
    move(table, 6.0)
    table.move_to(6.0, 0.5, ACCELERATION_RAD_S2, 1.0)
    slowed_s = 1.0 + (SPEED_RAD_S - 0.5) / ACCELERATION_RAD_S2
    assert float(table.rate_rad_s(np.array(slowed_s + 0.1))) == pytest.approx(0.5)
    assert table.angle_at(table.end_s) == pytest.approx(6.0)


def test_only_the_last_seconds_of_motion_are_kept() -> None:
    table = plate()
    for count in range(200):
        move(table, float(count % 2), now_s=2.0 * count)
    assert len(table._segments) < 40
    turned_deg = 120 * (0.45 - 120 / 360 / 2)  # cruising in the sixth move from the end
    assert table.angle_at(388.45) == pytest.approx(1.0 - math.radians(turned_deg))


@pytest.mark.parametrize(("speed_rad_s", "acceleration_rad_s2"), [(0.0, 1.0), (1.0, -1.0)])
def test_a_move_without_a_positive_speed_and_acceleration_is_refused(
    speed_rad_s: float, acceleration_rad_s2: float
) -> None:
    with pytest.raises(ValueError, match="positive"):
        plate().move_to(1.0, speed_rad_s, acceleration_rad_s2, 0.0)


def test_a_plate_is_told_to_rest_only_once_its_angle_no_longer_changes_in_the_last_bit() -> None:
    table = plate(ringing=Ringing())
    move(table, 1.0)
    later_s = np.arange(0.0, 10.0, 0.001)
    resting = [table.resting_rad(float(time_s)) for time_s in later_s]
    first = next(index for index, angle_rad in enumerate(resting) if angle_rad is not None)
    assert table.end_s < later_s[first] < table.end_s + 3.0
    assert np.all(table.angle_rad(later_s[first:]) == resting[-1])
    assert all(angle_rad == resting[-1] for angle_rad in resting[first:])
    move(table, 2.0, now_s=10.0)
    assert table.resting_rad(10.0) is None


def test_a_plate_that_slips_stands_elsewhere_and_the_encoder_does_not_see_it() -> None:
    table = plate()
    move(table, 1.0)
    table.slip_by(-0.1, now_s=0.3)
    for now_s in (0.2, 0.3):
        assert table.angle_rad(np.array(now_s)) == pytest.approx(table.angle_at(now_s))
    at_rest_s = table.end_s + 5.0
    assert table.angle_at(at_rest_s) == pytest.approx(1.0, abs=NANORADIAN)
    assert table.angle_rad(np.array(at_rest_s)) == pytest.approx(0.9, abs=NANORADIAN)
    assert table.resting_rad(at_rest_s) == pytest.approx(0.9, abs=NANORADIAN)
    assert table.slipped_rad == pytest.approx(-0.1)


def test_a_slip_is_a_turn_that_a_gyro_can_follow() -> None:
    table = plate()
    table.slip_by(0.1, now_s=1.0)
    assert table.resting_rad(1.01) is None
    times_s = np.linspace(0.9, 1.2, 301)
    turned = np.diff(table.angle_rad(times_s))
    assert np.all(turned >= 0.0)
    assert turned.sum() == pytest.approx(0.1)
    assert np.max(turned) / 0.001 < math.radians(200)


def test_a_table_that_slips_every_move_stays_behind_the_motor_both_ways() -> None:
    table = plate()
    table.slip_every_move_by(0.01)
    for step, angle_rad in enumerate((1.0, 2.0, 3.0)):
        move(table, angle_rad, now_s=10.0 * step)
    assert table.slipped_rad == pytest.approx(-0.03)
    move(table, 2.0, now_s=30.0)
    assert table.slipped_rad == pytest.approx(-0.02)
    move(table, 2.0, now_s=40.0)  # it is there already
    assert table.slipped_rad == pytest.approx(-0.02)
    table.slip_every_move_by(0.0)
    move(table, 1.0, now_s=50.0)
    assert table.slipped_rad == pytest.approx(-0.02)


def test_many_slips_add_up_long_after() -> None:
    table = plate()
    for step in range(100):
        table.slip_by(0.01, now_s=float(step))
    assert table.slipped_rad == pytest.approx(1.0)
    assert table.angle_rad(np.array([200.0])) == pytest.approx(1.0)


def test_the_mark_goes_with_the_plate() -> None:
    table = plate(6.0)
    table.slip_by(0.5, now_s=0.0)
    assert table.past_mark_rad(1.0) == pytest.approx(6.5 - 2 * math.pi)
