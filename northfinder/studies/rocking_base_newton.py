"""QUEST to the letter of `rocking-base` (eqs 13 to 17), in floats or in Decimals."""

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from northfinder.alignment import quest
from northfinder.attitude.arrays import FloatArray
from northfinder.studies.rocking_base_seen import PER_SECOND, reactions

Numbers = NDArray[Any]  # floats, or Decimals as objects

_DIGITS: Final = 60
_STEPS: Final = 40  # more than any start near 1 needs
_ATTITUDES: Final = 200
_OF_UNIT_VECTORS: Final = -0.5  # power of the squared length that makes it 1


@dataclass(frozen=True, slots=True, eq=False)
class Rounding:
    """Errors that rounding alone makes at rest, one for each of many attitudes, rad.

    Attributes:
        duration_s: Of the fit.
        published: By the paper's formulas in double precision, ``(200,)``.
        ours: By the package, ``(200,)``.
    """

    duration_s: float
    published: FloatArray
    ours: FloatArray


def profile(W: FloatArray, V: FloatArray) -> FloatArray:
    """Return B of unit vectors with equal weights that sum to 1, ``(3, 3)``."""
    w, v = (x * (x * x).sum(axis=1, keepdims=True) ** _OF_UNIT_VECTORS for x in (W, V))
    return np.asarray(w.T @ v / len(w))


def published_quest(B: Numbers, steps: int) -> Numbers:
    """Return q after so many Newton steps from 1, not normalised, ``(4,)``, scalar first."""
    S, sigma = B + B.T, np.trace(B)  # noqa: N806 (as in print)
    z = np.array([B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1]])
    squared, adjugate = S @ S, _adjugate(S)
    kappa, delta = np.trace(adjugate), S[0] @ adjugate[:, 0]
    root = _newton((sigma, kappa, delta), (z @ z, z @ S @ z, z @ squared @ z), steps)
    alpha, beta = root * root - sigma * sigma + kappa, root - sigma
    x = alpha * z + beta * (S @ z) + squared @ z
    return np.array([(root + sigma) * alpha - delta, *x])


def _newton(of_s: tuple[Any, Any, Any], of_z: tuple[Any, Any, Any], steps: int) -> Any:  # noqa: ANN401 (float or Decimal)
    """Return the root of eq 16 by eq 17."""
    sigma, kappa, delta = of_s
    a, b, c, d = sigma * sigma - kappa, sigma * sigma + of_z[0], delta + of_z[1], of_z[2]
    root = sigma * 0 + 1
    for _ in range(steps):
        square = root * root
        value = (square - a - b) * square - c * root + a * b + c * sigma - d
        slope = 4 * square * root - 2 * (a + b) * root - c
        if abs(value) <= _settled(slope):
            break
        root -= value / slope
    return root


def _settled(slope: Any) -> Any:  # noqa: ANN401 (float or Decimal)
    """Return the value that moves the root by no more than the arithmetic can tell."""
    return abs(slope) * (Decimal("1e-55") if isinstance(slope, Decimal) else 1e-15)


def _adjugate(symmetric: Numbers) -> Numbers:
    (a, b, c), (_, d, e), (_, _, f) = symmetric
    return np.array(
        [
            [d * f - e * e, c * e - b * f, b * e - c * d],
            [c * e - b * f, a * f - c * c, b * c - a * e],
            [b * e - c * d, b * c - a * e, a * d - b * b],
        ]
    )


def truncated_rad(B: FloatArray, steps: Sequence[int]) -> list[float]:
    """Return how far q is after so many steps from where it settles, with nothing rounded, rad."""
    with localcontext() as context:
        context.prec = _DIGITS
        exact = np.array([[Decimal(float(x)) for x in row] for row in B], dtype=object)
        settled = _unit(published_quest(exact, _STEPS))
        return [_apart_rad(settled, _unit(published_quest(exact, n))) for n in steps]


def _apart_rad(left: Numbers, right: Numbers) -> float:
    """Return the angle between two attitudes that lie close together."""
    apart = left - right if left @ right > 0 else left + right
    return 2.0 * float(np.sqrt(apart @ apart))


def _unit(q: Numbers) -> Numbers:
    unit: Numbers = q / np.sqrt(q @ q)
    return unit


def rounding(duration_s: float) -> Rounding:
    """Find north at rest with perfect sensors, in every attitude."""
    V = reactions(round(duration_s * PER_SECOND))
    errors = [_errors(turn, V) for turn in Rotation.random(_ATTITUDES, rng=_generator())]
    published, ours = np.array(errors).T
    return Rounding(duration_s, published, ours)


def _generator() -> np.random.Generator:
    return np.random.default_rng(2014)


def _errors(turn: Rotation, V: FloatArray) -> tuple[float, float]:
    W = turn.apply(V)
    found = (published_quest(profile(W, V), _STEPS), quest(W, V))
    published, ours = (
        float((Rotation.from_quat(q, scalar_first=True) * turn.inv()).magnitude()) for q in found
    )
    return published, ours
