"""A drift that the fit does not model: how large it looks, and what it does to a and b."""

from dataclasses import dataclass

import numpy as np

from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.student import sigma_limit

HIGHEST_ORDER = 2
SIGNIFICANT_SIGMAS = 3.0
_RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class DriftTerm:
    """One power of time beyond the fitted ones, common to all segments.

    Attributes:
        order: The power, 1 or 2, of the time since the middle of the segment.
        coefficient: Its size, unit of the readings per s^order, ``(...)``; 0 where the visits
            cannot tell.
        sigma: Its standard deviation, ``(...)``; infinite where the visits cannot tell.
        dof: Degrees of freedom of that sigma; infinite where the readings' sigma was given.
        response: Change of (a, b) for a coefficient of one, ``(2,)``.
    """

    order: int
    coefficient: FloatArray
    sigma: FloatArray
    dof: float
    response: FloatArray

    @property
    def z(self) -> FloatArray:
        """Coefficient over its sigma, ``(...)``."""
        return np.divide(
            self.coefficient, self.sigma, out=np.zeros(self.sigma.shape), where=self.sigma > 0.0
        )

    @property
    def significant(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Whether noise alone is this large as rarely as 3 sigma, ``(...)``."""
        return np.abs(self.z) > sigma_limit(SIGNIFICANT_SIGMAS, self.dof)


def drift_response(fit: HarmonicFit, order: int) -> FloatArray:
    """Return how (a, b) answer to a drift of one unit per s^order, shape ``(2,)``.

    Raises:
        ValueError: The readings carry no time.
    """
    response: FloatArray = fit.gain[1:] @ fit.design.centred_time_s() ** order
    return response


def unmodelled_drift(fit: HarmonicFit) -> tuple[DriftTerm, ...]:
    """Estimate the linear and quadratic drift that the fit leaves out, jointly.

    Only what the model's own columns cannot imitate is seen: a drift shows in the part of its
    course that is orthogonal to R, cos T and sin T (Frisch and Waugh), while the rest of it
    moves the answer. Hence the trap: a quadratic drift that moves the azimuth of one
    out-and-back revolution by 4 sigma adds only about 9 to a chi-square of 45.

    Args:
        fit: The gyro's fit, with the time of each reading.

    Returns:
        Terms of ascending order, beyond the highest that any segment has fitted; none where one
        has a quadratic drift already.

    Raises:
        ValueError: The readings carry no time.
    """
    orders = range(max(fit.design.drift_orders) + 1, HIGHEST_ORDER + 1)
    if not orders:
        return ()
    time_s = fit.design.centred_time_s()
    span_s = float(np.abs(time_s).max()) or 1.0
    columns = fit.design.whiten(np.stack([(time_s / span_s) ** k for k in orders]))
    seen = fit.design.free(columns).T
    freedom = float("inf") if fit.sigma_known else fit.dof - len(orders)
    if freedom < 1 or not _independent(seen, columns):
        coefficients = np.zeros((*fit.chi2.shape, len(orders)))
        sigmas = np.full_like(coefficients, np.inf)
    else:
        coefficients, sigmas = _regress(fit, seen)
    return tuple(
        DriftTerm(
            order,
            coefficients[..., i] / span_s**order,
            sigmas[..., i] / span_s**order,
            freedom,
            drift_response(fit, order),
        )
        for i, order in enumerate(orders)
    )


def _independent(seen: FloatArray, whole: FloatArray) -> bool:
    smallest = np.linalg.svd(seen, compute_uv=False)[-1]
    return bool(smallest > _RANK_TOLERANCE * np.linalg.norm(whole))


def _regress(fit: HarmonicFit, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return coefficients and sigmas from the free directions of the readings, ``(..., m)``."""
    q, r = np.linalg.qr(seen)
    inverse = np.linalg.inv(r)
    free = fit.design.free(fit.design.whiten(fit.reading))
    coefficients = free @ q @ inverse.T
    unit_sigma = np.sqrt(np.sum(inverse**2, axis=1))
    if fit.sigma_known:
        return coefficients, np.broadcast_to(unit_sigma, coefficients.shape)
    left = free - (free @ q) @ q.T
    scatter = np.sqrt(np.sum(left**2, axis=-1) / (fit.dof - seen.shape[1]))
    return coefficients, scatter[..., np.newaxis] * unit_sigma
