"""The least-squares geometry of a revolution: everything about the fit but the readings.

Model of one reading, with tau the time since the middle of its segment:

    y = R_segment + m (a cos T + b sin T) + sum over k of d_segment,k tau^k

m is 1 where the table stands; a reading that is the mean over a sector of the circle feels less
of the harmonic. Columns stand in the order R, a, b and drift of the first segment, then R and
drift of each further one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from northfinder.errors import EstimationError
from northfinder.estimators.arrays import FloatArray, IntArray, as_finite
from northfinder.units import DEG

SAME_ANGLE_RAD = 1e-6  # 0.2 arc seconds: below any table's repeatability, above rounding
_RANK_TOLERANCE = 1e-12  # of the largest singular value, columns scaled to unit length
_ANGLES_IN_MESSAGE = 12


@dataclass(frozen=True, slots=True, eq=False)
class HarmonicDesign:
    """Where and when n readings were taken, and the linear maps that follow from it.

    Attributes:
        angle_rad: Table angle plus mount angle of each reading, shape ``(n,)``.
        time_s: Time of each reading, ``(n,)``, or None.
        segment: Which segment, counted from 0, each reading belongs to, ``(n,)``.
        labels: The caller's label of each segment, ascending.
        drift_orders: Degree of the drift polynomial of each segment, in the labels' order.
        sigma: Standard deviation of each reading, of correlated ones about their mean, ``(n,)``;
            None where it is not known.
        covariance: Of the readings where they are correlated, ``(n, n)``, up to a constant
            common to all elements; absolute where sigma is known, else up to a factor.
        attenuation: m of each reading, ``(n,)``.
        matrix: The model, ``(n, p)``.
        whitener: Makes the readings' noise white and of variance one (up to the factor):
            weights ``(n,)``, or a triangular matrix ``(n, n)`` where they are correlated.
        gain: Parameters from readings, ``parameters = gain @ y``, ``(p, n)``.
        root: Parameters from whitened readings along the basis, ``(p, p)``.
        basis: Orthonormal directions of the weighted model, ``(n, p)``; what is orthogonal to
            them is left free. Thin on purpose: the free directions themselves would be n x n.
    """

    angle_rad: FloatArray
    time_s: FloatArray | None
    segment: IntArray
    labels: tuple[int, ...]
    drift_orders: tuple[int, ...]
    sigma: FloatArray | None
    covariance: FloatArray | None
    attenuation: FloatArray
    matrix: FloatArray
    whitener: FloatArray
    gain: FloatArray
    root: FloatArray
    basis: FloatArray

    @property
    def dof(self) -> int:
        """Degrees of freedom, readings less parameters."""
        n, p = self.matrix.shape
        return int(n - p)

    @property
    def unit_covariance(self) -> FloatArray:
        """Covariance of the parameters for noise as given, ``(p, p)``."""
        covariance: FloatArray = self.root @ self.root.T
        return covariance

    @property
    def variance(self) -> FloatArray:
        """Variance of each reading as given, of correlated ones about their mean, ``(n,)``."""
        if self.covariance is None:
            return np.square(1.0 / self.whitener)
        return _variance_about_mean(self.covariance)

    def whiten(self, readings: FloatArray) -> FloatArray:
        """Return readings ``(..., n)`` with white noise of variance one."""
        if self.whitener.ndim == 1:
            return readings * self.whitener
        whitened: FloatArray = readings @ self.whitener.T
        return whitened

    def free(self, whitened: FloatArray) -> FloatArray:
        """Return the part of whitened readings that the model cannot imitate, ``(..., n)``."""
        left: FloatArray = whitened - (whitened @ self.basis) @ self.basis.T
        return left

    def segment_columns(self, index: int) -> list[int]:
        """Return the columns of R and drift of the segment counted from 0."""
        start = 2 + index + sum(self.drift_orders[:index])
        drift = list(range(start + 1, start + 1 + self.drift_orders[index]))
        return [start if index else 0, *drift]  # a and b stand behind the first R

    def centred_time_s(self) -> FloatArray:
        """Return the time since the middle (the mean) of each reading's segment, ``(n,)``.

        Raises:
            ValueError: The readings carry no time.
        """
        if self.time_s is None:
            msg = "drift needs the time of each reading: give time_s to the fit"
            raise ValueError(msg)
        return _centred(self.time_s, self.segment)


def distinct_angles(angle_rad: FloatArray) -> IntArray:
    """Number the distinct angles modulo a turn; equal ones share a number, shape ``(n,)``."""
    order = np.argsort(np.mod(angle_rad, 2.0 * np.pi), kind="stable")
    turned = np.mod(angle_rad, 2.0 * np.pi)[order]
    group = np.concatenate([[0], np.cumsum(np.diff(turned) > SAME_ANGLE_RAD)])
    if turned[0] + 2.0 * np.pi - turned[-1] <= SAME_ANGLE_RAD:
        group[group == group[-1]] = 0
    number = np.empty(len(angle_rad), dtype=np.int64)
    number[order] = group
    return number


def harmonic_design(  # noqa: PLR0913 -- the published fit's, and what only its callers know
    angle_rad: ArrayLike,
    sigma: ArrayLike | None = None,
    time_s: ArrayLike | None = None,
    drift_order: int | Sequence[int] = 0,
    segment: ArrayLike | None = None,
    *,
    covariance: ArrayLike | None = None,
    absolute: bool = True,
    attenuation: ArrayLike | None = None,
) -> HarmonicDesign:
    """Prepare the weighted least squares of readings at any set of angles.

    Args:
        angle_rad: Table angle plus mount angle of each reading, shape ``(n,)``.
        sigma: Standard deviation of the readings, scalar or ``(n,)``; None: not known, equal.
        time_s: Time of each reading, ``(n,)``; needed for a drift.
        drift_order: Degree of the drift polynomial, 0 for none; of every segment, or one for
            each in ascending order of their labels.
        segment: Integer label of each reading; each segment has its own R and drift.
        covariance: Of readings that are correlated, in place of sigma, ``(n, n)``: the fit is
            that of generalised least squares (Aitken). A constant common to all elements
            changes nothing, for R is fitted.
        absolute: Whether that covariance is known, or only its shape: then the residuals scale it.
        attenuation: By how much each reading feels the harmonic, ``(n,)``; 1 unless given.

    Raises:
        EstimationError: Too few readings or angles to determine every parameter.
        ValueError: A shape does not fit, a number is not finite, a sigma not positive, a
            covariance not one.
    """
    angle = as_finite("angle_rad", angle_rad)
    if angle.ndim != 1 or angle.size == 0:
        msg = f"angle_rad needs shape (n,), one angle a reading; it has {angle.shape}"
        raise ValueError(msg)
    time = None if time_s is None else _per_reading("time_s", time_s, angle.size)
    labels, index = _segments(segment, angle.size)
    orders = _drift_orders(drift_order, len(labels), timed=time is not None)
    felt = np.ones(angle.size)
    if attenuation is not None:
        felt = _per_reading("attenuation", attenuation, angle.size)
    matrix, scale = _model(angle, time, index, orders, felt)
    _check_determined(angle, matrix)
    noise = _noise(sigma, covariance, angle.size, absolute=absolute)
    solved = _solve(matrix, noise.whitener, scale, angle)
    return HarmonicDesign(
        angle,
        time,
        index,
        labels,
        orders,
        noise.sigma,
        noise.covariance,
        felt,
        matrix * scale,
        noise.whitener,
        *solved,
    )


def _per_reading(name: str, values: ArrayLike, n: int) -> FloatArray:
    array = as_finite(name, values)
    if array.shape != (n,):
        msg = f"{name} needs one value for each of the {n} angles; its shape is {array.shape}"
        raise ValueError(msg)
    return array


class _Noise(NamedTuple):
    sigma: FloatArray | None
    covariance: FloatArray | None
    whitener: FloatArray


def _noise(
    sigma: ArrayLike | None, covariance: ArrayLike | None, n: int, *, absolute: bool
) -> _Noise:
    if covariance is None:
        sigmas = None if sigma is None else _sigmas(sigma, n)
        return _Noise(sigmas, None, np.ones(n) if sigmas is None else 1.0 / sigmas)
    if sigma is not None:
        msg = "give the noise once: sigma, or the covariance of correlated readings"
        raise ValueError(msg)
    given = as_finite("covariance", covariance)
    if given.shape != (n, n):
        msg = f"covariance needs shape ({n}, {n}), a row and a column a reading, not {given.shape}"
        raise ValueError(msg)
    try:
        factor = np.linalg.cholesky(_lifted(given))
    except np.linalg.LinAlgError as error:
        msg = "the covariance is none: some combination of the readings has no variance"
        raise ValueError(msg) from error
    sigmas = np.sqrt(_variance_about_mean(given)) if absolute else None
    return _Noise(sigmas, given, np.linalg.inv(factor))


def _lifted(covariance: FloatArray) -> FloatArray:
    """Add a constant to all elements: R absorbs it, and flicker's is unknown (it may be low)."""
    centred = covariance - covariance.mean()
    lifted: FloatArray = centred + 2.0 * float(np.abs(centred).max())
    return lifted


def _variance_about_mean(covariance: FloatArray) -> FloatArray:
    """Return what does not depend on a constant common to all elements, ``(n,)``."""
    rows = covariance.mean(axis=1)
    variance: FloatArray = np.diag(covariance) - 2.0 * rows + rows.mean()
    return variance


def _sigmas(sigma: ArrayLike, n: int) -> FloatArray:
    array = as_finite("sigma", sigma)
    sigmas = _per_reading("sigma", np.full(n, array) if array.ndim == 0 else array, n)
    if sigmas.min() <= 0.0:
        msg = f"sigma must be positive, got {sigmas.min():g}; give None where it is not known"
        raise ValueError(msg)
    return sigmas


def _segments(segment: ArrayLike | None, n: int) -> tuple[tuple[int, ...], IntArray]:
    if segment is None:
        return (0,), np.zeros(n, dtype=np.int64)
    array = np.asarray(segment)
    if array.shape != (n,) or not np.issubdtype(array.dtype, np.integer):
        msg = (
            f"segment needs one integer for each of the {n} angles; got {array.dtype} {array.shape}"
        )
        raise ValueError(msg)
    labels, index = np.unique(array, return_inverse=True)
    return tuple(int(label) for label in labels), index.astype(np.int64)


def _drift_orders(
    drift_order: int | Sequence[int], segments: int, *, timed: bool
) -> tuple[int, ...]:
    each = drift_order if isinstance(drift_order, Sequence) else [drift_order] * segments
    orders = tuple(each)
    if len(orders) != segments:
        msg = f"drift_order names {len(orders)} segments, but there are {segments}"
        raise ValueError(msg)
    if min(orders) < 0 or (max(orders) > 0 and not timed):
        msg = f"drift_order is {drift_order}: it must be 0, or positive together with time_s"
        raise ValueError(msg)
    return orders


def _centred(time_s: FloatArray, segment: IntArray) -> FloatArray:
    mean_s = np.bincount(segment, time_s) / np.bincount(segment)
    centred: FloatArray = time_s - mean_s[segment]
    return centred


def _model(
    angle: FloatArray,
    time: FloatArray | None,
    segment: IntArray,
    drift_orders: Sequence[int],
    attenuation: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the model with time in units of half a segment, and what scales its columns back."""
    tau = np.zeros_like(angle) if time is None else _centred(time, segment)
    span = float(np.abs(tau).max()) or 1.0
    columns, scale = [], []
    for index, order in enumerate(drift_orders):
        inside = (segment == index).astype(np.float64)
        harmonics = [attenuation * wave(angle) for wave in (np.cos, np.sin)] if index == 0 else []
        drifts = [inside * (tau / span) ** k for k in range(1, order + 1)]
        columns += [inside, *harmonics, *drifts]
        scale += [1.0] * (1 + len(harmonics)) + [span**k for k in range(1, order + 1)]
    return np.column_stack(columns), np.array(scale)


def _check_determined(angle: FloatArray, matrix: FloatArray) -> None:
    n, p = matrix.shape
    distinct = int(distinct_angles(angle).max()) + 1
    if distinct < 3:
        msg = (
            f"a harmonic fit needs at least 3 distinct angles, got {distinct}: "
            f"{_in_degrees(angle)}; measure at more table angles"
        )
        raise EstimationError(msg)
    if n < p:
        msg = (
            f"{n} readings cannot determine {p} parameters (R and drift of each segment, a, b); "
            f"measured at {_in_degrees(angle)}; measure more visits or fit less drift"
        )
        raise EstimationError(msg)


def _solve(
    matrix: FloatArray, whitener: FloatArray, scale: FloatArray, angle: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return gain, root and basis of the weighted least squares."""
    whitened = whitener[:, np.newaxis] * matrix if whitener.ndim == 1 else whitener @ matrix
    length = np.linalg.norm(whitened, axis=0)
    u, s, vt = np.linalg.svd(whitened / np.where(length > 0.0, length, 1.0), full_matrices=False)
    if s[-1] <= _RANK_TOLERANCE * s[0]:
        msg = (
            f"the angles {_in_degrees(angle)} with these segments and times do not determine R, "
            "a, b and the drift separately; measure at more angles or in another order"
        )
        raise EstimationError(msg)
    root = vt.T / s / (length * scale)[:, np.newaxis]
    along: FloatArray = u.T * whitener if whitener.ndim == 1 else u.T @ whitener
    return root @ along, root, u


def _in_degrees(angle: FloatArray) -> str:
    shown = ", ".join(f"{value:g}" for value in angle[:_ANGLES_IN_MESSAGE] / DEG)
    return f"{shown}{', ...' if angle.size > _ANGLES_IN_MESSAGE else ''} deg"
