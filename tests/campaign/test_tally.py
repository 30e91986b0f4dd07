"""Counts and bands, against scipy's and by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, norm, t

from northfinder.campaign.chunks import Columns, run_chunk
from northfinder.campaign.tally import Share, Tally
from tests.campaign.campaigns import planned

CAMPAIGN = planned(tilt_deg=8.0)
COLUMNS = run_chunk(CAMPAIGN, 0)


def some(rows: slice) -> Columns:
    return {name: values[rows] for name, values in COLUMNS.items()}


def share(seeks: int, covered: int) -> Share:
    return Share("all", seeks, covered, 0, 0.0, 1.0, 1.0, 1.0)


@given(st.integers(1, 30_000), st.floats(0.0, 1.0))
def test_a_band_is_the_exact_binomial_one(seeks: int, part: float) -> None:
    covered = round(seeks * part)
    exact = binomtest(covered, seeks).proportion_ci(0.99, "exact")
    assert share(seeks, covered).band == pytest.approx((exact.low, exact.high), abs=1e-9)


@given(st.integers(0, 2_000))
def test_tallies_of_parts_add_up_to_that_of_the_whole(cut: int) -> None:
    whole = Tally.of(CAMPAIGN, COLUMNS)
    sum_of_parts = Tally.of(CAMPAIGN, some(slice(cut))) + Tally.of(CAMPAIGN, some(slice(cut, None)))
    np.testing.assert_array_equal(sum_of_parts.counts, whole.counts)
    np.testing.assert_array_equal(sum_of_parts.histogram, whole.histogram)
    np.testing.assert_allclose(sum_of_parts.sums, whole.sums, rtol=1e-12)


def test_every_seek_is_in_one_class_of_tilt_and_one_of_azimuth() -> None:
    every, *classes = Tally.of(CAMPAIGN, COLUMNS).shares
    assert [each.name for each in classes[:2]] == ["tilt 0-2 deg", "tilt 2-4 deg"]
    assert [each.name for each in classes[-2:]] == ["azimuth 180-270 deg", "azimuth 270-360 deg"]
    for kind in ("tilt", "azimuth"):
        of_kind = [each for each in classes if each.name.startswith(kind)]
        assert sum(each.seeks for each in of_kind) == every.seeks == 2_000
        assert sum(each.covered for each in of_kind) == every.covered
    west = COLUMNS["true_azimuth_deg"] >= 270.0
    assert classes[-1].seeks == west.sum()


def test_a_fixed_attitude_has_no_classes() -> None:
    campaign = planned(azimuth_deg=10.0, seeks=100)
    assert [each.name for each in Tally.of(campaign, run_chunk(campaign, 0)).shares] == ["all"]


def test_counts_and_ratios_by_hand() -> None:
    columns = {name: np.full(4, 1.0) for name in COLUMNS}
    columns["error_deg"] = np.array([0.5, -1.5, 3.0, -4.5])
    columns["interval95_half_width_deg"] = np.full(4, 2.0)
    columns["bound_deg"] = np.full(4, 0.5)
    columns["dof"] = np.full(4, 10.0)
    every = Tally.of(planned(azimuth_deg=1.0), columns).shares[0]
    assert (every.seeks, every.covered, every.wrong) == (4, 2, 1)
    scatter = np.sqrt((0.25 + 2.25 + 9.0 + 20.25) / 4)
    assert (every.scatter_deg, every.over_sigma, every.over_bound) == pytest.approx(
        (scatter, scatter, 2 * scatter)
    )
    assert every.by_chance == pytest.approx(4 * 2 * t.sf(4.0, 10))


def test_with_the_noise_given_chance_is_normal() -> None:
    columns = {**COLUMNS, "dof": np.full(2_000, np.inf)}
    every = Tally.of(CAMPAIGN, columns).shares[0]
    assert every.by_chance == pytest.approx(2_000 * 2 * norm.sf(4.0))
