"""Azimuth of the index mark, with the covariance of both sensors carried through."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.errors import EstimationError
from northfinder.estimators.arrays import FloatArray, as_finite, quadratic_form
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.solvers import SOLVERS, Method, Number, Solver, north_vector_t
from northfinder.estimators.tilt import TiltEstimate
from northfinder.units import DEG, DEG_PER_HOUR

UNOBSERVABLE_LATITUDE_RAD = 89.0 * DEG
_STEP = 1e-40  # of the complex step: no difference is formed, so nothing cancels

Inputs = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class AzimuthSolution:
    """An azimuth, batched like the fits.

    Attributes:
        method: The solver.
        azimuth_rad: Clockwise from true north, [0, 2 pi), ``(...)``.
        sigma_rad: Standard deviation from the noise of both sensors, ``(...)``; what the
            comparison methods leave uncorrected is not in it.
        jacobian: Derivatives with respect to (a, b, a_A/g, b_A/g, L), ``(..., 5)``.
    """

    method: Method
    azimuth_rad: FloatArray
    sigma_rad: FloatArray
    jacobian: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class EarthRate:
    """The horizontal Earth rate, measured against expected.

    It tests the scale factor and the latitude together, cannot tell them apart, and is blind to
    any error of azimuth.

    Attributes:
        measured_rad_s: Length of the horizontal rate of the two-vector solution, ``(...)``.
        expected_rad_s: ``Omega_e cos L``, ``(...)``.
        sigma_rad_s: Of their difference: noise, latitude and scale factor, ``(...)``.
        dof: Degrees of freedom of that sigma; infinite where the gyro's was given.
    """

    measured_rad_s: FloatArray
    expected_rad_s: FloatArray
    sigma_rad_s: FloatArray
    dof: float

    @property
    def z(self) -> FloatArray:
        """Difference over its sigma, ``(...)``."""
        return (self.measured_rad_s - self.expected_rad_s) / self.sigma_rad_s


def solve_azimuth(
    fit: HarmonicFit,
    tilt: TiltEstimate,
    latitude_rad: ArrayLike,
    method: Method = "coordinate_transform",
) -> AzimuthSolution:
    """Solve the azimuth of the index mark.

    ``coordinate_transform`` (`levelling`, eq 3), ``vector`` and ``two_vector`` are exact and
    agree; ``vector_published`` (eq 10), ``vector_uncorrected`` (eq 11) and ``uncompensated``
    (eq 8) are there for comparison.

    Args:
        fit: The gyro's fit, rad/s, batch ``(...)``.
        tilt: The accelerometer's tilt, of a batch that broadcasts with the fit's.
        latitude_rad: Geodetic latitude, positive north; scalar or of the batch.
        method: One of the six.

    Raises:
        EstimationError: Beyond 89 deg of latitude, or the gyro feels no horizontal rate.
        ValueError: Unknown method, or a latitude that is not a number.
    """
    if method not in SOLVERS:
        msg = f"unknown method {method!r}; choose one of {', '.join(SOLVERS)}"
        raise ValueError(msg)
    inputs = solver_inputs(fit, tilt, latitude_rad)
    numerator, denominator = _real_pair(SOLVERS[method], inputs)
    azimuth = np.mod(np.arctan2(numerator, denominator), 2.0 * np.pi)
    azimuth = np.where(azimuth < 2.0 * np.pi, azimuth, 0.0)  # mod(-1e-17) rounds to the full turn
    jacobian = _azimuth_jacobian(SOLVERS[method], inputs, numerator, denominator)
    sigma = np.sqrt(noise_variance(jacobian, fit, tilt))
    return AzimuthSolution(method, azimuth, sigma, jacobian)


def measure_earth_rate(
    fit: HarmonicFit,
    tilt: TiltEstimate,
    latitude_rad: ArrayLike,
    latitude_sigma_rad: float = 0.0,
    scale_factor_sigma: float = 0.0,
) -> EarthRate:
    """Measure ``|n|`` of the two-vector solution against ``Omega_e cos L``.

    Args:
        fit: The gyro's fit, rad/s.
        tilt: The accelerometer's tilt.
        latitude_rad: Geodetic latitude, positive north.
        latitude_sigma_rad: Its standard deviation.
        scale_factor_sigma: Standard deviation of the gyro's scale factor, relative.

    Raises:
        EstimationError: Beyond 89 deg of latitude.
    """
    inputs = solver_inputs(fit, tilt, latitude_rad)
    expected = EARTH_RATE_RAD_S * np.cos(inputs[4])
    excess = np.real(_excess_rate(*inputs))
    jacobian = _complex_step(lambda *x: (_excess_rate(*x),), inputs)[0]
    by_scale = jacobian[..., 0] * inputs[0] + jacobian[..., 1] * inputs[1]
    variance = (
        noise_variance(jacobian, fit, tilt)
        + (jacobian[..., 4] * latitude_sigma_rad) ** 2
        + (by_scale * scale_factor_sigma) ** 2
    )
    dof = float("inf") if fit.sigma_known else float(fit.dof)
    return EarthRate(expected + excess, expected, np.sqrt(variance), dof)


def noise_variance(jacobian: FloatArray, fit: HarmonicFit, tilt: TiltEstimate) -> FloatArray:
    """Variance from the noise of both sensors, full covariance of each, ``(...)``."""
    gyro = quadratic_form(jacobian[..., 0:2], fit.covariance[..., 1:, 1:])
    return gyro + quadratic_form(jacobian[..., 2:4], tilt.level_covariance)


def solver_inputs(fit: HarmonicFit, tilt: TiltEstimate, latitude_rad: ArrayLike) -> Inputs:
    """Return (a, b, a_A/g, b_A/g, L), broadcast against each other.

    Raises:
        EstimationError: A latitude beyond 89 deg.
    """
    latitude = as_finite("latitude_rad", latitude_rad)
    farthest = float(np.abs(latitude).max())
    if farthest > UNOBSERVABLE_LATITUDE_RAD:
        msg = (
            f"latitude {farthest / DEG:.4f} deg is beyond 89 deg: the Earth's rate has no "
            "horizontal part to find north by"
        )
        raise EstimationError(msg)
    a, b, p, q, latitude = np.broadcast_arrays(
        fit.a, fit.b, tilt.level[..., 0], tilt.level[..., 1], latitude
    )
    return a, b, p, q, latitude


def _excess_rate(a: Number, b: Number, p: Number, q: Number, latitude: Number) -> Number:
    n_x, n_y, n_z = north_vector_t(a, b, p, q, latitude)
    length = np.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
    excess: Number = length - EARTH_RATE_RAD_S * np.cos(latitude)
    return excess


def _real_pair(solver: Solver, inputs: Inputs) -> tuple[FloatArray, FloatArray]:
    numerator, denominator = solver(*inputs)
    return np.real(numerator), np.real(denominator)


def _azimuth_jacobian(
    solver: Solver, inputs: Inputs, numerator: FloatArray, denominator: FloatArray
) -> FloatArray:
    """Derivatives of ``atan2(numerator, denominator)``, ``(..., 5)``."""
    square = numerator * numerator + denominator * denominator
    if not np.all(square > 0.0):
        msg = (
            f"the gyro feels no horizontal rate (a = {inputs[0].flat[0] / DEG_PER_HOUR:g} deg/h, "
            "b alike): no azimuth follows; check that it measures"
        )
        raise EstimationError(msg)
    of_numerator, of_denominator = _complex_step(solver, inputs)
    jacobian: FloatArray = (
        of_numerator * denominator[..., np.newaxis] - of_denominator * numerator[..., np.newaxis]
    ) / square[..., np.newaxis]
    return jacobian


def _complex_step(
    function: Callable[..., tuple[Number, ...]], inputs: Inputs
) -> tuple[FloatArray, ...]:
    """Exact derivatives of each output of an analytic function by each input, ``(..., 5)``.

    Im f(x + ih) / h: Squire and Trapp 1998, doi 10.1137/S003614459631241X.
    """
    columns = []
    for index, value in enumerate(inputs):
        stepped = function(*inputs[:index], value + 1j * _STEP, *inputs[index + 1 :])
        columns.append([np.imag(output) / _STEP for output in stepped])
    return tuple(np.stack(column, axis=-1) for column in zip(*columns, strict=True))
