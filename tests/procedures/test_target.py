"""Runs that end at their target: where, by what right, and what happens where it is not reached."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from northfinder.procedures.events import Progress, VisitCompleted
from northfinder.procedures.north_seek import Plan, predict, reduce_visits
from northfinder.procedures.north_seek_json import JsonObject, north_seek_json
from northfinder.procedures.so_far import estimate_so_far
from northfinder.procedures.visits import Visit, schedule
from northfinder.proof.target_stop import stopped_seeks
from northfinder.units import DEG
from northfinder.wiring import build_rig, with_latitude
from tests.procedures.lives import crash_after, live, pause_after
from tests.procedures.rigs import Outcome, config_of, seek, sigmas_off, virtually

TARGET_DEG = 0.2
QUICK = Plan(positions=8, settle_s=0.1, target_sigma_deg=TARGET_DEG)
FEWEST = 12


def chosen(plan: Plan = QUICK, /, **sections: dict[str, Any]) -> Plan:
    config = config_of(**sections)

    async def ask() -> Plan:
        async with build_rig(config) as rig:
            return predict(plan, rig).plan

    return virtually(config, ask())


def visits_of(outcome: Outcome) -> list[Visit]:
    return [event.visit for event in outcome.events if isinstance(event, VisitCompleted)]


def stated_deg(visits: list[Visit], plan: Plan, **sections: dict[str, Any]) -> float:
    seek = reduce_visits(visits, plan, with_latitude(config_of(**sections)))
    return float(seek.budgets["coordinate_transform"].sigma_rad) / DEG


def check_of(result: JsonObject, name: str = "target") -> dict[str, str]:
    checks: list[dict[str, str]] = result["checks"]
    (found,) = [check for check in checks if check["name"] == name]
    return found


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("noise", [None, 0.001])
def test_it_ends_at_the_first_pair_that_states_the_target(seed: int, noise: float | None) -> None:
    """Worked out again from the visits alone, prefix by prefix."""
    sections: dict[str, dict[str, Any]] = {
        "simulation": {"seed": seed},
        "gyro": {"noise_deg_sqrt_h": noise},
    }
    outcome = seek(QUICK, **sections)
    visits, plan = visits_of(outcome), chosen(QUICK, **sections)
    config = with_latitude(config_of(**sections))

    def honest(n: int) -> bool:
        within = estimate_so_far(visits[:n], plan, config)
        assert within is not None
        return noise is not None or within.sigma_rad / DEG <= TARGET_DEG

    pairs = range(FEWEST, len(visits) + 1, 2)
    ends = [n for n in pairs if stated_deg(visits[:n], plan, **sections) <= TARGET_DEG]
    assert [n for n in ends if honest(n)] == [len(visits)]
    assert outcome.completed["azimuth_sigma_deg"] <= TARGET_DEG
    assert check_of(outcome.completed)["status"] == "pass"
    assert outcome.completed["plan"]["target_sigma_deg"] == TARGET_DEG
    assert sigmas_off(outcome.completed, 48.0) < 6.0


def test_it_goes_on_past_the_planned_revolution_while_the_target_is_not_reached() -> None:
    plan = QUICK.model_copy(update={"positions": 4, "dwell_s": 0.2, "most_visits": 400})
    outcome = seek(plan)
    made = len(outcome.completed["visits"])
    assert made > 3 * 8
    assert outcome.completed["azimuth_sigma_deg"] <= TARGET_DEG
    assert chosen(plan) == plan, "nothing was open"


def test_where_the_bound_comes_first_the_result_says_what_was_reached_and_what_would_help() -> None:
    plan = QUICK.model_copy(update={"dwell_s": 0.2, "most_visits": 16, "target_sigma_deg": 0.05})
    result = seek(plan).completed
    check = check_of(result)
    assert len(result["visits"]) == 16
    assert (check["status"], result["azimuth_sigma_deg"] > 0.05) == ("warn", True)
    ratio = (result["azimuth_sigma_deg"] / 0.05) ** 2  # all of it is noise, or nearly
    assert f"after 16 visits sigma is {result['azimuth_sigma_deg']:.3g} deg" in check["detail"]
    times = float(check["detail"].split("measure ")[1].split(" times")[0])
    assert times == pytest.approx(ratio, rel=0.05)


def test_a_target_below_what_averaging_does_not_see_names_the_line_that_limits_it() -> None:
    plan = QUICK.model_copy(update={"dwell_s": 0.2, "most_visits": 12})
    result = seek(plan, gyro={"mount_angle_sigma_deg": 0.3}).completed
    detail = check_of(result)["detail"]
    assert "no longer run reaches it" in detail
    assert "0.3 deg, most of it the mounting" in detail


def test_a_plan_that_will_not_reach_its_target_is_warned_of() -> None:
    plan = QUICK.model_copy(update={"dwell_s": 0.2, "most_visits": 12})

    async def ask() -> list[str]:
        async with build_rig(config_of()) as rig:
            return predict(plan, rig).warnings

    (warning,) = virtually(config_of(), ask())
    assert "0.2 deg is not expected to be reached: after all 12 visits" in warning


def test_a_linear_drift_does_not_move_a_run_that_ends_anywhere() -> None:
    """A drift of 0.5 deg/h over the run, 25 times a visit's noise: fitted, not cancelled."""
    plan = Plan(positions=12, settle_s=0.1, target_sigma_deg=0.1)
    steady = seek(plan)
    drift = 0.5 / (steady.lasted_s / 3600.0)
    drifting = seek(plan, simulation={"gyro_drift_deg_h_h": drift}).completed
    (segment,) = drifting["segments"]
    assert segment["drift_deg_h_h"] == pytest.approx(drift, rel=0.2)
    moved = drifting["azimuth_deg"] - steady.completed["azimuth_deg"]
    assert abs(moved) < 0.01 * steady.completed["azimuth_sigma_deg"] + 1e-4


def test_progress_never_goes_back_and_foresees_the_end() -> None:
    plan = QUICK.model_copy(update={"dwell_s": 0.4, "most_visits": 400})
    progress = [event for event in seek(plan).events if isinstance(event, Progress)]
    assert all(later.fraction >= earlier.fraction for earlier, later in pairwise(progress))
    assert all(event.visit <= event.visits and event.left_s >= 0.0 for event in progress)
    middle = progress[len(progress) // 2]
    assert middle.visits == pytest.approx(progress[-1].visits, rel=0.4)
    assert (progress[-1].fraction, progress[-1].left_s) == (1.0, 0.0)


@pytest.mark.parametrize("crash_at", [1, 5, 12, 13])
def test_a_run_that_crashed_goes_on_to_the_same_target(crash_at: int) -> None:
    plan = chosen()
    first = live(plan, watch=crash_after(crash_at))
    second = live(plan, first.visits)
    result, config = second.completed, with_latitude(config_of())
    assert result["azimuth_sigma_deg"] <= TARGET_DEG
    assert north_seek_json(reduce_visits(second.visits, plan, config)) == result
    planned = [visit for visit in second.visits if visit.repeats is None]
    angles = [visit.angle_rad for visit in planned]
    assert angles == pytest.approx(
        [v.angle_rad for v in schedule(8, 1.0, "spread", 2)][: len(angles)]
    )


def test_a_run_that_crashed_after_its_last_visit_makes_no_other() -> None:
    plan = chosen()
    whole = live(plan)
    again = live(plan, whole.visits)
    assert again.visits == whole.visits
    assert again.completed == whole.completed


def test_a_run_that_pauses_for_long_still_reaches_its_target() -> None:
    paused = live(chosen(), watch=pause_after(6, 100.0))
    assert paused.kinds().count("SegmentOpened") == 1
    assert paused.completed["azimuth_sigma_deg"] <= TARGET_DEG


@pytest.mark.parametrize("positions", [3, 4, 5, 7, 24])
def test_few_and_odd_angles_reach_their_target_too(positions: int) -> None:
    plan = Plan(positions=positions, settle_s=0.1, target_sigma_deg=TARGET_DEG)
    result = seek(plan, gyro={"noise_deg_sqrt_h": 0.001}).completed
    assert result["azimuth_sigma_deg"] <= TARGET_DEG
    assert sigmas_off(result, 48.0) < 4.0


@pytest.mark.parametrize("given", [True, False])
def test_the_interval_holds_the_truth_though_the_run_ended_where_sigma_was_small(
    *, given: bool
) -> None:
    """With the plain rule, sigma from the residuals at most the target, it is 93 times in 100."""
    held, visits = stopped_seeks(10_000, 0.7, np.random.default_rng(7), given=given)
    assert 0.94 < held < 0.96
    assert 22 < visits < 30  # 48 planned, at half of the variance


@pytest.mark.parametrize("positions", [8, 24, 90])
def test_angles_surround_the_table_after_every_few_pairs(positions: int) -> None:
    """The widest gap that n pairs leave is at most twice that of n pairs evenly spread."""
    angles = np.array([visit.angle_rad for visit in schedule(positions, 1.0, "spread", 1)])
    for pairs in range(2, positions // 2 + 1):
        some = np.sort(angles[: 2 * pairs])
        widest = np.max(np.diff(some, append=some[0] + 2 * np.pi))
        assert widest <= 2.0 * np.pi / pairs + 2.0 * np.pi / positions + 1e-9
