"""Rotation vectors of the methods: linear and bilinear in the samples of one update.

Rates are taken times the sampling period, so every coefficient here is a pure number; an update
of the three-rate methods lasts h = 2 dt, which puts h/2 = 1 into eqs 16 and 17.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from northfinder.attitude.arrays import FloatArray

Kind = Literal["rates", "increments"]
Row = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Scheme:
    """``Phi = sum_i total_i s_i + sum over crosses of (left . s) x (right . s)``.

    Attributes:
        kind: What the samples are.
        stride: Sampling periods in an update.
        total: Coefficients of the linear part, one for each sample of the window.
        crosses: Pairs of rows of coefficients.
    """

    kind: Kind
    stride: int
    total: Row
    crosses: tuple[tuple[Row, Row], ...] = ()

    @property
    def window(self) -> int:
        """Samples that one update looks at."""
        return len(self.total)


def _n_sample(n: int, *crosses: tuple[Row, Row]) -> Scheme:
    return Scheme("increments", n, (1.0,) * n, crosses)


def _three_rates(x: float, y: float) -> Scheme:
    """``S + h^2 (x w1 + y w2) x (w3 - w1)``, ``S = h/6 (w1 + 4 w2 + w3)``, h = 2."""
    return Scheme("rates", 2, (1 / 3, 4 / 3, 1 / 3), (((4.0 * x, 4.0 * y, 0.0), (-1.0, 0.0, 1.0)),))


def _trailing(*c: float) -> Scheme:
    """``d_k + (sum_j c_j d_(k-j)) x d_k``: the window ends with d_k."""
    last = (*(0.0 for _ in c), 1.0)
    return Scheme("increments", 1, last, (((*reversed(c), 0.0), last),))


#: `coning-rate-vector` eqs 5, 6, 16 and 17; (1/120, 3/40) is optimal for Simpson's S. The optimal
#: three- and four-sample forms null the coning terms that their Taylor forms leave.
SCHEMES: Final[dict[str, Scheme]] = {
    "one-sample": _n_sample(1),
    "two-sample": _n_sample(2, ((2 / 3, 0.0), (0.0, 1.0))),
    "three-sample-taylor": _n_sample(3, ((33 / 80, 57 / 80, 0.0), (-1.0, 0.0, 1.0))),
    "three-sample": _n_sample(3, ((9 / 20, 27 / 40, 0.0), (-1.0, 0.0, 1.0))),
    "four-sample-taylor": _n_sample(
        4,
        ((1.0, 0.0, 0.0, 0.0), (0.0, 736 / 945, 334 / 945, 526 / 945)),
        ((0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 654 / 945, 334 / 945)),
        ((0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 736 / 945)),
    ),
    "four-sample": _n_sample(4, ((54 / 105, 92 / 105, 214 / 105, 0.0), (0.0, 0.0, 0.0, 1.0))),
    "rate-vector-taylor": _three_rates(1 / 60, 1 / 15),
    "rate-vector": _three_rates(1 / 180, 7 / 90),
    "rate-vector-optimal": _three_rates(1 / 120, 3 / 40),
    "trailing-1": _trailing(1 / 12),
    "trailing-2": _trailing(7 / 60, -1 / 60),
    "trailing-3": _trailing(113 / 840, -13 / 420, 1 / 280),
    "trailing-4": _trailing(367 / 2520, -53 / 1260, 1 / 120, -1 / 1260),
}


def picard_scheme(alpha: float, beta: float) -> Scheme:
    """``alpha w(t) + beta (w(t) - w(t-1))`` held over the interval that ends at t.

    Source: `rate-correction`, eq 12. beta = -0.5 is the trapezoid.
    """
    return Scheme("rates", 1, (-beta, alpha + beta))


def rotation_vectors(scheme: Scheme, columns: Sequence[FloatArray]) -> FloatArray:
    """Return the rotation vector of every update, rad, ``(3, m)``.

    Args:
        scheme: The method.
        columns: For each sample of the window, that sample of all updates, ``(3, m)``, rad:
            increments, or rates times the sampling period.
    """
    phi = _combined(scheme.total, columns)
    for left, right in scheme.crosses:
        _add_cross(phi, _combined(left, columns), _combined(right, columns))
    return phi


def window_columns(
    scheme: Scheme, samples: FloatArray, unit: float, first: int, last: int
) -> list[FloatArray]:
    """Return the columns, times ``unit``, of updates ``first`` to ``last - 1``.

    Args:
        scheme: The method; its first window begins with the first sample.
        samples: ``(k, 3)``.
        unit: The sampling period for rates, 1 for increments.
        first: Number of the first update wanted.
        last: One beyond the last.
    """
    rows = samples[first * scheme.stride : (last - 1) * scheme.stride + scheme.window].T
    span = (last - first - 1) * scheme.stride + 1
    return [unit * rows[:, i : i + span : scheme.stride] for i in range(scheme.window)]


def reversed_in_time(scheme: Scheme) -> Scheme:
    """Return the scheme that gives the same rotation with the window read backwards.

    Backwards every increment and the rotation change sign, so the cross products do too: a
    trailing method becomes one that looks ahead.
    """
    crosses = tuple(
        (tuple(-c for c in reversed(left)), tuple(reversed(right)))
        for left, right in scheme.crosses
    )
    return Scheme(scheme.kind, scheme.stride, tuple(reversed(scheme.total)), crosses)


def _combined(row: Row, columns: Sequence[FloatArray]) -> FloatArray:
    terms = [c * column for c, column in zip(row, columns, strict=True) if c]
    total = terms[0] if terms else np.zeros_like(columns[0])
    for term in terms[1:]:
        total += term
    return total


def _add_cross(phi: FloatArray, u: FloatArray, v: FloatArray) -> None:
    """Add ``u x v`` of vectors ``(3, m)`` in place."""
    phi[0] += u[1] * v[2] - u[2] * v[1]
    phi[1] += u[2] * v[0] - u[0] * v[2]
    phi[2] += u[0] * v[1] - u[1] * v[0]
