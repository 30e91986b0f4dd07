"""The harmonic fit ``y = R + a cos T + b sin T`` (+ drift), for any number of revolutions at once.

Source: `levelling`, eqs 4-7, widened to weights, any angles, segments and drift.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.arrays import FloatArray, as_finite
from northfinder.estimators.design import HarmonicDesign, harmonic_design

_BLOCK_ROWS = 1024  # of 24 readings are 200 kB: a block and its product stay in cache


@dataclass(frozen=True, slots=True, eq=False)
class SegmentTerms:
    """What belongs to one segment alone.

    Attributes:
        label: The caller's label.
        R: Bias at the middle of the segment, shape ``(...)``.
        drift: Coefficients of the first and higher powers of time in s, ``(..., order)``.
        covariance: Of R and the drift, ``(..., 1 + order, 1 + order)``.
    """

    label: int
    R: FloatArray
    drift: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class HarmonicFit:
    """The fit of one revolution, or of a batch of them, in the readings' own unit.

    Attributes:
        design: The geometry that all rows share.
        reading: The readings, shape ``(..., n)``.
        parameters: All parameters in the order of the design's columns, ``(..., p)``.
        chi2: Sum of the squared residuals, each over its sigma; where sigma is not known, the
            plain sum of squares in the unit of the readings squared; ``(...)``.
    """

    design: HarmonicDesign
    reading: FloatArray
    parameters: FloatArray
    chi2: FloatArray

    @property
    def R(self) -> FloatArray:
        """Bias, of the first segment, ``(...)``."""
        return self.parameters[..., 0]

    @property
    def a(self) -> FloatArray:
        """Cosine coefficient, ``(...)``."""
        return self.parameters[..., 1]

    @property
    def b(self) -> FloatArray:
        """Sine coefficient, ``(...)``."""
        return self.parameters[..., 2]

    @property
    def dof(self) -> int:
        """Degrees of freedom, readings less parameters."""
        return self.design.dof

    @property
    def sigma_known(self) -> bool:
        """Whether sigma was given and is absolute, or is estimated from the residuals."""
        return self.design.sigma is not None

    @property
    def gain(self) -> FloatArray:
        """Linear map from the readings to (R, a, b), ``(3, n)``."""
        return self.design.gain[:3]

    @property
    def residuals(self) -> FloatArray:
        """Readings less model, ``(..., n)``."""
        return self.reading - self.parameters @ self.design.matrix.T

    @property
    def residual_sigma(self) -> FloatArray:
        """Standard deviation of a reading seen in the residuals, ``(...)``; NaN without dof.

        With unequal sigma it is that of a reading of mean weight.
        """
        return np.sqrt(self._unit_variance / np.mean(1.0 / self.design.variance))

    @property
    def covariance(self) -> FloatArray:
        """Covariance of (R, a, b), ``(..., 3, 3)``.

        With given sigma every row shares one matrix, broadcast; otherwise each row's own
        residuals scale it, and without degrees of freedom it is NaN.
        """
        return self._scaled(self.design.unit_covariance[:3, :3])

    def in_scale(self, covariance: FloatArray) -> FloatArray:
        """Return a part of the noise's covariance as the residuals scale it, if they do."""
        if self.design.covariance is None or self.sigma_known:
            return covariance
        return self._scaled(covariance)

    @property
    def segments(self) -> tuple[SegmentTerms, ...]:
        """Bias and drift of each segment, in the order of their labels."""
        return tuple(self._segment(i, label) for i, label in enumerate(self.design.labels))

    @property
    def _unit_variance(self) -> FloatArray:
        """Variance of a reading of weight one, from the residuals."""
        return self.chi2 / self.dof if self.dof else np.full_like(self.chi2, np.nan)

    def _segment(self, index: int, label: int) -> SegmentTerms:
        columns = self.design.segment_columns(index)
        terms = self.parameters[..., columns]
        covariance = self._scaled(self.design.unit_covariance[np.ix_(columns, columns)])
        return SegmentTerms(label, terms[..., 0], terms[..., 1:], covariance)

    def _scaled(self, unit_covariance: FloatArray) -> FloatArray:
        if self.sigma_known:
            return np.broadcast_to(unit_covariance, self.chi2.shape + unit_covariance.shape)
        scaled: FloatArray = np.einsum("...,ij->...ij", self._unit_variance, unit_covariance)
        return scaled


def fit_harmonic(  # noqa: PLR0913, PLR0917 (the published signature)
    angle_rad: ArrayLike,
    rate_rad_s: ArrayLike,
    sigma: ArrayLike | None = None,
    time_s: ArrayLike | None = None,
    drift_order: int | Sequence[int] = 0,
    segment: ArrayLike | None = None,
) -> HarmonicFit:
    """Fit ``y = R + a cos T + b sin T`` by weighted least squares (`levelling`, eqs 4-7).

    Fits whatever unit the readings have: rad/s of a gyro, g of an accelerometer.

    Args:
        angle_rad: Table angle plus mount angle of each reading, any set of angles, ``(n,)``.
        rate_rad_s: The readings, ``(..., n)``; every leading element is fitted at once.
        sigma: Standard deviation of a reading, scalar or ``(n,)``, shared by all rows; weights
            are ``1 / sigma^2``. None: equal weights, sigma estimated from each row's residuals.
        time_s: Time of each reading, ``(n,)``; needed for a drift.
        drift_order: Degree of a drift polynomial in time, centred on each segment; 0 for none.
            One for all segments, or one for each in ascending order of their labels.
        segment: Integer label of each reading; each segment has its own R and drift.

    Returns:
        Coefficients, covariance, residuals and chi-square, batched like the readings.

    Raises:
        EstimationError: The angles, times and segments do not determine every parameter.
        ValueError: A shape does not fit, a number is not finite, a sigma not positive.
    """
    return fit_design(harmonic_design(angle_rad, sigma, time_s, drift_order, segment), rate_rad_s)


def fit_design(design: HarmonicDesign, reading: ArrayLike) -> HarmonicFit:
    """Fit readings ``(..., n)`` to a prepared design.

    Raises:
        ValueError: The readings are not finite, or not n of them.
    """
    readings = np.asarray(reading, dtype=np.float64)
    n, p = design.matrix.shape
    if readings.ndim == 0 or readings.shape[-1] != n:
        msg = f"the readings need shape (..., {n}), one for each angle; they have {readings.shape}"
        raise ValueError(msg)
    parameters, chi2 = _project(readings.reshape(-1, n), design)
    if not np.isfinite(parameters).all():
        as_finite("readings", readings)
    batch = readings.shape[:-1]
    return HarmonicFit(design, readings, parameters.reshape(*batch, p), chi2.reshape(batch))


def _project(rows: FloatArray, design: HarmonicDesign) -> tuple[FloatArray, FloatArray]:
    """Return the parameters and chi-square of each row, by two thin products a block."""
    n, p = design.matrix.shape
    along, chi2 = np.empty((len(rows), p)), np.empty(len(rows))
    basis, transposed = design.basis, design.basis.T.copy()
    buffer, ones = np.empty((min(_BLOCK_ROWS, len(rows)), n)), np.ones(n)
    plain = design.sigma is None and design.covariance is None
    for start in range(0, len(rows), _BLOCK_ROWS):
        block = rows[start : start + _BLOCK_ROWS]
        done, left = slice(start, start + len(block)), buffer[: len(block)]
        with np.errstate(invalid="ignore", over="ignore"):  # the caller looks for NaN and names it
            white = block if plain else design.whiten(block)
            np.matmul(np.matmul(white, basis, out=along[done]), transposed, out=left)
            np.subtract(white, left, out=left)
            np.matmul(np.square(left, out=left), ones, out=chi2[done])
    with np.errstate(invalid="ignore", over="ignore"):
        return along @ design.root.T, chi2
