"""The gyro as witness of the table's moves."""

import numpy as np
import pytest

from northfinder.estimators.checks import Check
from northfinder.estimators.table_check import check_table
from tests.estimators.truth import Array

DEG = np.pi / 180
SIGMA_RAD = 0.04 * DEG
ANGLES_RAD = np.concatenate([np.arange(24), np.arange(24)[::-1]]) * 15.0 * DEG
NOISE_RAD = np.random.default_rng(1).normal(0.0, 0.0015 * DEG, 48)
MOVES_RAD = np.concatenate([[np.nan], np.diff(ANGLES_RAD)]) + NOISE_RAD
ONE_SEGMENT = [0] * 48


def judged(seen_rad: Array, segment: list[int] = ONE_SEGMENT) -> Check:
    return check_table(ANGLES_RAD, seen_rad, segment, SIGMA_RAD)


@pytest.mark.parametrize("scale", [1.0, 0.995, 1.002])
def test_moves_that_the_gyro_saw_alike_pass_whatever_its_scale_factor(scale: float) -> None:
    check = judged(MOVES_RAD * scale)
    assert check.status == "pass"
    assert "Over 46 moves" in check.detail


def test_a_table_that_turns_the_other_way_mirrors_the_azimuth_and_fails() -> None:
    check = judged(-MOVES_RAD)
    assert check.status == "fail"
    assert "the azimuth is mirrored" in check.detail


@pytest.mark.parametrize(("slip_deg", "status"), [(0.02, "pass"), (0.12, "warn"), (0.25, "fail")])
def test_a_plate_that_slips_once_is_named_with_its_visit(slip_deg: float, status: str) -> None:
    seen = MOVES_RAD.copy()
    seen[30] += slip_deg * DEG
    check = judged(seen)
    assert check.status == status
    assert "way to visit 31" in check.detail or status == "pass"


@pytest.mark.parametrize(("slip_deg", "status"), [(0.0005, "pass"), (0.006, "fail")])
def test_a_plate_that_slips_a_little_each_time_is_found_by_the_sum(
    slip_deg: float, status: str
) -> None:
    assert judged(MOVES_RAD + slip_deg * DEG).status == status


@pytest.mark.parametrize(("scale", "status"), [(0.98, "warn"), (1.1, "fail")])
def test_a_scale_factor_that_is_no_gyros_is_told(scale: float, status: str) -> None:
    check = judged(MOVES_RAD * scale)
    assert check.status == status
    assert f"{scale:.3f} times" in check.detail


@pytest.mark.parametrize(
    "seen_rad", [np.full(48, np.nan), np.where(np.arange(48) == 0, np.pi, np.nan)]
)
def test_a_gyro_that_cannot_tell_says_so(seen_rad: Array) -> None:
    assert "could not watch" in judged(seen_rad).detail


def test_moves_too_small_to_judge_are_passed_over() -> None:
    small = np.array([0.0, 1.0]) * DEG
    check = check_table(small, np.array([np.nan, 5.0]) * DEG, [0, 0], SIGMA_RAD)
    assert "could not watch" in check.detail


def test_the_way_to_the_first_visit_of_a_segment_is_not_judged() -> None:
    after_homing = MOVES_RAD.copy()
    after_homing[20] += 90.0 * DEG
    assert judged(after_homing).status == "fail"
    assert judged(after_homing, [0] * 20 + [1] * 28).status == "pass"
