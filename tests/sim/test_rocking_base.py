"""The rocking base moves as it says, and what it feels is what its attitude and place do."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lsim, periodogram
from scipy.spatial.transform import Rotation
from scipy.stats import binom, chi2, poisson

from drivers.interfaces import FloatArray
from sim.base_people import Boarding
from sim.base_settings import EngineOrder, People, Spring, Swing
from sim.rocking_base import RockingBase, RockingSettings, nominal, paper_like
from sim.truth import Truth

Preset = Callable[[float, int], RockingSettings]
DEG = np.pi / 180
ARCSEC = DEG / 3600
DEG_PER_HOUR = DEG / 3600
STANDARD_GRAVITY = 9.80665
EARTH_RATE_RAD_S = 7.292115e-5
LATITUDE_RAD = 39.1 * DEG
CONFIDENCE = 0.999  # of each statistical bound below; the seeds are fixed
STILL = Swing(0.0, 0.1)
PRESETS = pytest.mark.parametrize("preset", [nominal, paper_like])


def at_rest() -> RockingSettings:
    """Return a base on which nothing moves."""
    base = replace(nominal(LATITUDE_RAD, 1), sway_rms_g=0.0, people=None, engine=())
    return replace(base, yaw=STILL, pitch=STILL, roll=STILL)


def ends(period_s: float, duration_s: float, start_s: float = 0.0) -> FloatArray:
    """Return the ends of consecutive periods from a start on."""
    return start_s + period_s * np.arange(1, round(duration_s / period_s) + 1).astype(np.float64)


def in_n(base: RockingBase, time_s: FloatArray, vector_b: FloatArray) -> FloatArray:
    return Rotation.from_matrix(base.attitude(time_s)).apply(vector_b)


def amplitudes(signals: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies, and the amplitude that a tone at each would have, by column."""
    hz, spectrum = periodogram(signals, rate_hz, "flattop", scaling="spectrum", axis=0)
    return hz, np.sqrt(2.0 * spectrum)


def test_at_rest_the_attitude_is_zxy_with_yaw_counter_clockwise() -> None:
    found = RockingBase(at_rest()).attitude(np.array([-7.0, 0.0, 1e6]))
    expected = Rotation.from_euler("ZXY", [35.0, 1.2, -0.8], degrees=True).as_matrix()
    assert_allclose(found, np.tile(expected, (3, 1, 1)), atol=1e-15)


def test_a_base_that_stands_where_a_bench_does_feels_what_the_bench_feels() -> None:
    truth = Truth(40 * DEG, 48 * DEG, 8 * DEG, -12 * DEG, height_m=300.0)
    base = RockingBase(at_rest().standing_at(truth))
    rate, force = base.felt(np.array([3.0, 4.0]), 0.01)
    assert_allclose(base.attitude(np.array([3.0]))[0].T, truth.table_axes_n(), atol=1e-15)
    assert_allclose(rate, np.tile(truth.earth_rate_t(), (2, 1)), rtol=1e-13)
    assert_allclose(force, np.tile(truth.specific_force_t(), (2, 1)), rtol=1e-13)


def test_moved_to_a_bench_the_base_keeps_its_motion() -> None:
    truth, time_s = Truth(40 * DEG, 48 * DEG, 2 * DEG, -1 * DEG), ends(0.1, 30.0)
    here = RockingBase(nominal(LATITUDE_RAD, 5))
    there = RockingBase(here.settings.standing_at(truth))
    angles = [
        Rotation.from_matrix(base.attitude(time_s)).as_euler("ZXY", degrees=True) - rest
        for base, rest in ((here, [35.0, 1.2, -0.8]), (there, [-48.0, 2.0, -1.0]))
    ]
    assert np.ptp(angles[0], axis=0).min() > 0.03
    assert_allclose(angles[0], angles[1], atol=1e-12)


@PRESETS
@pytest.mark.parametrize(("start_s", "limit_rad_s"), [(-37.0, 1e-11), (100_000.0, 4e-9)])
def test_the_felt_rate_turns_the_attitude_among_the_stars(
    preset: Preset, start_s: float, limit_rad_s: float
) -> None:
    """By scipy's rotations, 0.1 ms apart; the mean over 2 s tells a drift of 1e-6 deg/h."""
    base, period_s = RockingBase(preset(LATITUDE_RAD, 3)), 1e-4
    edges_s = np.concatenate([[start_s], ends(period_s, 2.0, start_s)])
    earth = EARTH_RATE_RAD_S * np.array([0.0, np.cos(LATITUDE_RAD), np.sin(LATITUDE_RAD)])
    turned = Rotation.from_rotvec(np.outer(edges_s - start_s, earth))
    attitude = turned * Rotation.from_matrix(base.attitude(edges_s))
    steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / period_s
    rate, _ = base.felt(edges_s[1:], period_s)
    # A day after zero, a time's last bit is 2e-9 rad of 23 Hz, over steps of 0.1 ms.
    assert np.abs(rate - steps).max() < limit_rad_s
    assert np.abs((rate - steps).mean(axis=0)).max() < 1e-6 * DEG_PER_HOUR


def against_parts(settings: RockingSettings, period_s: float) -> tuple[FloatArray, FloatArray]:
    """Return by how much the means over an interval differ from those of its 16 parts."""
    base = RockingBase(settings)
    whole = base.felt(ends(period_s, 40.0), period_s)
    finer = base.felt(ends(period_s / 16, 40.0), period_s / 16)
    rate, force = (f.reshape(-1, 16, 3).mean(axis=1) for f in finer)
    return whole[0] - rate, whole[1] - force


@pytest.mark.parametrize(
    ("period_s", "rate_limit_deg_h", "force_limit_g"), [(0.002, 1e-6, 2e-11), (0.008, 1e-3, 1e-7)]
)
def test_the_mean_over_an_interval_is_the_mean_of_its_parts(
    period_s: float, rate_limit_deg_h: float, force_limit_g: float
) -> None:
    settings = replace(paper_like(LATITUDE_RAD, 4), people=None)
    rate, force = against_parts(settings, period_s)
    assert np.abs(rate).max() < rate_limit_deg_h * DEG_PER_HOUR
    assert np.abs(rate.mean(axis=0)).max() < 1e-8 * DEG_PER_HOUR
    assert np.abs(force).max() < force_limit_g


def test_someone_who_steps_on_within_an_interval_hardly_shows() -> None:
    """The jerk steps at the corners of a ramp: there one sample errs, no drift follows."""
    rate, force = against_parts(paper_like(LATITUDE_RAD, 4), 0.002)
    assert np.abs(rate).max() * 0.002 < 1e-12  # rad
    assert np.abs(rate.mean(axis=0)).max() < 1e-6 * DEG_PER_HOUR
    assert np.abs(force).max() < 1e-6
    assert np.abs(force.mean(axis=0)).max() < 1e-9


def test_a_slow_sensor_takes_the_mean_over_the_engine_too() -> None:
    base = RockingBase(nominal(LATITUDE_RAD, 4))
    slow, _ = base.felt(np.array([1.0, 2.0]), 1.0)
    fast, _ = base.felt(ends(0.001, 2.0), 0.001)
    assert_allclose(slow, fast.reshape(2, 1000, 3).mean(axis=1), atol=1e-6 * DEG_PER_HOUR)


def test_a_lever_arm_feels_the_second_derivative_of_its_way() -> None:
    """The sensors' place by the attitude's oracle, differentiated twice by central differences."""
    swinging = replace(nominal(LATITUDE_RAD, 2), sway_rms_g=0.0, people=None)
    base = RockingBase(replace(swinging, engine=(EngineOrder(11.5, 0.0, 20.0 * ARCSEC),)))
    step_s, time_s = 2e-4, ends(0.013, 5.0)
    arm = np.array(base.settings.lever_arm_m)
    places = [in_n(base, time_s + k * step_s, arm) for k in (-2, -1, 0, 1, 2)]
    weights = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * step_s**2)
    acceleration = np.tensordot(weights, np.array(places), 1)
    speed = np.tensordot(np.array([1, -8, 0, 8, -1]) / (12.0 * step_s), np.array(places), 1)
    earth = EARTH_RATE_RAD_S * np.array([0.0, np.cos(LATITUDE_RAD), np.sin(LATITUDE_RAD)])
    up = np.array([0.0, 0.0, base.settings.gravity()])
    expected = (acceleration + 2.0 * np.cross(earth, speed) + up) / STANDARD_GRAVITY
    _, force = base.felt(time_s + 5e-7, 1e-6)
    assert np.abs(acceleration).max() > 0.1
    assert_allclose(in_n(base, time_s, force), expected, atol=2e-8)


def test_a_velocity_over_the_turning_earth_is_felt_as_coriolis_has_it() -> None:
    """Sway at 1 mHz: the East velocity is a quarter period behind its acceleration."""
    moving = RockingBase(replace(at_rest(), sway_rms_g=1e-3, sway_band_hz=(1e-3, 1e-3)))
    time_s = ends(5.0, 1000.0)
    force = in_n(moving, time_s, moving.felt(time_s + 0.005, 0.01)[1]) * STANDARD_GRAVITY
    up = force[:, 2] - moving.settings.gravity()
    gain = 2.0 * EARTH_RATE_RAD_S * np.cos(LATITUDE_RAD) / (2.0 * np.pi * 1e-3)
    lifted = -gain * np.roll(
        force[:, 0], 50
    )  # -2 Omega cos(lat) v_E; v_E(t) = a_E(t - T/4) / omega
    assert np.abs(lifted).max() > 1e-4
    assert_allclose(up, lifted, atol=0.06 * np.abs(lifted).max())


@PRESETS
def test_over_long_the_force_is_gravity_up(preset: Preset) -> None:
    base, period_s = RockingBase(preset(LATITUDE_RAD, 6)), 0.004
    time_s = ends(period_s, 600.0)
    force = in_n(base, time_s - period_s / 2, base.felt(time_s, period_s)[1])
    sway_g = base.settings.sway_rms_g
    bound_g = 1e-6 + 6 * sway_g / (2 * np.pi * 0.1 * 600.0)  # what six unfinished tones leave
    gravity_g = Truth(LATITUDE_RAD, 0.0, 0.0, 0.0).gravity() / STANDARD_GRAVITY
    assert np.abs(force.mean(axis=0) - [0.0, 0.0, gravity_g]).max() < bound_g


@pytest.mark.parametrize(
    ("preset", "rms_g", "band_hz"), [(nominal, 2e-4, (0.1, 0.3)), (paper_like, 1.2e-3, (0.1, 0.2))]
)
def test_the_sway_has_its_strength_in_its_band(
    preset: Preset, rms_g: float, band_hz: tuple[float, float]
) -> None:
    chosen = preset(LATITUDE_RAD, 1)
    swaying = replace(at_rest(), sway_rms_g=chosen.sway_rms_g, sway_band_hz=chosen.sway_band_hz)
    base, time_s = RockingBase(swaying), ends(0.5, 20_000.0)
    force = in_n(base, time_s, base.felt(time_s, 1e-3)[1])
    assert_allclose(force[:, :2].std(axis=0), rms_g, rtol=0.02)
    hz, power = periodogram(force[:, :2], 2.0, "blackmanharris", axis=0)
    inside = (hz > band_hz[0] - 0.001) & (hz < band_hz[1] + 0.001)
    assert power[~inside].sum() < 1e-6 * power[inside].sum()
    peaks = power > 0.02 * power.max()
    assert np.all(np.diff(peaks.astype(int), axis=0).clip(0).sum(axis=0) >= 4)  # some stand close


def test_the_swings_and_the_engine_have_the_papers_figures() -> None:
    base = RockingBase(replace(nominal(LATITUDE_RAD, 8), people=None))
    time_s = ends(0.01, 4000.0)
    angle = Rotation.from_matrix(base.attitude(time_s)).as_euler("ZXY")
    hz, amplitude = amplitudes(angle, 100.0)
    swung = zip([0.02, 0.03, 0.05], [0.13, 0.21, 0.17], amplitude.T, strict=True)
    for amplitude_deg, frequency_hz, column in swung:
        low = hz < 1.0
        assert column[low].max() == pytest.approx(amplitude_deg * DEG, rel=0.11)
        assert hz[low][column[low].argmax()] == pytest.approx(frequency_hz, rel=0.11)
    for frequency_hz, arc_seconds in ((23.0, 4.0), (11.5, 3.0)):
        column = amplitude[np.abs(hz - frequency_hz).argmin()]
        assert_allclose(column, arc_seconds * ARCSEC, rtol=1e-3)


def test_the_engine_shakes_each_axis_by_its_acceleration() -> None:
    base = RockingBase(replace(at_rest(), engine=nominal(0.0, 0).engine, lever_arm_m=(0, 0, 0)))
    time_s = ends(0.002, 100.0)
    force = in_n(base, time_s, base.felt(time_s, 1e-5)[1]) * STANDARD_GRAVITY
    hz, amplitude = amplitudes(force, 500.0)
    for frequency_hz, acceleration_m_s2 in ((23.0, 0.10), (11.5, 0.05)):
        column = amplitude[np.abs(hz - frequency_hz).argmin()]
        assert_allclose(column, acceleration_m_s2, rtol=0.01)


def test_the_suspension_answers_its_loads_as_a_damped_oscillator_does() -> None:
    """Two minutes of everyone aboard, by scipy's linear systems from the loads alone."""
    people = People(fade_s=30.0)  # so that every load that counts begins within five minutes
    boarding, step_s = Boarding(people, 11), 1e-3
    time_s = ends(step_s, 115.0, 62.0)
    load = np.zeros((len(time_s), 3))
    for each in map(boarding.loads, range(-6, 4)):
        on, off = (np.subtract.outer(time_s, start_s) for start_s in (each.on_s, each.off_s))
        aboard = np.clip(on / people.ramp_s, 0.0, 1.0) - np.clip(off / each.going_s, 0.0, 1.0)
        load += aboard @ each.lean
    value, first, second = boarding.motion(time_s)
    for dof, (frequency_hz, damping) in enumerate([(1.5, 0.22), (1.3, 0.20), (1.4, 0.25)]):
        omega = 2.0 * np.pi * frequency_hz
        plant = ([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]], [[0.0], [omega**2]],
                 np.eye(2), np.zeros((2, 1)))  # fmt: skip
        start = [value[0, dof], first[0, dof]]
        _, state, _ = lsim(plant, load[:, dof], time_s - time_s[0], X0=start)
        scale = np.abs(value[:, dof]).max()
        assert_allclose(value[:, dof], state[:, 0], atol=1e-5 * scale)
        assert_allclose(first[:, dof], state[:, 1], atol=1e-4 * scale)
        pull = omega**2 * (load[:, dof] - state[:, 0]) - 2.0 * damping * omega * state[:, 1]
        assert_allclose(second[:, dof], pull, atol=1e-3 * scale)


def test_people_come_stay_and_lean_as_often_and_as_much_as_they_should() -> None:
    boarding, minutes = Boarding(People(), 12), range(-300, 300)
    loads = [boarding.loads(minute) for minute in minutes]
    on_s, off_s, going_s = (
        np.concatenate([getattr(each, name) for each in loads])
        for name in ("on_s", "off_s", "going_s")
    )
    lean = np.concatenate([each.lean for each in loads])
    low, high = poisson.interval(CONFIDENCE, 36_000 / 12)
    assert low < len(on_s) < high
    gaps_s = np.diff(np.sort(on_s))
    assert np.mean(gaps_s > 12.0) == pytest.approx(np.exp(-1.0), abs=0.03)
    leaves, stay_s = going_s == 0.6, off_s - on_s
    low, high = binom.interval(CONFIDENCE, len(on_s), 0.5)
    assert low < leaves.sum() < high
    assert 2.0 <= stay_s[leaves].min() < 2.05
    assert 9.95 < stay_s[leaves].max() <= 10.0
    assert np.all(going_s[~leaves] >= 1200.0)
    low, high = chi2.interval(CONFIDENCE, len(on_s))
    square = (lean**2).sum(axis=0) / np.array([0.05 * DEG, 0.10 * DEG, 2e-3]) ** 2
    assert np.all((low < square) & (square < high))


@PRESETS
def test_chunks_do_not_show(preset: Preset) -> None:
    """Across minutes, in any order, and long records against single samples."""
    time_s, period_s = ends(0.02, 130.0, -65.0), 0.02
    whole = RockingBase(preset(LATITUDE_RAD, 9)).felt(time_s, period_s)
    chunked, cuts = RockingBase(preset(LATITUDE_RAD, 9)), [1, 2, 50, 3251, 4000, 6400]
    pieces = [chunked.felt(part, period_s) for part in reversed(np.split(time_s, cuts))]
    for k, limit in enumerate((1e-15, 1e-14)):
        pieced = np.concatenate([piece[k] for piece in reversed(pieces)])
        assert_allclose(pieced, whole[k], rtol=0.0, atol=limit)


def test_a_record_longer_than_a_block_is_the_same_as_its_halves() -> None:
    base, time_s = RockingBase(nominal(LATITUDE_RAD, 9)), ends(0.002, 60.0)
    whole = base.felt(time_s, 0.002)
    halves = [base.felt(half, 0.002) for half in np.split(time_s, 2)]
    for k in (0, 1):
        halved = np.concatenate([half[k] for half in halves])
        assert_allclose(halved, whole[k], rtol=0.0, atol=1e-14)


def test_equal_seeds_move_alike_and_others_do_not() -> None:
    time_s = ends(0.1, 20.0)
    one, same, other = (
        RockingBase(paper_like(LATITUDE_RAD, k)).felt(time_s, 0.1) for k in (1, 1, 2)
    )
    for k in (0, 1):
        np.testing.assert_array_equal(one[k], same[k])
    assert np.abs(one[1] - other[1]).std() > 1e-3


def test_the_motion_has_no_beginning_and_what_is_forgotten_comes_back() -> None:
    base = RockingBase(nominal(LATITUDE_RAD, 10))
    early = base.attitude(ends(0.5, 30.0, -90_000.0))
    for minute in range(100):
        base.attitude(np.array([60.0 * minute]))
    np.testing.assert_array_equal(early, base.attitude(ends(0.5, 30.0, -90_000.0)))
    across = base.attitude(ends(0.001, 4.0, -2.0))
    assert np.abs(np.diff(across, axis=0)).max() < 2e-5
    assert np.ptp(early, axis=0).max() > 1e-4


def test_people_never_lean_a_base_over() -> None:
    """Eight hours of a day: who stays, fades; roll is 0.1 deg sqrt(1200 / 3 / 24) = 0.41 deg."""
    boarding = Boarding(People(), 13)
    roll = np.concatenate(
        [boarding.motion(ends(30.0, 3600.0, 3600.0 * k))[0][:, 1] for k in range(0, 24, 3)]
    )
    assert 0.2 * DEG < roll.std() < 0.8 * DEG


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"latitude_rad": 39.1}, "the latitude must lie within"),
        ({"latitude_rad": np.nan}, "the latitude must lie within"),
        ({"sway_band_hz": (0.3, 0.1)}, "lower end first"),
        ({"sway_rms_g": -1.0}, "no negative strength"),
        ({"lever_arm_m": (0.0, np.inf, 0.0)}, "must be finite numbers"),
        ({"seed": -1}, "a seed must not be negative, got -1"),
    ],
)
def test_settings_that_no_base_could_keep_are_refused(
    change: dict[str, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        replace(nominal(LATITUDE_RAD, 1), **change)  # type: ignore[arg-type]


def test_people_and_springs_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="nobody leaves before having got on"):
        People(stay_s=(0.5, 10.0))
    with pytest.raises(ValueError, match="a damping ratio between 0 and 1"):
        People(springs=(Spring(1.5, 1.0), Spring(1.3, 0.2), Spring(1.4, 0.2)))


@pytest.mark.parametrize("time_s", [[], [[1.0]], [1.0, np.nan]])
def test_times_that_are_none_are_refused(time_s: list[float]) -> None:
    base = RockingBase(nominal(LATITUDE_RAD, 1))
    with pytest.raises(ValueError, match="finite seconds of shape"):
        base.attitude(np.array(time_s))
    with pytest.raises(ValueError, match="finite seconds of shape"):
        base.felt(np.array(time_s), 0.01)
    with pytest.raises(ValueError, match="positive number of seconds, got 0"):
        base.felt(np.array([1.0]), 0.0)


@pytest.mark.alone
def test_bursts_at_1_khz_take_a_small_part_of_a_core() -> None:
    base = RockingBase(nominal(LATITUDE_RAD, 1))
    base.felt(ends(0.001, 0.02), 0.001)
    began_s = time.process_time()
    for burst in range(1, 501):
        base.felt(ends(0.001, 0.02, 0.02 * burst), 0.001)
    assert time.process_time() - began_s < 0.05 * 10.0  # 1 to 2 % on computers of 2026
