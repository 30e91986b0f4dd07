"""A heading held from a run's result, by the instrument's own bytes."""

import asyncio
import math
from typing import Any

import pytest

from northfinder.procedures import heading_hold
from northfinder.procedures.events import Event, Progress, SoFar, VisitCompleted
from northfinder.procedures.heading_hold import Plan, Start
from northfinder.wiring.defaults import with_latitude
from sim.world import World
from tests.procedures.rigs import Meanwhile, Outcome, config_of, seek, sigmas_off, silent_for

NORTH = Start(
    run_id="20261122T000000Z-000000",
    kind="north-seek",
    azimuth_deg=48.0,
    azimuth_sigma_deg=0.0,
    pitch_deg=0.8,
    roll_deg=-0.5,
    latitude_deg=40.0,
)
ALIGNED = NORTH.model_copy(update={"kind": "alignment"})
TWO_MINUTES = Plan(duration_s=120.0, start=NORTH)
WANDERING = {"gyro_bias_instability_deg_h": 0.05, "gyro_noise_deg_sqrt_h": 0.01}


def held(outcome: Outcome) -> list[dict[str, Any]]:
    return [event.numbers for event in outcome.events if isinstance(event, SoFar)]


@pytest.mark.parametrize("seed", range(4))
def test_the_heading_stays_within_its_growing_uncertainty(seed: int) -> None:
    outcome = seek(TWO_MINUTES, simulation={**WANDERING, "seed": seed})
    result = outcome.completed
    assert sigmas_off(result, 48.0) < 4.0
    assert [check["status"] for check in result["checks"]] == ["pass", "pass"]
    assert result["gyro_bias_deg_h"] == pytest.approx([0.3] * 3, abs=0.5)
    sigmas = [each["azimuth_sigma_deg"] for each in held(outcome)]
    assert sigmas == sorted(sigmas)
    assert sigmas[-1] > 10 * sigmas[31] > 0.0
    visits = [event.visit for event in outcome.events if isinstance(event, VisitCompleted)]
    plan, config = Plan.model_validate(result["plan"]), with_latitude(config_of())
    again = heading_hold.result_json(heading_hold.reduce_visits(visits, plan, config))
    assert again == {key: value for key, value in result.items() if key != "plan"}


def test_its_stated_growth_is_that_of_the_errors_stated() -> None:
    """Angle random walk and what a rest of 30 s leaves of the bias, worked out by hand."""
    result = seek(TWO_MINUTES, simulation={"gyro_noise_deg_sqrt_h": 0.01}).completed
    walk_deg = 0.01 * math.sqrt(120.0 / 3600.0)
    bias_deg = 0.01 / math.sqrt(30.0 / 3600.0) * 120.0 / 3600.0
    assert result["azimuth_sigma_deg"] == pytest.approx(math.hypot(walk_deg, bias_deg), rel=1e-6)


def test_after_an_alignment_a_vehicle_is_followed_without_a_rest() -> None:
    plan = Plan(duration_s=60.0, start=ALIGNED, method="four-sample")
    result = seek(plan, simulation={"base": "nominal", "gyro_bias_deg_h": 0.3}).completed
    assert result["plan"]["rest_s"] == 0.0
    assert result["azimuth_sigma_deg"] == pytest.approx(0.3 / 60.0, rel=0.1)
    assert abs(result["azimuth_deg"] - 48.0) < 0.05 + 3 * result["azimuth_sigma_deg"]


def turned_by(angle_rad: float, within: tuple[float, float]) -> Meanwhile:
    """Turn the plate under the instrument, counter-clockwise, once the hold is that far."""

    def turn(world: World, event: Event) -> None:
        if isinstance(event, Progress) and within[0] < event.fraction < within[1]:
            now_s = asyncio.get_running_loop().time()
            there_rad = world.plate.angle_at(now_s) + angle_rad
            world.plate.move_to(there_rad, math.radians(1.0), 1.0, now_s)

    return turn


def test_it_follows_what_the_base_turns() -> None:
    plan = Plan(duration_s=30.0, rest_s=5.0, start=NORTH)
    meanwhile = turned_by(math.radians(2.0), (0.50, 0.53))
    turned = seek(plan, meanwhile, simulation={"gyro_noise_deg_sqrt_h": 1e-4}).completed
    assert turned["azimuth_deg"] == pytest.approx(48.0 - 2.0, abs=0.01)


def test_a_base_that_does_not_rest_is_told() -> None:
    outcome = seek(TWO_MINUTES, turned_by(math.radians(20.0), (0.05, 0.06)))
    assert "while it should rest" in outcome.reason


def test_a_table_that_was_tilted_since_is_told() -> None:
    assert "it has moved since" in seek(TWO_MINUTES, simulation={"pitch_deg": 3.0}).reason


def test_a_gap_that_no_heading_is_carried_over_ends_it() -> None:
    reason = seek(TWO_MINUTES, silent_for(3.0, (0.5, 0.51))).reason
    assert "Find the heading again" in reason


def test_without_a_start_it_says_what_to_do() -> None:
    assert "find north or align first" in seek(Plan()).reason
