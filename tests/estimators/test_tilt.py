"""Tilt from the accelerometer: direction of the fall, uncertainty, and what is refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from northfinder.errors import EstimationError
from northfinder.estimators import estimate_tilt, fit_harmonic
from tests.estimators.truth import DEG, TWENTY_FOUR_RAD, angle_between, read


@pytest.mark.parametrize(
    ("pitch_deg", "roll_deg", "zeta_deg"),
    [
        pytest.param(3.0, 0.0, 180.0, id="mark-up-falls-behind"),
        pytest.param(-3.0, 0.0, 0.0, id="mark-down-falls-ahead"),
        pytest.param(0.0, 3.0, 270.0, id="left-up-falls-right"),
        pytest.param(0.0, -3.0, 90.0, id="left-down-falls-left"),
    ],
)
def test_zeta_is_the_table_angle_of_the_way_downhill(
    pitch_deg: float, roll_deg: float, zeta_deg: float
) -> None:
    force = read(1.0, pitch_deg * DEG, roll_deg * DEG, 0.5).force_g
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, sigma=1e-6))
    assert tilt.epsilon_rad / DEG == pytest.approx(3.0)
    assert angle_between(tilt.zeta_rad, zeta_deg * DEG) == pytest.approx(0.0, abs=1e-12)
    downhill = read(1.0, pitch_deg * DEG, roll_deg * DEG, 0.5, tilt.zeta_rad[np.newaxis])
    assert downhill.force_g[0] == pytest.approx(-np.sin(3.0 * DEG))


def test_gravity_is_in_the_unit_of_the_accelerometer() -> None:
    force = read(0.0, 0.1, 0.2, 0.5).force_g
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, 9.79 * force), gravity=9.79)
    assert_allclose([tilt.pitch_rad, tilt.roll_rad], [0.1, 0.2])


def test_a_tilt_below_its_own_sigma_has_no_direction() -> None:
    force = 1e-6 * np.cos(TWENTY_FOUR_RAD)
    assert np.isnan(estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, sigma=1e-5)).zeta_rad)
    assert not np.isnan(estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, sigma=1e-7)).zeta_rad)
    level = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, np.zeros(24), sigma=1e-5))
    assert level.sigma_rad == pytest.approx(1e-5 * np.sqrt(2 / 24))
    assert np.isnan(level.zeta_rad)


def test_the_covariance_is_what_noise_does_to_pitch_and_roll() -> None:
    random = np.random.default_rng(6)
    angle = TWENTY_FOUR_RAD[:9]  # a part of the circle, so that the two are correlated
    force = read(0.0, 0.3, -0.25, 0.5, angle).force_g
    noisy = force + random.normal(0.0, 1e-4, (50_000, 9))
    tilt = estimate_tilt(fit_harmonic(angle, noisy, sigma=1e-4))
    seen = np.cov(tilt.pitch_rad, tilt.roll_rad)
    assert_allclose(tilt.covariance[0], seen, rtol=0.03)
    assert tilt.sigma_rad[0] == pytest.approx(tilt.epsilon_rad.std(), rel=0.02)


def test_a_force_beyond_gravity_is_refused_in_words() -> None:
    force = fit_harmonic(TWENTY_FOUR_RAD, 1.2 * np.cos(TWENTY_FOUR_RAD))
    with pytest.raises(EstimationError, match=r"is 1\.2 of gravity"):
        estimate_tilt(force)
    with pytest.raises(ValueError, match="gravity must be positive"):
        estimate_tilt(force, gravity=0.0)
