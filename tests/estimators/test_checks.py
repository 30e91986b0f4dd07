"""Each check passes on a good revolution, and names what spoils a bad one."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from northfinder.estimators import estimate_tilt, fit_harmonic, solve_azimuth
from northfinder.estimators.azimuth import EarthRate
from northfinder.estimators.checks import (
    Check,
    Disturbed,
    NoiseSource,
    check_drift,
    check_earth_rate,
    check_frozen,
    check_invalid_samples,
    check_latitude,
    check_lost_samples,
    check_outliers,
    check_residuals,
    check_spikes,
    check_tilt,
)
from northfinder.estimators.design import harmonic_design
from northfinder.estimators.harmonic import HarmonicFit, fit_design
from tests.estimators.truth import DEG, DEG_PER_HOUR, TWENTY_FOUR_RAD, Array, read

SIGMA = 0.01 * DEG_PER_HOUR
NOISE = np.random.default_rng(15).normal(0.0, SIGMA, 24)
LEVEL = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, np.zeros(24), 1e-6))


def revolution(extra: Array | float = 0.0, **fit: Any) -> HarmonicFit:  # noqa: ANN401 (fit_harmonic's)
    rate = read(0.5, 0.0, 0.0, 40 * DEG).rate_rad_s
    return fit_harmonic(TWENTY_FOUR_RAD, rate + NOISE + extra, **fit)


@pytest.mark.parametrize(
    ("scale", "status", "words"),
    [
        pytest.param(1.0, "pass", "as noise does", id="noise"),
        pytest.param(1.7, "warn", "something besides noise", id="shaken"),
        pytest.param(3.0, "fail", "something besides noise", id="kicked"),
        pytest.param(0.3, "warn", "too little; the sigma given is too large", id="too-quiet"),
    ],
)
def test_residuals_are_held_against_the_given_sigma(scale: float, status: str, words: str) -> None:
    check = check_residuals(revolution((scale - 1) * NOISE, sigma=SIGMA), SIGMA, "given", "gyro")
    assert (check.name, check.status) == ("residuals", status)
    assert words in check.detail


def test_residuals_are_held_against_the_scatter_within_visits_where_no_sigma_is_given() -> None:
    within: NoiseSource = "seen within the visits"
    good = check_residuals(revolution(), np.full(24, SIGMA), within, "accelerometer")
    assert good.name == "accelerometer residuals"
    assert good.status == "pass"
    assert "seen within the visits" in good.detail
    assert check_residuals(revolution(), np.full(24, SIGMA / 3), within, "gyro").status == "fail"


def test_correlated_residuals_are_held_against_their_covariance() -> None:
    slow = 5.0 * SIGMA * np.sin(np.arange(24.0) * 1.3)
    covariance = SIGMA**2 * np.eye(24) + np.outer(slow, slow)
    design = harmonic_design(TWENTY_FOUR_RAD, covariance=covariance)
    check = check_residuals(
        fit_design(design, revolution(slow).reading), np.full(24, SIGMA), "given", "gyro"
    )
    assert check.status == "pass"
    assert "the sigma given and the slow noise" in check.detail
    assert check_residuals(revolution(slow), SIGMA, "given", "gyro").status == "fail"


def test_residuals_that_cannot_be_judged_say_so() -> None:
    frozen = check_residuals(revolution(), np.zeros(24), "seen within the visits", "gyro")
    three = fit_harmonic(np.array([0.0, 2.0, 4.0]), np.zeros(3))
    assert frozen.status == check_residuals(three, 1.0, "given", "gyro").status == "warn"
    assert "samples do not scatter" in frozen.detail


def test_a_disturbed_visit_is_named_and_the_rest_stands() -> None:
    eighth = Disturbed(7, 75 * DEG, "gyro", -12.34)
    check = check_outliers(24, 4.9, 1, [eighth])
    assert check.status == "warn"
    assert "(limit 4.9): visit 8 at 75 deg (gyro, 12.3)." in check.detail
    assert check_outliers(24, 4.9, 0, []).status == "pass"


@pytest.mark.parametrize(
    ("visits", "status"), [((4, 5), "warn"), ((4, 5, 6), "fail"), ((22, 23), "fail")]
)
def test_disturbed_visits_in_a_row_are_a_bench_that_moved(
    visits: tuple[int, ...], status: str
) -> None:
    row = [Disturbed(visit, visit * 15 * DEG, "gyro", 9.0) for visit in visits]
    assert check_outliers(24, 4.9, len(row), row).status == status


def test_too_many_disturbed_visits_are_not_argued_away() -> None:
    check = check_outliers(24, 4.9, 5, [])
    assert check.status == "fail"
    assert "5 of 24 visits" in check.detail


def test_too_few_visits_show_no_outlier() -> None:
    assert "too few" in check_outliers(4, float("inf"), 0, []).detail


@pytest.mark.parametrize(("spikes", "status"), [(0, "pass"), (3, "warn"), (200, "fail")])
def test_samples_that_stand_out_are_counted(spikes: int, status: str) -> None:
    check = check_spikes([1000, 1000], [0, spikes], 7.0)
    assert check.status == status
    assert "7 times the scatter" in check.detail


def test_a_sensor_that_repeats_itself_is_found() -> None:
    check = check_frozen([3.0, 2.0, 1.0], [0.1, 0.0, 0.0], [3, 4, 5], "gyro")
    assert check is not None
    assert check.status == "fail"
    assert "2 of 3 visits, first in visit 5" in check.detail
    assert check_frozen([1.0, 2.0], [0.1, 0.2], [0, 1], "gyro") is None
    assert check_frozen([1.0, 2.0], [0.0, 0.0], [0, 1], "gyro") is None  # simulated, without noise
    assert check_frozen([1.0, 1.0], [0.0, 0.0], [0, 1], "gyro") is not None


@pytest.mark.parametrize(("z", "status"), [(2.9, "pass"), (-3.1, "warn"), (5.1, "fail")])
def test_the_earth_rate_is_held_against_the_latitude(z: float, status: str) -> None:
    expected = np.array(11.5 * DEG_PER_HOUR)
    rate = EarthRate(expected + z * SIGMA, expected, np.array(SIGMA), float("inf"))
    check = check_earth_rate(rate)
    assert check.status == status
    assert "expected 11.5000" in check.detail
    assert ("check the latitude" in check.detail) == (status != "pass")


def test_the_earth_rate_of_few_estimated_degrees_of_freedom_may_stray_farther() -> None:
    expected = np.array(11.5 * DEG_PER_HOUR)
    rate = EarthRate(expected + 4 * SIGMA, expected, np.array(SIGMA), 5.0)
    assert check_earth_rate(rate).status == "pass"


@pytest.mark.parametrize(
    ("drift_deg_h", "power", "status", "words"),
    [
        pytest.param(0.0, 1, "pass", "limit 3", id="none"),
        pytest.param(0.1, 1, "fail", "let the gyro warm up", id="strong"),
        pytest.param(0.3, 2, "fail", "deg/h per h^2", id="quadratic"),
    ],
)
def test_drift_across_the_revolution_is_found_and_its_effect_stated(
    drift_deg_h: float, power: int, status: str, words: str
) -> None:
    time_s = np.arange(24.0) * 5.0
    drift = drift_deg_h * DEG_PER_HOUR * np.linspace(-1.0, 1.0, 24) ** power
    fit = revolution(drift, sigma=SIGMA, time_s=time_s)
    check = check_drift(fit, solve_azimuth(fit, LEVEL, 40 * DEG))
    assert check.status == status
    assert words in check.detail


def test_a_linear_drift_out_and_back_is_told_but_harmless() -> None:
    angle = np.concatenate([TWENTY_FOUR_RAD, TWENTY_FOUR_RAD[::-1]])
    drift = 0.1 * DEG_PER_HOUR * np.linspace(-1.0, 1.0, 48)
    rate = read(0.5, 0.0, 0.0, 40 * DEG, angle).rate_rad_s
    fit = fit_harmonic(angle, rate + drift, SIGMA, np.arange(48.0))
    check = check_drift(fit, solve_azimuth(fit, LEVEL, 40 * DEG))
    assert check.status == "warn"
    assert "moves the azimuth by 0.00'" in check.detail.replace("-", "")


def test_a_fitted_drift_is_not_looked_for_again() -> None:
    time_s = np.arange(24.0) * 5.0
    linear = revolution(1e-6 * time_s, time_s=time_s, drift_order=1)
    solution = solve_azimuth(linear, LEVEL, 40 * DEG)
    assert check_drift(linear, solution).status == "pass"
    said = check_drift(linear, solution).detail
    assert said.startswith("A linear drift of 743 deg/h per h is fitted. ")  # 1e-6 rad/s^2
    assert "linear 0" not in said
    both = revolution(time_s=time_s, drift_order=2)
    assert "order 2 is fitted" in check_drift(both, solution).detail


def test_drift_that_the_visits_cannot_show_is_not_claimed() -> None:
    solution = solve_azimuth(revolution(), LEVEL, 40 * DEG)
    few = TWENTY_FOUR_RAD[::6]
    short = fit_harmonic(few, np.cos(few), 1e-3, time_s=np.arange(4.0))
    still = revolution(sigma=SIGMA, time_s=np.zeros(24))
    unknown = fit_harmonic(few, np.cos(few), time_s=np.arange(4.0))
    for fit in (short, still, unknown):
        assert "linear 0.0 sigma" in check_drift(fit, solution).detail
    with pytest.raises(ValueError, match="give time_s to the fit"):
        check_drift(revolution(), solution)


@pytest.mark.parametrize(("tilt_deg", "status"), [(9.9, "pass"), (10.1, "warn"), (30.1, "fail")])
def test_tilt_beyond_the_limits_is_told(tilt_deg: float, status: str) -> None:
    tilt = replace(LEVEL, epsilon_rad=np.array(tilt_deg * DEG))
    check = check_tilt(tilt)
    assert check.status == status
    assert f"{tilt_deg:.2f} deg" in check.detail


@pytest.mark.parametrize(("latitude_deg", "status"), [(80.0, "pass"), (-80.5, "warn")])
def test_high_latitudes_are_told(latitude_deg: float, status: str) -> None:
    assert check_latitude(latitude_deg * DEG).status == status


@pytest.mark.parametrize(
    ("lost", "status"), [([0, 1], "pass"), ([0, 20], "warn"), ([900, 0], "fail")]
)
def test_lost_samples_are_counted_by_the_worst_visit(lost: list[int], status: str) -> None:
    check = check_lost_samples([2500, 2500], lost)
    assert check.status == status
    assert f"{sum(lost)} of {5000 + sum(lost)} samples were lost" in check.detail


@pytest.mark.parametrize(
    ("invalid", "status"), [([0, 0], "pass"), ([0, 1], "warn"), ([100, 0], "fail")]
)
def test_samples_that_the_gyro_disowns_are_counted(invalid: list[int], status: str) -> None:
    assert check_invalid_samples([2500, 2500], invalid).status == status


def test_a_visit_without_samples_fails() -> None:
    assert check_lost_samples([2500, 0], [0, 0]) == Check(
        "lost samples",
        "fail",
        "0 of 2500 samples were lost, at most 100.00% in one visit (visit 2; limit 0.1%); "
        "check the cable, the baud rate and the load of this computer.",
    )
