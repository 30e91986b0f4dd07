"""A turn of the bench while the run goes on is looked for in person."""

import re
from collections import Counter

import numpy as np
import pytest

from northfinder.estimators import fit_harmonic
from northfinder.estimators.checks import Check
from northfinder.estimators.turn_check import check_turned
from tests.estimators.truth import DEG, TWENTY_FOUR_RAD, Array

THERE_AND_BACK: Array = np.concatenate([TWENTY_FOUR_RAD, TWENTY_FOUR_RAD[::-1]])
LEVEL_RATE, SIGMA = 11.5, 0.04
AZIMUTH_RAD = 48 * DEG
SIGMA_RAD = SIGMA * np.sqrt(2 / 48) / LEVEL_RATE  # the Cramer-Rao bound
NOISE = SIGMA * np.random.default_rng(1).standard_normal((1000, 48))


def judged(azimuth_rad: Array | float, noise: Array = NOISE[0]) -> Check:
    """Judge readings of a bench whose azimuth is what it is at each visit."""
    readings = LEVEL_RATE * np.cos(THERE_AND_BACK + azimuth_rad) + noise
    fit = fit_harmonic(THERE_AND_BACK, readings)
    slope = -float(fit.a) * np.sin(THERE_AND_BACK) + float(fit.b) * np.cos(THERE_AND_BACK)
    return check_turned(fit, slope, SIGMA_RAD, range(48))


def test_noise_alone_is_as_rarely_a_turn_as_stated() -> None:
    statuses = Counter(judged(AZIMUTH_RAD, noise).status for noise in NOISE)
    assert statuses["pass"] >= 995  # 1 of 1000 expected at most: the tries are not independent


@pytest.mark.parametrize(("turn_deg", "way"), [(1.0, "clockwise"), (-1.0, "counter-clockwise")])
def test_a_knock_between_two_visits_is_named(turn_deg: float, way: str) -> None:
    check = judged(AZIMUTH_RAD + np.where(np.arange(48) >= 20, turn_deg * DEG, 0.0))
    assert check.status == "fail"
    found = re.search(rf"by \S+ deg {way} before about visit (\d+)", check.detail)
    assert found is not None
    assert abs(int(found[1]) - 21) < 5  # visits that hardly feel a turn cannot tell


def test_a_bench_that_creeps_and_a_plate_that_lags_are_told_apart() -> None:
    creeping = judged(AZIMUTH_RAD + np.linspace(0.0, 2.0 * DEG, 48))
    lagging = judged(AZIMUTH_RAD + THERE_AND_BACK / (2.0 * np.pi) * 2.0 * DEG)
    assert "a slow turn, by 2" in creeping.detail or "a slow turn, by 1.9" in creeping.detail
    assert "a lag of the plate" in lagging.detail
    assert creeping.status == lagging.status == "fail"


def test_a_turn_that_the_stated_sigma_nearly_covers_is_a_warning() -> None:
    quiet = 1e-3 * NOISE[0]
    assert (
        judged(AZIMUTH_RAD + np.where(np.arange(48) >= 20, 2.5 * SIGMA_RAD, 0.0), quiet).status
        == "warn"
    )


def test_perfect_readings_and_few_ones_show_nothing() -> None:
    assert judged(AZIMUTH_RAD, np.zeros(48)).status == "pass"
    four = fit_harmonic(TWENTY_FOUR_RAD[::6], [1.0, 2.0, 0.0, 1.0])
    assert "too few" in check_turned(four, np.ones(4), SIGMA_RAD, range(4)).detail


def test_a_bench_without_a_level_rate_has_nothing_to_turn() -> None:
    fit = fit_harmonic(THERE_AND_BACK, NOISE[0])
    assert "cannot tell" in check_turned(fit, np.zeros(48), SIGMA_RAD, range(48)).detail
