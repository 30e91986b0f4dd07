"""The gyro as witness of the table's moves."""

import numpy as np
import pytest

from northfinder.estimators.table_check import check_table

DEG = np.pi / 180
ANGLES_RAD = np.array([0.0, 90.0, 180.0, 90.0, 0.0]) * DEG
MOVES_RAD = np.array([np.nan, 90.0, 90.0, -90.0, -90.0]) * DEG
ONE_SEGMENT = [0] * 5


def test_moves_that_the_gyro_saw_alike_pass() -> None:
    check = check_table(ANGLES_RAD, MOVES_RAD * 1.002, ONE_SEGMENT)
    assert check.status == "pass"
    assert "by 90.18 deg on the way to visit 2, where it said 90.00" in check.detail


def test_a_table_that_turns_the_other_way_mirrors_the_azimuth_and_fails() -> None:
    check = check_table(ANGLES_RAD, -MOVES_RAD, ONE_SEGMENT)
    assert check.status == "fail"
    assert "the azimuth is mirrored" in check.detail


@pytest.mark.parametrize(("slip_deg", "status"), [(0.5, "pass"), (2.0, "warn"), (7.0, "fail")])
def test_a_plate_that_slips_is_named_with_its_visit(slip_deg: float, status: str) -> None:
    seen = MOVES_RAD.copy()
    seen[3] += slip_deg * DEG
    check = check_table(ANGLES_RAD, seen, ONE_SEGMENT)
    assert check.status == status
    assert "visit 4" in check.detail


@pytest.mark.parametrize(
    "seen_rad", [np.full(5, np.nan), np.where(np.arange(5) == 0, np.pi, np.nan)]
)
def test_a_gyro_that_cannot_tell_says_so(seen_rad: np.ndarray) -> None:
    assert "could not watch" in check_table(ANGLES_RAD, seen_rad, ONE_SEGMENT).detail


def test_moves_too_small_to_judge_are_passed_over() -> None:
    check = check_table(np.array([0.0, 1.0]) * DEG, np.array([np.nan, 5.0]) * DEG, [0, 0])
    assert "could not watch" in check.detail


def test_the_way_to_the_first_visit_of_a_segment_is_not_judged() -> None:
    after_homing = MOVES_RAD + np.array([0.0, 0.0, 90.0, 0.0, 0.0]) * DEG
    assert check_table(ANGLES_RAD, after_homing, ONE_SEGMENT).status == "fail"
    assert check_table(ANGLES_RAD, after_homing, [0, 0, 1, 1, 1]).status == "pass"
