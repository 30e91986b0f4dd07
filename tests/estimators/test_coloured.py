"""Generalised least squares from a gyro's Allan figures."""

import numpy as np
import pytest

from northfinder.estimators import estimate_tilt, fit_harmonic, solve_azimuth
from northfinder.estimators.coloured import SlowNoise, walk_covariance
from northfinder.estimators.design import harmonic_design
from northfinder.estimators.harmonic import fit_design
from northfinder.estimators.uncertainty import SystematicUncertainty, azimuth_budget
from tests.estimators import noises
from tests.estimators.truth import DEG, DEG_PER_HOUR, TWENTY_FOUR_RAD, Array, read

START_S: Array = 5.0 * np.arange(24.0)
B = 0.05 * DEG_PER_HOUR
K = 0.01 * DEG_PER_HOUR
WHITE = 0.02 * DEG_PER_HOUR
SLOW = SlowNoise(B, K)


def between() -> Array:
    covariance: Array = WHITE**2 * np.eye(24) + sum(SLOW.covariances(START_S, 4.0).values())
    return covariance


def test_a_walk_couples_its_windows_as_a_simulated_one_does() -> None:
    random = np.random.default_rng(1)
    means = [
        noises.walk(300, 0.1, 1.0, random).reshape(6, 50)[:, :40].mean(axis=1)
        for _ in range(20_000)
    ]
    simulated = np.cov(np.array(means), rowvar=False)
    ours = walk_covariance(5.0 * np.arange(6.0), 4.0, 1.0)
    # A walk that began a while ago adds a constant to all elements: differences alone count.
    apart = np.diff(np.diff(ours - simulated, axis=0), axis=1)
    assert np.abs(apart).max() < 0.06 * np.diff(np.diff(ours, axis=0), axis=1).max()


def test_it_is_aitkens_estimate() -> None:
    """(X' C^-1 X)^-1 X' C^-1 y, by the textbook, with a large constant in place of the unknown."""
    covariance = between()
    whole = covariance + 1e4 * np.abs(covariance).max()
    design = harmonic_design(TWENTY_FOUR_RAD, covariance=covariance)
    matrix = np.stack([np.ones(24), np.cos(TWENTY_FOUR_RAD), np.sin(TWENTY_FOUR_RAD)], axis=1)
    inverse = np.linalg.inv(whole)
    unit = np.linalg.inv(matrix.T @ inverse @ matrix)
    readings = np.random.default_rng(2).standard_normal(24) * WHITE
    fit = fit_design(design, readings)
    textbook = unit @ matrix.T @ inverse @ readings
    assert fit.parameters == pytest.approx(textbook, rel=1e-6, abs=1e-6 * WHITE)
    assert fit.covariance[1:, 1:] == pytest.approx(unit[1:, 1:], rel=1e-6, abs=1e-9 * WHITE**2)
    left = readings - matrix @ textbook
    assert fit.chi2 == pytest.approx(left @ inverse @ left, rel=1e-6)


def test_without_slow_noise_it_is_the_weighted_fit() -> None:
    sigma = WHITE * np.linspace(1.0, 2.0, 24)
    readings = np.random.default_rng(3).standard_normal(24) * WHITE
    plain = fit_harmonic(TWENTY_FOUR_RAD, readings, sigma)
    general = fit_design(harmonic_design(TWENTY_FOUR_RAD, covariance=np.diag(sigma**2)), readings)
    assert general.parameters == pytest.approx(plain.parameters)
    assert general.chi2 == pytest.approx(plain.chi2)
    assert general.residual_sigma == pytest.approx(plain.residual_sigma, rel=0.05)
    assert SlowNoise().covariances(START_S, 4.0) == {}


@pytest.mark.parametrize("absolute", [True, False])
def test_the_budget_names_each_noise_and_adds_up(absolute: bool) -> None:
    truth = read(0.5, 0.0, 0.0, 40 * DEG)
    design = harmonic_design(
        TWENTY_FOUR_RAD, time_s=START_S + 2.0, covariance=between(), absolute=absolute
    )
    noise = np.linalg.cholesky(between() + B**2) @ np.random.default_rng(4).standard_normal(24)
    fit = fit_design(design, truth.rate_rad_s + noise)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, truth.force_g, 1e-9))
    solution = solve_azimuth(fit, tilt, 40 * DEG)
    known = SystematicUncertainty(bias_instability_rad_s=B, rate_random_walk_rad_s_sqrt_s=K)
    lines = {line.source: line for line in azimuth_budget(solution, fit, tilt, known, 4.0).lines}
    slow = [lines[name] for name in ("bias instability", "rate random walk")]
    gyro = np.sqrt(sum(line.u_rad**2 for line in (lines["gyro noise"], *slow)))
    assert gyro == pytest.approx(solution.sigma_rad, rel=1e-4)
    assert all(line.u_rad > 0.0 for line in slow)
    assert {line.dof for line in slow} == {np.inf if absolute else 21.0}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"covariance": np.eye(3)}, "a row and a column a reading"),
        ({"covariance": np.zeros((24, 24))}, "no variance"),
        ({"covariance": np.eye(24), "sigma": 1.0}, "give the noise once"),
    ],
)
def test_what_is_no_covariance_is_refused(given: dict[str, Array], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        harmonic_design(TWENTY_FOUR_RAD, **given)  # type: ignore[arg-type]


def test_readings_that_feel_less_of_the_harmonic_are_given_their_due() -> None:
    """Means over sectors of 15 deg: sin(w/2)/(w/2) of it, by integration of the cosine."""
    width = np.pi / 12
    means = (np.sin(TWENTY_FOUR_RAD + width / 2) - np.sin(TWENTY_FOUR_RAD - width / 2)) / width
    felt = np.full(24, np.sinc(width / 2 / np.pi))
    fit = fit_design(harmonic_design(TWENTY_FOUR_RAD, attenuation=felt), means)
    assert fit.a == pytest.approx(1.0, rel=1e-12)
