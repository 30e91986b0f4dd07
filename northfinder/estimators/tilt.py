"""Tilt of the table plane from the accelerometer's fit (`levelling`, eq 9, signs mended)."""

from dataclasses import dataclass

import numpy as np

from northfinder.errors import EstimationError
from northfinder.estimators.arrays import FloatArray, quadratic_form
from northfinder.estimators.harmonic import HarmonicFit


@dataclass(frozen=True, slots=True, eq=False)
class TiltEstimate:
    """Tilt of the table, batched like the fit.

    Attributes:
        fit: The accelerometer's fit.
        level: Sines of the elevations of y_t and of -x_t, ``(a_A, b_A) / g``, ``(..., 2)``.
        level_covariance: Their covariance, ``(..., 2, 2)``.
        epsilon_rad: Angle between the table plane and the horizontal, ``(...)``.
        zeta_rad: Table angle of the downhill direction, [0, 2 pi); NaN where epsilon is below
            its own sigma; ``(...)``.
        pitch_rad: theta, elevation of the index mark, ``(...)``.
        roll_rad: gamma, ``(...)``.
        sigma_rad: Standard deviation of epsilon along the direction of the tilt, ``(...)``.
        covariance: Of (pitch, roll), rad^2, ``(..., 2, 2)``.
    """

    fit: HarmonicFit
    level: FloatArray
    level_covariance: FloatArray
    epsilon_rad: FloatArray
    zeta_rad: FloatArray
    pitch_rad: FloatArray
    roll_rad: FloatArray
    sigma_rad: FloatArray
    covariance: FloatArray


def estimate_tilt(accelerometer_fit: HarmonicFit, gravity: float = 1.0) -> TiltEstimate:
    """Work out the tilt, ``theta = asin(a_A/g)``, ``gamma = asin(b_A / (g cos theta))``.

    The paper prints b_A (eq 5) and zeta (eq 9) with signs that contradict its eq 10; here
    ``epsilon = asin(hypot(a_A, b_A)/g)`` and ``zeta = atan2(-b_A, -a_A)``.

    Args:
        accelerometer_fit: Fit of the specific force, batch ``(...)``.
        gravity: Local gravity in the unit of the accelerometer's readings.

    Raises:
        EstimationError: The force along the plane is not below gravity.
        ValueError: ``gravity`` is not positive.
    """
    if not gravity > 0.0:
        msg = f"gravity must be positive, in the accelerometer's unit; got {gravity:g}"
        raise ValueError(msg)
    level = accelerometer_fit.parameters[..., 1:3] / gravity
    covariance = accelerometer_fit.covariance[..., 1:, 1:] / gravity**2
    slope = np.hypot(level[..., 0], level[..., 1])
    _check_slope(slope)
    epsilon = np.arcsin(slope)
    sigma = np.sqrt(quadratic_form(_direction(level, slope), covariance)) / np.cos(epsilon)
    downhill = np.mod(np.arctan2(-level[..., 1], -level[..., 0]), 2.0 * np.pi)
    pitch = np.arcsin(level[..., 0])
    roll = np.arcsin(level[..., 1] / np.cos(pitch))
    attitude_covariance = _attitude_covariance(pitch, roll, covariance)
    zeta = np.where(epsilon < sigma, np.nan, downhill)
    return TiltEstimate(
        accelerometer_fit, level, covariance, epsilon, zeta, pitch, roll, sigma, attitude_covariance
    )


def _check_slope(slope: FloatArray) -> None:
    steepest = float(slope.max(initial=0.0))
    if steepest >= 1.0:
        msg = (
            f"the specific force along the table plane is {steepest:.4g} of gravity: no tilt gives "
            "that; check the accelerometer's unit and the gravity given"
        )
        raise EstimationError(msg)


def _direction(level: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the unit vector of the tilt; of any direction where the table is level."""
    safe = np.where(slope > 0.0, slope, 1.0)
    x = np.where(slope > 0.0, level[..., 0], 1.0) / safe
    return np.stack([x, level[..., 1] / safe], axis=-1)


def _attitude_covariance(pitch: FloatArray, roll: FloatArray, covariance: FloatArray) -> FloatArray:
    """Carry the covariance of (sin theta, sin gamma cos theta) over to (theta, gamma)."""
    jacobian = np.zeros(covariance.shape)
    jacobian[..., 0, 0] = 1.0 / np.cos(pitch)
    jacobian[..., 1, 0] = np.tan(roll) * np.tan(pitch) / np.cos(pitch)
    jacobian[..., 1, 1] = 1.0 / (np.cos(roll) * np.cos(pitch))
    carried: FloatArray = jacobian @ covariance @ np.swapaxes(jacobian, -1, -2)
    return carried
