"""Alignments by the drivers' own bytes, on a bench that stands, and in a vehicle that rocks."""

import math
import time
from typing import Any

import pytest

from northfinder.config import RigConfig
from northfinder.procedures import alignment
from northfinder.procedures.alignment import Plan
from northfinder.procedures.events import Event, Progress, SoFar, VisitCompleted, Warned
from northfinder.wiring.defaults import with_latitude
from sim.world import World
from tests.evidence import Record
from tests.procedures.rigs import Outcome, config_of, seek, sigmas_off, silent_for

#: The paper's instruments: 0.01 deg/h, 5e-4 deg/sqrt(h), 5e-6 g/sqrt(Hz).
GOOD = {
    "gyro_bias_deg_h": 0.01,
    "gyro_noise_deg_sqrt_h": 5e-4,
    "accel_noise_g_sqrt_hz": 5e-6,
}
MINUTE = Plan(duration_s=60.0)


def vehicle(seed: int = 1) -> dict[str, Any]:
    return {"simulation": {"base": "nominal", "seed": seed, **GOOD}}


def visits_of(outcome: Outcome) -> list[Any]:
    return [event.visit for event in outcome.events if isinstance(event, VisitCompleted)]


def recomputed(outcome: Outcome, config: RigConfig) -> dict[str, Any]:
    plan = Plan.model_validate(outcome.completed["plan"])
    again = alignment.reduce_visits(visits_of(outcome), plan, with_latitude(config))
    return {**alignment.result_json(again), "plan": outcome.completed["plan"]}


@pytest.mark.parametrize("driver", ["kvh", "stim300"])
def test_a_rocking_vehicle_finds_its_heading(driver: str) -> None:
    sections = vehicle() | {"gyro": {"driver": driver}}
    outcome = seek(Plan(), **sections)
    result = outcome.completed
    assert sigmas_off(result, 48.0) < 4.0
    assert result["azimuth_sigma_deg"] < 0.06
    assert result["pitch_deg"] == pytest.approx(0.8, abs=0.5)  # of a vehicle that leans
    assert {check["status"] for check in result["checks"]} == {"pass"}
    assert recomputed(outcome, config_of(**sections)) == result


@pytest.mark.parametrize("method", alignment.METHODS)
def test_every_method_finds_it_on_a_base_at_rest(method: str) -> None:
    result = seek(
        Plan.model_validate({"duration_s": 60.0, "method": method}), simulation=dict(GOOD)
    ).completed
    assert sigmas_off(result, 48.0) < 4.0
    assert result["pitch_deg"] == pytest.approx(0.8, abs=0.002)
    assert result["roll_deg"] == pytest.approx(-0.5, abs=0.002)


def test_the_azimuth_is_the_marks_wherever_the_instrument_sits_and_the_table_stands() -> None:
    def turn(world: World, event: Event) -> None:
        if isinstance(event, Progress) and event.phase == "homing":
            world.plate.move_to(1.0, 1.0, 1.0, 0.0)

    sections: dict[str, Any] = {
        "gyro": {"axis": "-y", "mount_angle_deg": 130.0},
        "simulation": dict(GOOD),
        "site": {"latitude_deg": -33.0, "reference_offset_deg": 10.0},
    }
    result = seek(MINUTE, turn, **sections).completed
    assert sigmas_off(result, 48.0) < 4.0
    assert result["reference_azimuth_deg"] == pytest.approx(result["azimuth_deg"] + 10.0)


def test_a_bias_that_no_alignment_sees_is_in_its_uncertainty() -> None:
    result = seek(MINUTE, simulation={"gyro_bias_deg_h": 0.3}).completed
    bias = next(line for line in result["budget"] if line["source"] == "gyro bias")
    expected_deg = math.degrees(0.3 / (15.041067 * math.cos(math.radians(40.0))))
    assert bias["u_deg"] == pytest.approx(expected_deg, rel=0.01)
    assert sigmas_off(result, 48.0) < 4.0
    assert "gyro bias" in [check["name"] for check in result["checks"] if check["status"] == "warn"]


def test_live_headings_come_every_second_after_ten() -> None:
    outcome = seek(MINUTE, **vehicle())
    told = [event.numbers for event in outcome.events if isinstance(event, SoFar)]
    assert [round(each["time_s"]) for each in told] == list(range(10, 61))
    assert told[-1]["azimuth_sigma_deg"] < told[0]["azimuth_sigma_deg"] / 10
    assert len(visits_of(outcome)) == 12


def test_after_a_gap_that_cannot_be_bridged_it_begins_anew_and_says_so() -> None:
    outcome = seek(MINUTE, silent_for(3.0, (0.4, 0.42)), **vehicle())
    result = outcome.completed
    warned = [event.sentence for event in outcome.events if isinstance(event, Warned)]
    assert result["restarts"] == len(warned) > 0
    assert "begins anew" in warned[0]
    assert result["duration_s"] == pytest.approx(60.0, abs=1.0)
    assert sigmas_off(result, 48.0) < 4.0
    assert "gaps" in [check["name"] for check in result["checks"] if check["status"] == "warn"]
    assert recomputed(outcome, config_of(**vehicle())) == result


def test_a_few_lost_samples_are_bridged() -> None:
    def drop(world: World, event: Event) -> None:
        if isinstance(event, Progress):
            world.faults("gyro").drop_per_byte = 1e-5

    outcome = seek(MINUTE, drop, **vehicle())
    result = outcome.completed
    assert result["bridged_samples"] > 5
    assert result["restarts"] == 0
    assert sigmas_off(result, 48.0) < 4.0
    assert recomputed(outcome, config_of(**vehicle())) == result


def test_an_instrument_that_stays_silent_fails_the_run_and_keeps_what_there_is() -> None:
    def pull(world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 2:
            world.faults("gyro").silent = True

    outcome = seek(MINUTE, pull, **vehicle())
    assert "sent no valid sample" in outcome.reason
    assert len(visits_of(outcome)) >= 3
    assert outcome.at_rest


def test_an_instrument_of_one_axis_is_refused() -> None:
    fog = {
        "driver": "dbc",
        "file": "northfinder-fog.dbc",
        "message": "FOG_RATE",
        "signal": "rate",
        "bias_sigma_deg_h": 0.1,
    }
    outcome = seek(MINUTE, gyro=fog, accelerometer={"bias_sigma_g": 1e-4})
    assert "sends no valid rate y, rate z, force x" in outcome.reason


@pytest.mark.alone
def test_a_stream_of_1_khz_takes_less_than_a_fifth_of_one_core(record_property: Record) -> None:
    """Bytes, drivers, alignment and the simulated vehicle together."""
    began_s = time.process_time()
    outcome = seek(MINUTE, **vehicle())
    used_s = time.process_time() - began_s
    assert outcome.completed["plan"]["sample_period_s"] == 0.001
    record_property("measured", f"{100 * used_s / outcome.lasted_s:.1f} % of one core")
    assert used_s < 0.2 * outcome.lasted_s
