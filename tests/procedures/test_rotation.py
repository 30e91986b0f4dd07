"""A table that turns steadily: north through drivers and bytes, out and back, and interrupted."""

import math
from typing import Any

import numpy as np
import pytest

from drivers.interfaces import MotionLimits
from northfinder.errors import AcquisitionError, ConfigError
from northfinder.procedures.events import Event, Progress, VisitCompleted
from northfinder.procedures.north_seek import Plan, predict, reduce_visits
from northfinder.procedures.north_seek_json import JsonObject, north_seek_json
from northfinder.procedures.plan import drift_orders
from northfinder.procedures.steady import SteadyLine
from northfinder.procedures.visits import Direction, Visit, schedule
from northfinder.samples import Samples
from northfinder.validation import validated
from northfinder.wiring import build_rig, with_latitude
from sim.world import World
from tests.estimators.truth import DEG, DEG_PER_HOUR, Array, read
from tests.evidence import Record
from tests.procedures.lives import crash_after, live, pause_after
from tests.procedures.rigs import config_of, seek, sigmas_off, virtually

TURN = Plan(modulation="continuous", dwell_s=1.0, settle_s=0.1)
KNOWN = {"noise_deg_sqrt_h": 0.001}
LIMITS = MotionLimits(120.0 * DEG, 360.0 * DEG)
G = 0.9977


@pytest.mark.parametrize("driver", ["zaber", "cia402"])
@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.proof) for seed in range(2, 20))]
)
def test_north_is_within_four_stated_sigma(driver: str, seed: int, record_property: Record) -> None:
    outcome = seek(TURN, simulation={"seed": seed}, turntable={"driver": driver}, gyro=KNOWN)
    record_property("measured", f"{driver}: {sigmas_off(outcome.completed, 48.0):.2f} sigma off")
    assert sigmas_off(outcome.completed, 48.0) < 4.0
    assert outcome.at_rest
    assert [visit["lost"] for visit in outcome.completed["visits"]] == [0] * 48


@pytest.mark.parametrize("driver", ["zaber", "cia402"])
@pytest.mark.parametrize("azimuth_deg", [48.0, 211.0])
def test_without_noise_what_remains_is_thousandths_of_a_degree(
    driver: str, azimuth_deg: float
) -> None:
    noise_free = {"gyro_noise_deg_sqrt_h": 0.0, "accel_noise_g_sqrt_hz": 0.0}
    simulated = {**noise_free, "azimuth_deg": azimuth_deg, "pitch_deg": 5.0, "roll_deg": -3.0}
    result = seek(TURN, simulation=simulated, turntable={"driver": driver}).completed
    assert result["azimuth_deg"] == pytest.approx(azimuth_deg, abs=0.003)
    assert result["tilt"]["pitch_deg"] == pytest.approx(5.0, abs=0.02)
    rate = result["earth_rate"]  # a mean over 15 deg feels 0.29 % less of it
    expected = pytest.approx(rate["horizontal_expected_deg_h"], rel=2e-4)
    assert rate["horizontal_measured_deg_h"] == expected


def test_it_takes_as_long_as_predicted_and_less_than_stopping() -> None:
    config = config_of()

    async def ask(plan: Plan) -> float:
        async with build_rig(config) as rig:
            prediction = predict(plan, rig)
            return prediction.duration_s - prediction.homing_s

    turning_s = virtually(config, ask(TURN))
    outcome = seek(TURN)
    starts = [visit["start_s"] for visit in outcome.completed["visits"]]
    assert starts[-1] - starts[0] + 0.5 == pytest.approx(turning_s, rel=0.1)
    assert turning_s < virtually(config, ask(Plan(dwell_s=1.0, settle_s=0.1)))


def test_the_gyro_saw_every_sector_pass_and_which_way() -> None:
    result = seek(TURN).completed
    for before, visit in zip(result["visits"], result["visits"][1:], strict=False):
        if before["segment"] == visit["segment"]:
            way = 15.0 if visit["direction"] == "out" else -15.0
            assert visit["turned_deg"] == pytest.approx(way, abs=0.05)
    (table,) = [check for check in result["checks"] if check["name"] == "table"]
    assert table["status"] == "pass"


def test_a_table_that_turns_the_other_way_than_configured_fails_the_check() -> None:
    def swap(world: World, _: Event) -> None:
        world.bench._direction = -1.0

    result = seek(TURN, swap).completed
    (table,) = [check for check in result["checks"] if check["name"] == "table"]
    assert table["status"] == "fail"


def test_a_target_is_looked_for_after_each_turn_out_and_back() -> None:
    plan = TURN.model_copy(update={"target_sigma_deg": 0.06, "most_visits": 480, "dwell_s": 0.5})
    result = seek(plan, gyro=KNOWN).completed
    assert len(result["visits"]) % 48 == 0
    assert 48 < len(result["visits"]) < 480
    assert result["azimuth_sigma_deg"] <= 0.06


@pytest.mark.parametrize("crash_at", [2, 24, 30])
def test_a_turn_that_was_interrupted_goes_on_where_it_was(crash_at: int) -> None:
    first = live(TURN, watch=crash_after(crash_at), gyro=KNOWN)
    second = live(TURN, first.visits, gyro=KNOWN)
    planned = [visit for visit in second.visits if visit.repeats is None]
    expected = [visit.angle_rad for visit in schedule(24, 1.0, "rotation", 1)]
    assert [visit.angle_rad for visit in planned] == pytest.approx(expected, abs=0.1 * DEG)
    assert len(planned) == 48
    result, config = second.completed, with_latitude(config_of(gyro=KNOWN))
    assert sigmas_off(result, 48.0) < 4.0
    assert north_seek_json(reduce_visits(second.visits, TURN, config)) == result
    assert second.kinds().count("SegmentOpened") == 1


def test_a_bench_that_was_turned_meanwhile_is_refused() -> None:
    first = live(TURN, watch=crash_after(30), gyro=KNOWN)
    second = live(TURN, first.visits, gyro=KNOWN, simulation={"azimuth_deg": 60.0})
    assert "the bench has moved since the visits before the interruption" in second.refusal


def test_a_pause_breaks_the_turn_off_after_a_sector() -> None:
    paused = live(TURN, watch=pause_after(6, 0.5), gyro=KNOWN)  # shorter than a dwell
    planned = [visit for visit in paused.visits if visit.repeats is None]
    assert [visit.segment for visit in planned] == [0] * 6 + [1] * 18 + [2] * 24
    assert sigmas_off(paused.completed, 48.0) < 4.0


def test_a_stop_leaves_the_table_standing() -> None:
    def fail(_: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 4:
            msg = "the disk is full"
            raise OSError(msg)

    outcome = seek(TURN, fail)
    assert isinstance(outcome.error, OSError)
    assert outcome.at_rest


@pytest.mark.parametrize("driver", ["zaber", "cia402"])
def test_an_obstacle_in_the_way_ends_the_turn_and_says_where(driver: str) -> None:
    def block(world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 2:
            world.plate.block_at(100.0 * DEG)

    outcome = seek(TURN, block, turntable={"driver": driver})
    assert isinstance(outcome.error, AcquisitionError)
    assert "the turn out, from 7.5 deg: " in outcome.reason
    assert "at 100 deg" in outcome.reason
    assert outcome.at_rest


def test_a_gyro_that_falls_silent_ends_the_turn() -> None:
    def unplug(world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 2:
            world.faults("gyro").silent = True

    outcome = seek(TURN, unplug)
    assert isinstance(outcome.error, AcquisitionError)
    assert outcome.at_rest


def test_progress_names_every_sector_and_ends_at_all() -> None:
    progress = [event for event in seek(TURN).events if isinstance(event, Progress)]
    fractions = [event.fraction for event in progress]
    assert fractions == sorted(fractions)
    assert (fractions[-1], progress[-1].left_s) == (1.0, 0.0)
    assert {event.visit for event in progress} == set(range(1, 49))


# What a plan may ask for.


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"order": "opposite"}, "a table that turns steadily goes out and back"),
        ({"positions": 8}, "8 sectors are too wide"),
        ({"modulation": "auto"}, "modulation 'auto' goes with order 'auto'"),
    ],
)
def test_what_does_not_go_with_a_steady_turn_is_refused(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        validated(Plan, {"modulation": "continuous", **wrong}, "plan")


def test_a_turn_faster_than_the_table_is_refused() -> None:
    config = config_of()

    async def ask() -> None:
        async with build_rig(config) as rig:
            predict(TURN.model_copy(update={"dwell_s": 0.2}), rig)

    with pytest.raises(
        ConfigError, match=r"would have to turn at 150 deg/s, and turns at up to 120"
    ):
        virtually(config, ask())


def test_passages_cancel_a_drift_in_pairs_alone() -> None:
    assert drift_orders("rotation", [24, 24]) == (0, 0)
    assert drift_orders("rotation", [24] * 8) == (0,) * 8
    assert drift_orders("rotation", [24]) == (1,)
    assert drift_orders("rotation", [24, 11, 13]) == (1, 1, 1)


# What the reduction makes of it, from readings by matrices.


def passages(
    azimuth_deg: float,
    *,
    bias_deg_h: tuple[float, float] = (0.0, 0.0),
    drift_deg_h_h: float = 0.0,
    late_s: float = 0.0,
) -> list[Visit]:
    """Return the visits of one turn out and back by the closed form of each sector's mean."""
    random = np.random.default_rng(5)
    speed_rad_s = 2 * np.pi / 24 / 0.5
    visits = []
    for planned in schedule(24, 1.0, "rotation", 1):
        way = 1.0 if planned.direction == "out" else -1.0
        begin_s = 0.5 * planned.index
        true_rad = planned.angle_rad + way * speed_rad_s * np.linspace(-0.25, 0.25, 501)
        felt = read(
            azimuth_deg * DEG, 0.01, -0.02, 40.0 * DEG, true_rad - way * speed_rad_s * late_s
        )
        drift = drift_deg_h_h * begin_s / 3600.0
        offset = (bias_deg_h[planned.direction == "back"] + drift) * DEG_PER_HOUR
        rate: Array = felt.rate_rad_s + offset + random.normal(0.0, 1e-12, 501)
        force: Array = felt.force_g * G + random.normal(0.0, 1e-9, 501)
        visits.append(
            _visit(planned.index, planned.direction, planned.angle_rad, begin_s, rate, force)
        )
    return visits


def _visit(  # noqa: PLR0917
    index: int, direction: Direction, angle_rad: float, begin_s: float, rate: Array, force: Array
) -> Visit:
    tick = np.arange(len(rate))
    valid = np.ones(len(rate), bool)
    gyro, accelerometer = (
        Samples(tick, begin_s + tick / 1000.0, values, valid, len(values))
        for values in (rate, force)
    )
    segment = 0 if direction == "out" else 1
    return Visit(index, segment, direction, angle_rad, begin_s, None, gyro, accelerometer)


def reduced(visits: list[Visit]) -> JsonObject:
    config = config_of(site={"latitude_deg": 40.0, "gravity_m_s2": G * 9.80665})
    return north_seek_json(reduce_visits(visits, TURN, config))


def passages_check(result: JsonObject) -> str:
    (found,) = [check for check in result["checks"] if check["name"] == "passages"]
    return str(found["detail"])


def test_an_axis_that_feels_the_turning_has_another_bias_each_way() -> None:
    """A milliradian off perpendicular at 30 deg/s: 108 deg/h, this way and that."""
    result = reduced(passages(73.0, bias_deg_h=(108.0, -108.0)))
    assert result["azimuth_deg"] == pytest.approx(73.0, abs=1e-4)
    biases = [segment["R_deg_h"] for segment in result["segments"]]
    assert biases == pytest.approx([108.0, -108.0], abs=1e-3)


def test_out_and_back_cancel_a_delay_and_say_how_long_it_is() -> None:
    result = reduced(passages(73.0, late_s=0.02))
    assert result["azimuth_deg"] == pytest.approx(73.0, abs=1e-4)
    assert "differ by 1.200 deg" in passages_check(result)  # 2 x 30 deg/s x 20 ms
    assert "behind the table's positions 20 ms" in passages_check(result)


def test_out_and_back_cancel_a_linear_drift() -> None:
    result = reduced(passages(73.0, drift_deg_h_h=10.0))
    assert result["azimuth_deg"] == pytest.approx(73.0, abs=1e-3)


# The line through the table's positions.


def line(speed_deg_s: float, wobble_deg: float = 0.0, told_deg_s: float = 6.0) -> SteadyLine:
    found = SteadyLine(told_deg_s * DEG, LIMITS)
    for k in range(100):
        time_s = 50.0 + 0.05 * k
        wobble = wobble_deg * math.sin(2.0 * k)
        found.add(time_s, (10.0 + speed_deg_s * 0.05 * k + wobble) * DEG)
    return found


def test_a_line_tells_the_angle_at_any_time_and_back() -> None:
    known = line(6.0)
    assert known.angle_rad(52.0) == pytest.approx(22.0 * DEG, rel=1e-9)
    assert known.time_s(22.0 * DEG) == pytest.approx(52.0, rel=1e-9)


def test_a_table_that_turns_at_another_speed_is_refused() -> None:
    with pytest.raises(AcquisitionError, match=r"turns at 5\.5 deg/s and was told .* 6 deg/s"):
        line(5.5).angle_rad(52.0)


def test_a_table_that_turns_unsteadily_is_refused() -> None:
    with pytest.raises(AcquisitionError, match=r"not turn steadily: .* 0\.3\d? deg"):
        line(6.0, 0.5).angle_rad(52.0)
