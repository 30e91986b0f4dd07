"""North so far, and what can be judged of it already."""

import time

import numpy as np
import pytest

from northfinder.procedures.north_seek_json import estimate_json
from northfinder.procedures.plan import Plan
from northfinder.procedures.reduction import reduce_visits
from northfinder.procedures.so_far import estimate_so_far
from tests.procedures.benches import Bench
from tests.procedures.rigs import config_of

CONFIG = config_of(site={"latitude_deg": 40.0})
PLAN = Plan()


def after(visits: int, plan: Plan = PLAN) -> Bench:
    return Bench(np.random.default_rng(3), visits=[]).follow(plan, visits)


@pytest.mark.parametrize("visits", [0, 1, 2])
def test_there_is_no_north_before_three_angles(visits: int) -> None:
    assert estimate_so_far(after(visits).visits, PLAN, CONFIG) is None


def names(visits: int) -> list[str]:
    estimate = estimate_so_far(after(visits).visits, PLAN, CONFIG)
    assert estimate is not None
    return [check.name for check in estimate.checks]


def test_checks_appear_as_soon_as_they_can_be_judged() -> None:
    always = ["earth rate", "table", "tilt", "latitude"]
    always += ["lost samples", "invalid samples", "spikes"]
    assert names(3) == names(4) == always
    assert names(5) == ["residuals", "accelerometer residuals", "outliers", *always]
    assert names(48) == names(5)  # a drift is judged by the result alone


def test_an_estimate_is_told_in_the_result_s_own_names() -> None:
    bench = after(30)
    estimate = estimate_so_far(bench.visits, PLAN, CONFIG)
    assert estimate is not None
    told = estimate_json(estimate)
    assert told["visits"] == 30
    assert told["azimuth_deg"] == pytest.approx(48.0, abs=4 * told["azimuth_sigma_deg"])
    assert told["tilt"]["pitch_deg"] == pytest.approx(0.8, abs=0.01)
    assert told["segments"] == [
        {"segment": 0, "R_deg_h": told["gyro_fit"]["R_deg_h"], "drift_deg_h_h": None}
    ]
    assert told["gyro_fit"]["dof"] == 27
    assert {check["status"] for check in told["checks"]} == {"pass"}
    assert "seen within the visits" in told["checks"][0]["detail"]


def test_residuals_are_held_against_the_configured_noise_at_the_end() -> None:
    known = config_of(site={"latitude_deg": 40.0}, gyro={"noise_deg_sqrt_h": 0.001})
    seek = reduce_visits(after(48).visits, PLAN, known)
    assert "the sigma given" in seek.checks[0].detail
    assert "seen within the visits" in seek.checks[1].detail


@pytest.mark.alone
def test_the_estimate_of_a_long_run_costs_little_more_than_its_visits() -> None:
    """Growing with the square of the visits, 1440 would cost 900 times what 48 do."""

    def cost_s(visits: int) -> float:
        plan = Plan(positions=720, dwell_s=1.0)
        bench = after(visits, plan)
        estimate_so_far(bench.visits, plan, CONFIG)
        begun_s = time.perf_counter()
        for _ in range(3):
            estimate_so_far(bench.visits, plan, CONFIG)
        return time.perf_counter() - begun_s

    assert cost_s(1440) < 20 * cost_s(48)
