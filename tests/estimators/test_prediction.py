"""What a plan promises, against the bound, the runs and the order of the visits."""

import numpy as np
import pytest

from northfinder.estimators.design import harmonic_design
from northfinder.estimators.prediction import predict_azimuth
from northfinder.estimators.uncertainty import SystematicUncertainty
from tests.estimators.truth import ARCMIN, DEG, DEG_PER_HOUR, TWENTY_FOUR_RAD, Array

NOTHING = SystematicUncertainty()


def test_a_level_prediction_is_the_cramer_rao_bound() -> None:
    gyro = harmonic_design(TWENTY_FOUR_RAD, 0.02 * DEG_PER_HOUR)
    predicted = predict_azimuth(gyro, harmonic_design(TWENTY_FOUR_RAD, 1e-9), 40 * DEG, NOTHING)
    assert predicted.budget.sigma_rad / ARCMIN == pytest.approx(1.7226, abs=5e-5)


def test_uneven_angles_are_judged_at_their_worst_azimuth() -> None:
    angle = np.array([0.0, 10.0, -10.0, 180.0, 170.0, 190.0]) * DEG  # they hardly measure b
    gyro = harmonic_design(angle, 0.02 * DEG_PER_HOUR)
    predicted = predict_azimuth(gyro, harmonic_design(angle, 1e-9), 40 * DEG, NOTHING)
    assert np.cos(predicted.azimuth_rad) ** 2 == pytest.approx(1.0, abs=0.01)
    assert predicted.budget.sigma_rad / ARCMIN > 3 * 1.7226


@pytest.mark.parametrize(
    ("half_deg", "dwell_s", "sigma_arcmin"),
    [
        pytest.param(np.arange(24) * 15.0, 5.0, 7.18, id="sequential"),
        pytest.param(np.arange(24) * 15.0, 2.5, 5.45, id="out-and-back"),
        pytest.param(
            np.add.outer(np.arange(12) * 15.0, [0, 180]).ravel(), 2.5, 2.71, id="opposite"
        ),
    ],
)
def test_the_order_of_visits_decides_under_bias_instability(
    half_deg: Array, dwell_s: float, sigma_arcmin: float
) -> None:
    # 0.001 deg/sqrt(h), visits back to back. The figures are another simulation's, whose moves
    # take time, hence the tolerance; its 0.05 deg/h is of the density taken as one-sided.
    angle_deg = half_deg if dwell_s == 5.0 else np.concatenate([half_deg, half_deg[::-1]])
    middle_s = (np.arange(len(angle_deg)) + 0.5) * dwell_s
    sigma = 0.001 * 60.0 * DEG_PER_HOUR / np.sqrt(dwell_s)
    gyro = harmonic_design(angle_deg * DEG, sigma, middle_s)
    accelerometer = harmonic_design(angle_deg * DEG, 1e-9)
    white = predict_azimuth(gyro, accelerometer, 40 * DEG, NOTHING)
    assert white.budget.sigma_rad / ARCMIN == pytest.approx(2.31, abs=0.005)
    flickering = SystematicUncertainty(bias_instability_rad_s=0.05 / np.sqrt(2) * DEG_PER_HOUR)
    predicted = predict_azimuth(gyro, accelerometer, 40 * DEG, flickering, dwell_s)
    assert predicted.budget.sigma_rad / ARCMIN == pytest.approx(sigma_arcmin, rel=0.06)


def test_a_prediction_needs_to_know_the_noise() -> None:
    known, unknown = harmonic_design(TWENTY_FOUR_RAD, 1.0), harmonic_design(TWENTY_FOUR_RAD)
    for gyro, accelerometer in ((known, unknown), (unknown, known)):
        with pytest.raises(ValueError, match="needs the sigma"):
            predict_azimuth(gyro, accelerometer, 0.5, NOTHING)
