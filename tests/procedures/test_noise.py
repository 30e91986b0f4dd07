"""Static records by the drivers' own bytes: what was put into the sensors comes out of them."""

import math
from typing import Any

import pytest

from northfinder.procedures import noise
from northfinder.procedures.events import Event, SoFar, VisitCompleted
from northfinder.procedures.noise import Plan
from northfinder.procedures.north_seek import Plan as NorthSeek
from northfinder.wiring.defaults import with_latitude
from sim.world import World
from tests.procedures.rigs import Meanwhile, Outcome, config_of, nothing, seek

TWO_MINUTES = Plan(duration_s=120.0)
SENSORS = {
    "gyro_noise_deg_sqrt_h": 0.002,
    "gyro_bias_instability_deg_h": 0.1,
    "accel_noise_g_sqrt_hz": 3e-5,
}


def recorded(meanwhile: Meanwhile = nothing, **simulation: Any) -> Outcome:  # noqa: ANN401
    return seek(TWO_MINUTES, meanwhile, simulation={**SENSORS, **simulation})


@pytest.fixture(scope="module")
def record() -> Outcome:
    return recorded()


def test_the_noise_put_in_comes_out_within_its_interval(record: Outcome) -> None:
    gyro, accelerometer = record.completed["gyro"], record.completed["accelerometer"]
    for sensor, key, truth in (
        (gyro, "angle_random_walk_deg_sqrt_h", 0.002),
        (gyro, "bias_instability_deg_h", 0.1),
        (accelerometer, "noise_g_sqrt_hz", 3e-5),
    ):
        assert sensor[key]["lower"] <= truth <= sensor[key]["upper"]
    walk = gyro["angle_random_walk_deg_sqrt_h"]
    assert walk["upper"] - walk["lower"] < 0.04 * walk["value"]
    # Two minutes do not show it, and no figure is made up: a bound stands for it.
    assert gyro["bias_instability_deg_h"]["value"] is None
    assert {check["status"] for check in record.completed["checks"]} == {"pass"}


def test_the_curve_begins_at_the_samples_and_falls_as_white_noise(record: Outcome) -> None:
    allan = record.completed["gyro"]["allan"]
    assert allan["tau_s"][0] == 0.001
    for tau_s, deviation in zip(allan["tau_s"], allan["deviation"], strict=True):
        if tau_s < 0.2:
            white_deg_h = 0.002 * 60.0 / math.sqrt(tau_s)
            assert deviation == pytest.approx(white_deg_h, rel=0.05)


def test_a_dwell_is_suggested_that_a_north_seek_takes(record: Outcome) -> None:
    suggestion = record.completed["suggestion"]
    assert suggestion["dwell_s"] >= record.completed["plan"]["pause_s"]
    result = seek(NorthSeek(positions=4, dwell_s=suggestion["dwell_s"]))
    assert result.completed["azimuth_deg"] == pytest.approx(48.0, abs=2.0)


def test_it_is_told_whenever_it_has_doubled_and_computed_again_from_its_visits(
    record: Outcome,
) -> None:
    visits = [event.visit for event in record.events if isinstance(event, VisitCompleted)]
    told = [event for event in record.events if isinstance(event, SoFar)]
    assert len(visits) == 24
    assert len(told) == 5  # after 1, 2, 4, 8 and 16
    plan = Plan.model_validate(record.completed["plan"])
    again = noise.reduce_visits(visits, plan, with_latitude(config_of()))
    expected = {key: value for key, value in record.completed.items() if key != "plan"}
    assert noise.result_json(again) == expected


def test_lost_samples_are_filled_and_told() -> None:
    def drop(world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted):
            world.faults("gyro").drop_per_byte = 2e-5

    result = recorded(drop).completed
    assert result["gyro"]["filled"] > 10
    assert result["gyro"]["angle_random_walk_deg_sqrt_h"]["value"] == pytest.approx(0.002, rel=0.05)


def test_a_bench_that_is_tilted_meanwhile_is_told() -> None:
    def tilt(world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 20:
            settings = world.bench.truth
            world.bench.set_down(type(settings)(settings.latitude_rad, 1.0, 0.02, 0.02), None)

    checks = {check["name"]: check["status"] for check in recorded(tilt).completed["checks"]}
    assert checks["stillness"] == "warn"


def test_a_sensor_that_falls_silent_fails_the_run_and_leaves_what_was_measured() -> None:
    def pull(world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 2:
            world.faults("accelerometer").silent = True

    outcome = recorded(pull)
    assert outcome.reason.startswith("after 3 of 24 stretches: ")
    assert outcome.at_rest


def test_a_short_record_is_warned_of_and_no_record_is_carried_on() -> None:
    assert noise.RESUMABLE is False
    with pytest.raises(ValueError, match="greater than or equal to 20"):
        Plan(duration_s=1.0)
