"""What two angles measured again tell of a move of the bench, against rotation matrices."""

from typing import Any

import numpy as np
import pytest

from northfinder.estimators.stillness import (
    LIMIT_SIGMAS,
    Repeated,
    Stillness,
    choose_pair,
    judge_stillness,
)
from tests.estimators.truth import DEG, DEG_PER_HOUR, OMEGA_RAD_S, TWENTY_FOUR_RAD, Array, read

LATITUDE_RAD = 40.0 * DEG
PAIR_RAD: Array = np.array([120.0, 330.0]) * DEG
BEFORE = (48.0 * DEG, 0.8 * DEG, -0.5 * DEG)  # azimuth, pitch, roll
RATE_SIGMA, FORCE_SIGMA = 0.05 * DEG_PER_HOUR, 1e-5


def slopes(angle_rad: Array) -> tuple[Array, Array]:
    """What the gyro feels of the horizontal rate, and its derivative, of a level table."""
    level_rad_s = OMEGA_RAD_S * np.cos(LATITUDE_RAD)
    towards = BEFORE[0] - angle_rad
    return level_rad_s * np.cos(towards), -level_rad_s * np.sin(towards)


def judged(
    turn_rad: float = 0.0,
    tilt_rad: tuple[float, float] = (0.0, 0.0),
    angle_rad: Array = PAIR_RAD,
    **instead: Any,  # noqa: ANN401 - of Repeated
) -> Stillness:
    azimuth, pitch, roll = BEFORE
    after = (azimuth + turn_rad, pitch + tilt_rad[0], roll + tilt_rad[1])
    was, now = (read(*pose, LATITUDE_RAD, angle_rad) for pose in (BEFORE, after))
    signal, slope = slopes(angle_rad)
    m = len(angle_rad)
    facts = {
        "rate_change": now.rate_rad_s - was.rate_rad_s + 5.0 * DEG_PER_HOUR,  # a new bias
        "rate_covariance": np.eye(m) * RATE_SIGMA**2,
        "signal": signal,
        "slope": slope,
        "gyro_angle_rad": angle_rad,
        "force_change": now.force_g - was.force_g,
        "force_covariance": np.eye(m) * FORCE_SIGMA**2,
        "accelerometer_angle_rad": angle_rad,
        "vertical_rate_rad_s": OMEGA_RAD_S * np.sin(LATITUDE_RAD),
    }
    return judge_stillness(Repeated(**{**facts, **instead}))


@pytest.mark.parametrize("turn_deg", [1.0, -2.0, 30.0, -60.0])
def test_a_turn_is_measured_whatever_the_bias(turn_deg: float) -> None:
    found = judged(turn_rad=turn_deg * DEG)
    assert found.turned
    assert not found.tilted
    assert found.turned_rad == pytest.approx(turn_deg * DEG, rel=0.02)


@pytest.mark.parametrize("swap", [1, -1])
def test_the_smallest_turn_that_shows_is_four_sigma_of_the_difference(swap: int) -> None:
    angle_rad = PAIR_RAD[::swap]
    limit_rad = judged(angle_rad=angle_rad).turn_limit_rad
    level_rad_s = OMEGA_RAD_S * np.cos(LATITUDE_RAD)
    slope = level_rad_s * abs(np.diff(np.sin(BEFORE[0] - PAIR_RAD))[0])
    assert limit_rad == pytest.approx(LIMIT_SIGMAS * np.sqrt(2) * RATE_SIGMA / slope)
    assert judged(turn_rad=1.03 * limit_rad, angle_rad=angle_rad).turned
    assert not judged(turn_rad=0.97 * limit_rad, angle_rad=angle_rad).turned


@pytest.mark.parametrize("towards_deg", range(0, 360, 30))
def test_a_tilt_shows_in_every_direction_and_does_not_pass_for_a_turn(towards_deg: float) -> None:
    limit_rad = judged().tilt_limit_rad
    way = np.array([np.cos(towards_deg * DEG), np.sin(towards_deg * DEG)])
    assert judged(tilt_rad=tuple(1.01 * limit_rad * way)).tilted
    found = judged(tilt_rad=tuple(3.0 * DEG * way))
    assert found.tilted_rad == pytest.approx(3.0 * DEG, rel=0.02)
    assert not found.turned


def test_opposite_angles_are_blind_to_a_tilt_about_the_line_through_them() -> None:
    opposite_rad = np.array([0.0, np.pi])
    blind = judged(tilt_rad=(0.0, 5.0 * DEG), angle_rad=opposite_rad)
    assert not blind.tilted
    assert blind.tilt_limit_rad > 1.0
    assert judged(tilt_rad=(0.1 * DEG, 0.0), angle_rad=opposite_rad).tilted


def test_angles_at_which_nothing_changes_with_the_azimuth_see_no_turn() -> None:
    flat = judged(signal=np.array([1e-5, -1e-5]), slope=np.zeros(2))
    assert flat.turn_limit_rad == np.inf
    unknown = judged(turn_rad=20.0 * DEG, signal=np.zeros(2), slope=np.zeros(2))
    assert unknown.turned
    assert np.isnan(unknown.turned_rad)
    assert unknown.turn_limit_rad == np.inf


def test_one_angle_sees_a_tilt_along_itself_and_no_turn() -> None:
    one_rad = np.array([30.0 * DEG])
    turned = judged(turn_rad=90.0 * DEG, angle_rad=one_rad)
    assert not turned.moved
    assert turned.turn_limit_rad == np.inf
    # chi-square of one degree: four sigma
    assert turned.tilt_limit_rad == pytest.approx(LIMIT_SIGMAS * FORCE_SIGMA)
    assert judged(tilt_rad=(0.1 * DEG, 0.0), angle_rad=one_rad).tilted


def test_noise_alone_passes_for_a_move_as_rarely_as_by_four_sigma() -> None:
    random = np.random.default_rng(31)
    moved = 0
    for _ in range(4000):
        found = judged(
            rate_change=random.normal(0.0, RATE_SIGMA, 2),
            force_change=random.normal(0.0, FORCE_SIGMA, 2),
        )
        moved += found.moved
    assert moved <= 3  # 0.5 expected


def test_the_pair_is_the_most_sensitive_one_that_is_not_in_line() -> None:
    _, slope = slopes(TWENTY_FOUR_RAD)
    first, second = choose_pair(TWENTY_FOUR_RAD, np.zeros(24, dtype=np.int64), slope)
    apart_deg = np.degrees(TWENTY_FOUR_RAD[second] - TWENTY_FOUR_RAD[first]) % 360.0
    assert min(apart_deg, 360.0 - apart_deg) == pytest.approx(150.0)
    best = 2.0 * OMEGA_RAD_S * np.cos(LATITUDE_RAD)
    assert abs(slope[first] - slope[second]) > 0.96 * best


def test_the_pair_is_of_one_segment() -> None:
    segment = np.repeat([0, 1], [10, 14])
    _, slope = slopes(TWENTY_FOUR_RAD)
    first, second = choose_pair(TWENTY_FOUR_RAD, segment, slope)
    assert segment[first] == segment[second]


def test_where_all_angles_are_in_line_the_best_of_those_is_taken() -> None:
    narrow_rad = np.array([0.0, 5.0, 10.0]) * DEG
    slope = slopes(narrow_rad)[1]
    assert choose_pair(narrow_rad, np.zeros(3, dtype=np.int64), slope) == (0, 2)
