"""Visits that do not belong are found, few or many, and noise alone loses next to none."""

import numpy as np
import pytest
from scipy.stats import f as fisher
from scipy.stats import t as student

from northfinder.estimators import fit_harmonic
from northfinder.estimators.design import harmonic_design
from northfinder.estimators.outliers import OutlierSearch
from tests.estimators.truth import TWENTY_FOUR_RAD, Array

THERE_AND_BACK: Array = np.concatenate([TWENTY_FOUR_RAD, TWENTY_FOUR_RAD[::-1]])
DESIGN = harmonic_design(THERE_AND_BACK)
SEARCH = OutlierSearch(DESIGN)
SIGNAL = 8.0 * np.cos(THERE_AND_BACK) + 5.0 * np.sin(THERE_AND_BACK)


def rows(count: int, seed: int) -> Array:
    noise: Array = SIGNAL + np.random.default_rng(seed).standard_normal((count, 48))
    return noise


def test_what_is_left_out_is_judged_by_the_scatter_of_the_others() -> None:
    """The externally studentised residual of Cook and Weisberg, by a fit without the visit."""
    row = rows(1, 3)[0]
    row[7] += 9.0
    found = SEARCH.find(row)
    assert found.index == (7,)
    kept = np.arange(48) != 7
    others = fit_harmonic(THERE_AND_BACK[kept], row[kept])
    regressor = np.array([1.0, np.cos(THERE_AND_BACK[7]), np.sin(THERE_AND_BACK[7])])
    miss = row[7] - regressor @ others.parameters
    spread = np.sqrt(others.residual_sigma**2 + regressor @ others.covariance @ regressor)
    assert found.times[0] == pytest.approx(miss / spread)
    tried = 48 + 24  # each visit, and each angle's two
    assert found.limit == pytest.approx(student.ppf(1.0 - 1e-3 / tried / 2.0, 44))


def test_a_run_loses_a_visit_by_chance_once_in_a_thousand() -> None:
    lost = [bool(SEARCH.find(row).index) for row in rows(4000, 5)]
    assert sum(lost) <= 12  # 4 expected


@pytest.mark.parametrize(("disturbed", "shift"), [(1, 10.0), (2, 10.0), (3, 10.0), (4, 25.0)])
def test_several_do_not_hide_one_another(disturbed: int, shift: float) -> None:
    random = np.random.default_rng(disturbed)
    for row in rows(50, 7):
        where = random.choice(48, disturbed, replace=False)
        row[where] += shift
        assert set(where.tolist()) <= set(SEARCH.find(row).index)


def test_an_angle_that_is_off_each_time_is_found_by_its_visits_together() -> None:
    """Neither visit alone would do: 4.2 sigma each is below the limit of 4.9."""
    alone, together = 0, 0
    for row in rows(200, 11):
        row[[5, 42]] += 4.2
        index = SEARCH.find(row).index
        together += index == (5, 42)
    for row in rows(200, 11):
        row[5] += 4.2
        alone += SEARCH.find(row).index == (5,)
    assert together > 1.3 * alone
    assert fisher.sf((2 * 4.2**2) / 2, 2, 43) < 1e-3 / 72  # of exactly that shift


def test_more_than_a_tenth_are_counted_and_none_is_left_out() -> None:
    row = rows(1, 13)[0]
    row[[1, 8, 20, 33, 40, 46]] += 30.0
    found = SEARCH.find(row)
    assert found.index == ()
    assert found.strange > 4


def test_correlated_noise_is_no_outlier() -> None:
    """A slow wave shared by neighbours; the same readings taken as independent look disturbed."""
    wave = 30.0 * np.exp(-(((np.arange(48.0) - 20.0) / 1.5) ** 2))
    row = rows(1, 17)[0] + wave
    covariance = np.eye(48) + np.outer(wave, wave)
    search = OutlierSearch(harmonic_design(THERE_AND_BACK, covariance=covariance))
    assert search.find(row).index == ()
    assert SEARCH.find(row).strange > 0
    row[44] += 12.0
    assert search.find(row).index == (44,)


@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e12])
def test_the_unit_does_not_matter(unit: float) -> None:
    row = rows(1, 19)[0]
    row[30] -= 20.0
    found = OutlierSearch(harmonic_design(THERE_AND_BACK, unit)).find(unit * row)
    assert found.index == (30,)
    assert found.times[0] == pytest.approx(SEARCH.find(row).times[0])


def test_readings_that_determine_a_parameter_alone_are_never_left_out() -> None:
    segment = np.concatenate([np.zeros(47, dtype=int), [1]])
    row = rows(1, 23)[0]
    row[47] += 1e6
    assert OutlierSearch(harmonic_design(THERE_AND_BACK, segment=segment)).find(row).index == ()


def test_few_readings_and_perfect_ones_show_nothing() -> None:
    five = OutlierSearch(harmonic_design(TWENTY_FOUR_RAD[::5]))
    found = five.find([0.0, 1.0, 2.0, 1.0, 9.0])
    assert (found.index, found.limit) == ((), np.inf)
    assert SEARCH.find(SIGNAL).index == ()


def test_an_angle_that_has_most_of_the_readings_is_not_left_out_as_a_whole() -> None:
    at = np.array([0.0, 0.0, 0.0, 0.0, 2.0, 4.0])
    search = OutlierSearch(harmonic_design(at))
    assert search.find([1.0, 1.0, 1.0, 9.0, 2.0, 3.0]).index == (3,)


def test_one_of_six_that_stands_out_from_perfect_ones_is_found() -> None:
    six = np.cos(TWENTY_FOUR_RAD[::4])
    six[2] += 1.0
    assert OutlierSearch(harmonic_design(TWENTY_FOUR_RAD[::4])).find(six).index == (2,)
