"""The uncertainty budget of an azimuth (JCGM 100: independent lines, squares add up)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.arrays import FloatArray, IntArray, quadratic_form
from northfinder.estimators.azimuth import AzimuthSolution
from northfinder.estimators.coloured import SlowNoise
from northfinder.estimators.design import distinct_angles
from northfinder.estimators.drift import HIGHEST_ORDER, drift_response, unmodelled_drift
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.student import student_quantile
from northfinder.estimators.tilt import TiltEstimate

_ABSOLUTE = float("inf")


@dataclass(frozen=True, slots=True)
class SystematicUncertainty:
    """What is known of the errors that averaging does not see, each one standard deviation.

    Attributes:
        latitude_rad: Of the site's latitude.
        table_angle_rad: Of each distinct table angle; a second visit repeats the same error.
        scale_factor: Of the gyro's scale factor, relative.
        gyro_mount_rad: Of the gyro's angle from the index mark.
        accelerometer_mount_rad: Of the accelerometer's.
        drift_curvature_rad_s3: Of the coefficient of the squared time in the gyro's drift;
            None: it is looked for in the readings.
        bias_instability_rad_s: The gyro's flicker figure B; 0 leaves it out.
        rate_random_walk_rad_s_sqrt_s: The gyro's K; 0 leaves it out.
    """

    latitude_rad: float = 0.0
    table_angle_rad: float = 0.0
    scale_factor: float = 0.0
    gyro_mount_rad: float = 0.0
    accelerometer_mount_rad: float = 0.0
    drift_curvature_rad_s3: float | None = None
    bias_instability_rad_s: float = 0.0
    rate_random_walk_rad_s_sqrt_s: float = 0.0

    @property
    def slow_noise(self) -> SlowNoise:
        """Return what couples the visits."""
        return SlowNoise(self.bias_instability_rad_s, self.rate_random_walk_rad_s_sqrt_s)


@dataclass(frozen=True, slots=True, eq=False)
class BudgetLine:
    """One source: its standard uncertainty ``(...)``, and the degrees of freedom behind it."""

    source: str
    u_rad: FloatArray
    dof: float


@dataclass(frozen=True, slots=True, eq=False)
class AzimuthBudget:
    """All lines of an azimuth's uncertainty, batched like the azimuth."""

    lines: tuple[BudgetLine, ...]

    @property
    def sigma_rad(self) -> FloatArray:
        """Combined standard uncertainty, the root of the sum of squares, ``(...)``."""
        variance: FloatArray = np.sum([line.u_rad**2 for line in self.lines], axis=0)
        return np.sqrt(variance)

    @property
    def dof(self) -> FloatArray:
        """Effective degrees of freedom (Welch and Satterthwaite, JCGM 100 G.4.1), ``(...)``."""
        estimated = np.sum([line.u_rad**4 / line.dof for line in self.lines], axis=0)
        dof = np.full(estimated.shape, _ABSOLUTE)
        np.divide(self.sigma_rad**4, estimated, out=dof, where=estimated != 0.0)
        return dof

    @property
    def interval95_rad(self) -> FloatArray:
        """Half width of the 95 % interval: 1.960 sigma, Student's t where estimated, ``(...)``."""
        return student_quantile(0.975, self.dof) * self.sigma_rad

    @property
    def shares(self) -> tuple[FloatArray, ...]:
        """Each line's part of the variance; they sum to one, ``(...)`` each."""
        variance = self.sigma_rad**2
        return tuple(line.u_rad**2 / variance for line in self.lines)


def azimuth_budget(
    solution: AzimuthSolution,
    fit: HarmonicFit,
    tilt: TiltEstimate,
    systematic: SystematicUncertainty,
    visit_duration_s: ArrayLike | None = None,
) -> AzimuthBudget:
    """Draw up the budget of a solved azimuth.

    Gyro and accelerometer readings of the same index are of the same visit.

    The line "drift curvature" is the one that white noise must not feed and the residuals
    hardly show (see :func:`unmodelled_drift`): a stated curvature sigma goes in as it is;
    without one, the fitted curvature goes in where it is significant at 3 sigma, and nothing
    otherwise. So a curvature that moves the azimuth by up to 4 sigma can pass unseen: state
    one where the temperature is not steady, or go out and back twice.

    Args:
        solution: The azimuth and its Jacobian.
        fit: The gyro's fit that it came from.
        tilt: The tilt that it came from.
        systematic: What is known of the other errors.
        visit_duration_s: Length of each visit, scalar or ``(n,)``, centred on the fit's times;
            needed for the bias instability and the rate random walk.

    Raises:
        ValueError: A line needs times, durations or paired visits that are not there.
    """
    slow = _slow_parts(fit, systematic.slow_noise, visit_duration_s)
    return AzimuthBudget(
        (
            *_noise_lines(solution, fit, tilt, slow),
            BudgetLine("table angle", _table_angle(solution, fit, tilt, systematic), _ABSOLUTE),
            *_constant_lines(solution, fit, tilt, systematic),
            BudgetLine("drift curvature", _drift_curvature(solution, fit, systematic), _ABSOLUTE),
            *_slow_lines(solution, fit, slow),
        )
    )


def _noise_lines(
    solution: AzimuthSolution, fit: HarmonicFit, tilt: TiltEstimate, slow: dict[str, FloatArray]
) -> tuple[BudgetLine, BudgetLine]:
    covariance = fit.covariance[..., 1:, 1:]
    if fit.design.covariance is not None:  # which holds the slow noise too: it has its own lines
        covariance = covariance - sum(slow.values())
    gyro = np.maximum(quadratic_form(solution.jacobian[..., 0:2], covariance), 0.0)
    accelerometer = quadratic_form(solution.jacobian[..., 2:4], tilt.level_covariance)
    return (
        BudgetLine("gyro noise", np.sqrt(gyro), _noise_dof(fit)),
        BudgetLine("accelerometer noise", np.sqrt(accelerometer), _noise_dof(tilt.fit)),
    )


def _noise_dof(fit: HarmonicFit) -> float:
    return _ABSOLUTE if fit.sigma_known else float(fit.dof)


def _constant_lines(
    solution: AzimuthSolution,
    fit: HarmonicFit,
    tilt: TiltEstimate,
    systematic: SystematicUncertainty,
) -> tuple[BudgetLine, ...]:
    """Return the lines of errors that are one number for the whole run."""
    by_a, by_b, by_p, by_q, by_latitude = np.moveaxis(solution.jacobian, -1, 0)
    p, q = np.moveaxis(tilt.level, -1, 0)
    scale = np.abs(by_a * fit.a + by_b * fit.b) * systematic.scale_factor
    mounting = np.hypot(
        (by_a * fit.b - by_b * fit.a) * systematic.gyro_mount_rad,
        (by_p * q - by_q * p) * systematic.accelerometer_mount_rad,
    )
    return (
        BudgetLine("latitude", np.abs(by_latitude) * systematic.latitude_rad, _ABSOLUTE),
        BudgetLine("scale factor", scale, _ABSOLUTE),
        BudgetLine("mounting", mounting, _ABSOLUTE),
    )


def _table_angle(
    solution: AzimuthSolution,
    fit: HarmonicFit,
    tilt: TiltEstimate,
    systematic: SystematicUncertainty,
) -> FloatArray:
    """A table angle that is off by d moves each reading there by ``dy/dT d``, of both sensors."""
    if systematic.table_angle_rad == 0.0:
        return np.zeros_like(solution.sigma_rad)
    if len(fit.design.angle_rad) != len(tilt.fit.design.angle_rad):
        msg = (
            f"{len(fit.design.angle_rad)} gyro and {len(tilt.fit.design.angle_rad)} accelerometer "
            "readings cannot share table angles; fit both sensors over the same visits"
        )
        raise ValueError(msg)
    group = distinct_angles(fit.design.angle_rad)
    gyro = _angle_response(fit, fit.parameters[..., 1:3], group)
    level = _angle_response(tilt.fit, tilt.level, group)
    moved = np.einsum("...k,...kg->...g", solution.jacobian[..., 0:2], gyro)
    moved = moved + np.einsum("...k,...kg->...g", solution.jacobian[..., 2:4], level)
    turned: FloatArray = np.linalg.norm(moved, axis=-1) * systematic.table_angle_rad
    return turned


def _angle_response(fit: HarmonicFit, harmonic: FloatArray, group: IntArray) -> FloatArray:
    """Change of the two harmonic coefficients by each distinct angle's error, ``(..., 2, g)``."""
    felt, angle_rad = fit.design.attenuation, fit.design.angle_rad
    by_cosine, by_sine = (
        np.stack([np.bincount(group, row) for row in fit.gain[1:] * shape])
        for shape in (felt * np.cos(angle_rad), felt * np.sin(angle_rad))
    )
    a, b = harmonic[..., 0, np.newaxis, np.newaxis], harmonic[..., 1, np.newaxis, np.newaxis]
    response: FloatArray = b * by_cosine - a * by_sine
    return response


def _drift_curvature(
    solution: AzimuthSolution, fit: HarmonicFit, systematic: SystematicUncertainty
) -> FloatArray:
    stated = systematic.drift_curvature_rad_s3
    if stated is not None:
        moved = solution.jacobian[..., 0:2] @ drift_response(fit, HIGHEST_ORDER)
        return np.abs(moved) * stated
    if fit.design.time_s is None or max(fit.design.drift_orders) >= HIGHEST_ORDER:
        return np.zeros_like(solution.sigma_rad)
    term = unmodelled_drift(fit)[-1]
    moved = solution.jacobian[..., 0:2] @ term.response * term.coefficient
    return np.where(term.significant, np.abs(moved), 0.0)


def _slow_parts(
    fit: HarmonicFit, slow: SlowNoise, visit_duration_s: ArrayLike | None
) -> dict[str, FloatArray]:
    """Return what the slow noise does to the covariance of (a, b), by source, ``(..., 2, 2)``."""
    if not slow.any:
        return {}
    if fit.design.time_s is None or visit_duration_s is None:
        msg = "slow noise needs the time and the duration of each visit: give both"
        raise ValueError(msg)
    duration_s = np.asarray(visit_duration_s, dtype=np.float64)
    between = slow.covariances(fit.design.time_s - duration_s / 2.0, duration_s)
    gain = fit.gain[1:]
    return {source: fit.in_scale(gain @ visits @ gain.T) for source, visits in between.items()}


def _slow_lines(
    solution: AzimuthSolution, fit: HarmonicFit, slow: dict[str, FloatArray]
) -> tuple[BudgetLine, ...]:
    estimated = fit.design.covariance is not None and not fit.sigma_known
    dof = float(fit.dof) if estimated else _ABSOLUTE
    return tuple(
        BudgetLine(source, np.sqrt(quadratic_form(solution.jacobian[..., 0:2], part)), dof)
        for source, part in slow.items()
    )
