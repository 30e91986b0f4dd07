"""How an alignment answers a small disturbance: what each sample of it does to the result.

To first order Wahba's problem parts into two straight lines. With ``V = [cosL w t, 0, 1]``, a
disturbance nu of W, in n, is fitted by ``nu_N = psi_U cosL w t - psi_E`` and ``nu_E = psi_N``:
the slope of its North part passes for a heading, its value at T for a tilt. The fit's kernels
are found by running its filter and its weights on the two basis functions; whatever the method,
the sigma of any disturbance follows from them.
"""

from dataclasses import dataclass

import numpy as np

from northfinder.alignment.methods import Form, Method
from northfinder.alignment.observations import low_passed
from northfinder.alignment.pairs import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Kernels: the result is the sum of kernel times disturbance.

    Attributes:
        period_s: Between samples of the disturbance.
        time_s: Of the samples, since the beginning of the stream, ``(n,)``.
        begin: The first sample in the fit; those before only warm the filter.
        slope: Of the North part, 1/s, ``(n,)``.
        north_end: Value of the North part's line at the end, ``(n,)``.
        east_end: Value of the East part's constant, ``(n,)``.
    """

    period_s: float
    time_s: FloatArray
    begin: int
    slope: FloatArray
    north_end: FloatArray
    east_end: FloatArray


def find_response(method: Method, warm: int, samples: int, period_s: float) -> Response:
    """Return the kernels of a method.

    Args:
        method: How the pairs are observed and weighed.
        warm: Samples before the fit.
        samples: Samples in the fit.
        period_s: Between samples.
    """
    time_s: FloatArray = period_s * (np.arange(warm + samples, dtype=np.float64) + 0.5)
    weights = _weights(method, samples)
    basis = np.stack([np.ones_like(time_s), time_s - time_s[-1] - 0.5 * period_s])
    seen = _observed(basis, method.form, warm, period_s)
    line, constant = _least_squares(seen, weights), _least_squares(seen[:1], weights)
    kernels = _unobserved(np.vstack([line, constant]), method.form, warm, period_s)
    return Response(period_s, time_s, warm, kernels[1], kernels[0], kernels[2])


def _weights(method: Method, samples: int) -> FloatArray:
    if method.solver in {"triad", "optimized-triad"}:
        weights = np.zeros(samples)
        weights[[samples // 2 - 1, samples - 1]] = 1.0
        return weights
    x: FloatArray = (np.arange(samples, dtype=np.float64) + 0.5) / samples
    tapered: FloatArray = (x * (1.0 - x)) ** method.power
    return tapered


def _least_squares(rows: FloatArray, weights: FloatArray) -> FloatArray:
    """Return what fits rows ``(b, k)`` by weighted least squares: coefficients = kernel . data."""
    weighted = rows * weights
    return np.asarray(np.linalg.solve(weighted @ rows.T, weighted), dtype=np.float64)


def _observed(rows: FloatArray, form: Form, warm: int, period_s: float) -> FloatArray:
    """Return what the fit sees of disturbances ``(b, n)``, ``(b, samples)``."""
    if form == "velocity":
        summed: FloatArray = period_s * np.cumsum(rows[:, warm:], axis=1)
        return summed
    if form == "low-passed":
        return low_passed(rows, period_s)[:, warm:]
    return rows[:, warm:]


def _unobserved(rows: FloatArray, form: Form, warm: int, period_s: float) -> FloatArray:
    """Return kernels of the disturbance out of kernels of what is seen of it: the transpose.

    A filter's transpose is the same filter run backwards in time.
    """
    padded = np.hstack([np.zeros((len(rows), warm)), rows])
    return _observed(padded[:, ::-1], form, 0, period_s)[:, ::-1]
