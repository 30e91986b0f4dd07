"""The harmonic fit against numpy's least squares, against theory, and against the clock."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from northfinder.errors import EstimationError
from northfinder.estimators import fit_harmonic
from northfinder.estimators.design import distinct_angles
from tests.estimators.truth import ARCMIN, DEG, DEG_PER_HOUR, TWENTY_FOUR_RAD, Array, read

OUT_AND_BACK_RAD: Array = np.concatenate([TWENTY_FOUR_RAD, TWENTY_FOUR_RAD[::-1]])


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(12, 40),
    drift_order=st.integers(0, 2),
    segments=st.integers(1, 2),
    weighted=st.booleans(),
)
def test_fit_is_the_weighted_least_squares_of_its_model(
    seed: int, n: int, drift_order: int, segments: int, *, weighted: bool
) -> None:
    random = np.random.default_rng(seed)
    angle = random.permutation(np.arange(n) * 2 * np.pi / n + random.uniform(0, 0.05, n))
    time_s = np.sort(random.uniform(0.0, 300.0, n))
    segment = np.sort(np.arange(n) % segments)
    sigma = random.uniform(0.5, 2.0, n) if weighted else np.ones(n)
    reading = random.normal(size=n)
    fit = fit_harmonic(angle, reading, sigma, time_s, drift_order, segment)

    columns = [np.cos(angle), np.sin(angle)]
    for s in range(segments):
        inside = segment == s
        tau = time_s - time_s[inside].mean()
        columns += [np.where(inside, (tau / 100.0) ** k, 0.0) for k in range(drift_order + 1)]
    model = np.column_stack(columns)
    expected, rss = np.linalg.lstsq(model / sigma[:, np.newaxis], reading / sigma)[:2]
    covariance = np.linalg.inv(model.T / sigma**2 @ model)
    in_model = [2, 0, 1]
    assert_allclose([fit.R, fit.a, fit.b], expected[in_model], atol=1e-7)
    assert_allclose(fit.covariance, covariance[np.ix_(in_model, in_model)], rtol=1e-6, atol=1e-8)
    assert_allclose(fit.residuals, reading - model @ expected, atol=1e-7)
    assert_allclose(fit.chi2, rss[0], rtol=1e-7)
    assert_allclose(fit.gain @ reading, expected[in_model], atol=1e-7)
    for s, terms in enumerate(fit.segments):
        at = 2 + s * (1 + drift_order)
        powers = 100.0 ** np.arange(drift_order + 1)
        theirs = slice(at, at + 1 + drift_order)
        assert terms.label == s
        assert_allclose(np.append(terms.R, terms.drift) * powers, expected[theirs], atol=1e-6)
        scaled = terms.covariance * np.outer(powers, powers)
        assert_allclose(scaled, covariance[theirs, theirs], rtol=1e-6, atol=1e-8)


def test_a_batch_is_fitted_row_by_row() -> None:
    readings = np.random.default_rng(1).normal(size=(3, 2, 24))
    batch = fit_harmonic(TWENTY_FOUR_RAD, readings)
    for index in np.ndindex(3, 2):
        one = fit_harmonic(TWENTY_FOUR_RAD, readings[index])
        assert_allclose([batch.R[index], batch.a[index], batch.b[index]], [one.R, one.a, one.b])
        assert_allclose(batch.covariance[index], one.covariance)
        assert_allclose(batch.chi2[index], one.chi2)
        assert_allclose(batch.residual_sigma[index], one.residual_sigma)


def test_the_scatter_of_the_residuals_estimates_an_unknown_sigma() -> None:
    readings = np.random.default_rng(2).normal(0.0, 0.03, (20_000, 24))
    estimated = fit_harmonic(TWENTY_FOUR_RAD, readings)
    given_sigma = fit_harmonic(TWENTY_FOUR_RAD, readings, sigma=0.03)
    assert estimated.dof == given_sigma.dof == 21
    assert np.mean(estimated.residual_sigma**2) == pytest.approx(0.03**2, rel=0.01)
    assert_allclose(given_sigma.residual_sigma, estimated.residual_sigma)
    assert_allclose(given_sigma.covariance[0, 1, 1], 0.03**2 / 12)  # sigma^2 / (n/2)
    assert np.mean(estimated.covariance[:, 1, 1]) == pytest.approx(0.03**2 / 12, rel=0.01)
    assert np.mean(given_sigma.chi2) == pytest.approx(21.0, rel=0.01)


def test_chi_square_does_not_cancel_under_a_large_bias() -> None:
    readings = 1e6 + np.random.default_rng(3).normal(0.0, 1e-3, 24)
    noise_alone = readings - 1e6  # exact: the rounding happened above
    chi2 = fit_harmonic(TWENTY_FOUR_RAD, readings).chi2
    assert_allclose(chi2, fit_harmonic(TWENTY_FOUR_RAD, noise_alone).chi2, rtol=1e-5)


def test_three_readings_determine_the_coefficients_but_not_their_noise() -> None:
    angle = np.array([0.0, 120.0, 240.0]) * DEG
    fit = fit_harmonic(angle, 0.5 + 2.0 * np.cos(angle) - 3.0 * np.sin(angle))
    assert_allclose([fit.R, fit.a, fit.b], [0.5, 2.0, -3.0])
    assert fit.dof == 0
    assert np.isnan(fit.covariance).all()
    assert np.isnan(fit.residual_sigma)
    assert np.isfinite(fit_harmonic(angle, np.zeros(3), sigma=1.0).covariance).all()


def test_a_run_in_sequence_takes_drift_for_azimuth_and_out_and_back_does_not() -> None:
    # 0.05 deg/h over the run at 40 deg: 4.72' at worst for 24 positions in sequence.
    omega_n = 7.292115e-5 * np.cos(40 * DEG)
    drift = 0.05 * DEG_PER_HOUR

    def bias_arcmin(angle: Array, drift_order: int = 0) -> float:
        at = np.arange(len(angle)) / len(angle)
        readings = read(0.0, 0.0, 0.0, 40 * DEG, angle).rate_rad_s + drift * at
        solved = fit_harmonic(angle, readings, time_s=at, drift_order=drift_order)
        return abs(float(np.arctan2(solved.b, solved.a))) / ARCMIN

    assert bias_arcmin(TWENTY_FOUR_RAD) == pytest.approx(4.72, abs=0.005)
    assert drift / (np.pi * omega_n) / ARCMIN == pytest.approx(4.72, rel=0.01)
    assert bias_arcmin(OUT_AND_BACK_RAD) < 0.05
    assert bias_arcmin(TWENTY_FOUR_RAD, drift_order=1) < 1e-9


@pytest.mark.parametrize(
    ("angle_rad", "cost"),
    [
        pytest.param(TWENTY_FOUR_RAD, 2.55, id="sequential"),
        pytest.param(OUT_AND_BACK_RAD, 1.0, id="out-and-back"),
    ],
)
def test_a_fitted_drift_costs_what_the_order_of_visits_makes_it_cost(
    angle_rad: Array, cost: float
) -> None:
    n = len(angle_rad)
    plain, drifting = (
        fit_harmonic(angle_rad, np.zeros(n), 1.0, np.arange(n), order) for order in (0, 1)
    )
    assert drifting.covariance[2, 2] / plain.covariance[2, 2] == pytest.approx(cost, abs=0.005)


def test_each_segment_may_have_a_drift_of_its_own_degree() -> None:
    random = np.random.default_rng(4)
    segment = np.repeat([3, 5, 9], [10, 2, 12])
    time_s = np.arange(24.0)
    reading = random.normal(size=24)
    fit = fit_harmonic(TWENTY_FOUR_RAD, reading, 1.0, time_s, (1, 0, 2), segment)
    columns = [np.cos(TWENTY_FOUR_RAD), np.sin(TWENTY_FOUR_RAD)]
    for label, order in ((3, 1), (5, 0), (9, 2)):
        inside = segment == label
        tau = (time_s - time_s[inside].mean()) / 10.0
        columns += [np.where(inside, tau**k, 0.0) for k in range(order + 1)]
    expected = np.linalg.lstsq(np.column_stack(columns), reading)[0]
    assert_allclose([fit.a, fit.b], expected[:2], atol=1e-12)
    assert [terms.label for terms in fit.segments] == [3, 5, 9]
    theirs = np.concatenate(
        [
            np.append(terms.R, terms.drift) * 10.0 ** np.arange(1 + k)
            for terms, k in zip(fit.segments, (1, 0, 2), strict=True)
        ]
    )
    assert_allclose(theirs, expected[2:], atol=1e-12)
    assert fit.dof == 24 - 8


def test_equal_angles_share_a_number_whatever_the_turn() -> None:
    angle = np.array([0.0, 90.0, 360.0, -270.0, 359.99999999, 180.0]) * DEG
    number = distinct_angles(angle)
    assert number[0] == number[2] == number[4]
    assert number[1] == number[3]
    assert len(set(number)) == 3


@pytest.mark.parametrize(
    ("angle_deg", "more", "complaint"),
    [
        pytest.param([0, 180, 360, 540], {}, r"got 2: 0, 180, 360, 540 deg", id="two-angles"),
        pytest.param(
            [0, 120, 240],
            {"time_s": [0, 1, 2], "drift_order": 1},
            "3 readings cannot determine 4 parameters",
            id="few-readings",
        ),
        pytest.param(
            [*range(0, 360, 20)],
            {"segment": [0] * 17 + [1], "time_s": range(18), "drift_order": 1},
            r"0, 20, .*, \.\.\. deg.* do not determine",
            id="one-reading-cannot-drift",
        ),
    ],
)
def test_angles_that_do_not_determine_the_answer_are_named(
    angle_deg: list[float], more: dict[str, Any], complaint: str
) -> None:
    angle = np.array(angle_deg) * DEG
    with pytest.raises(EstimationError, match=complaint):
        fit_harmonic(angle, np.zeros(len(angle)), **more)


@pytest.mark.parametrize(
    ("bad", "complaint"),
    [
        ({"rate_rad_s": np.full(24, np.nan)}, "readings holds nan at index"),
        ({"rate_rad_s": np.r_[np.inf, np.zeros(23)]}, "readings holds inf at index"),
        ({"rate_rad_s": np.zeros(23)}, r"need shape \(..., 24\)"),
        ({"rate_rad_s": 1.0}, r"need shape \(..., 24\)"),
        ({"angle_rad": np.zeros((2, 24))}, r"one angle a reading"),
        ({"angle_rad": np.r_[np.nan, np.zeros(23)]}, "angle_rad holds nan"),
        ({"sigma": 0.0}, "sigma must be positive"),
        ({"sigma": np.ones(3)}, "sigma needs one value for each of the 24"),
        ({"time_s": np.zeros(3)}, "time_s needs one value"),
        ({"drift_order": 1}, "together with time_s"),
        ({"drift_order": -1}, "drift_order is -1"),
        ({"segment": np.zeros(24)}, "one integer for each"),
        ({"drift_order": (1, 0), "time_s": np.arange(24.0)}, "names 2 segments, but there are 1"),
        ({"drift_order": (-1,)}, r"drift_order is \(-1,\)"),
    ],
)
def test_what_is_not_a_revolution_is_refused_in_words(bad: dict[str, Any], complaint: str) -> None:
    arguments = {"angle_rad": TWENTY_FOUR_RAD, "rate_rad_s": np.zeros(24)} | bad
    with pytest.raises(ValueError, match=complaint):
        fit_harmonic(**arguments)
