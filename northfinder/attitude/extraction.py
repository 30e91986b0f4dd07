"""Angle increments out of rates: the integral of a polynomial through neighbouring rates."""

from typing import Final, Literal

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike

from northfinder.attitude.arrays import FloatArray, as_samples, check_name

Extraction = Literal["rectangle", "trapezoid", "quadratic", "cubic"]

#: Degree of the polynomial of each extraction.
DEGREES: Final[dict[str, int]] = {"rectangle": 0, "trapezoid": 1, "quadratic": 2, "cubic": 3}


def extract_increments(
    rates: ArrayLike, dt: float, extraction: Extraction, update: int = 1
) -> FloatArray:
    """Integrate the polynomial through neighbouring rates over every sampling period.

    ``rectangle`` holds the rate at the end of the interval, as `rate-correction` does. The others
    go through the rates of the update that the interval belongs to and through none later: as
    many of them as the degree needs, nearest to the interval; an update with too few reaches
    back, and at the beginning, where nothing lies behind, ahead.

    Args:
        rates: At 0, dt, 2 dt, ..., rad/s, ``(k, 3)``.
        dt: Sampling period, s.
        extraction: Which polynomial.
        update: Sampling periods in an update of the method that the increments are for.

    Returns:
        Increments over (0, dt), (dt, 2 dt), ... of whole updates, rad.

    Raises:
        ValueError: Unknown extraction, or too few rates for its polynomial.
    """
    check_name("extraction", extraction, DEGREES)
    array, degree = as_samples(rates), DEGREES[extraction]
    needed = max(degree, update) + 1
    if len(array) < needed:
        msg = f"{extraction} extraction needs at least {needed} rates; got {len(array)}"
        raise ValueError(msg)
    count = (len(array) - 1) // update * update
    if extraction == "rectangle":
        return dt * array[1 : count + 1]
    interval = np.arange(count)
    first = _first_rates(interval, degree, update)
    weights = polynomial_weights(np.arange(degree + 1.0), np.arange(degree + 1.0))
    rows = dt * weights[interval - first]
    increments: FloatArray = np.zeros((count, 3))
    for i in range(degree + 1):
        increments += rows[:, i, np.newaxis] * array[first + i]
    return increments


def polynomial_weights(nodes: ArrayLike, edges: ArrayLike) -> FloatArray:
    """Weights that integrate the polynomial through given nodes between successive edges.

    Args:
        nodes: Where the rates were taken, ``(p,)``, all different.
        edges: Limits of the intervals, in the same unit, ``(i + 1,)``.

    Returns:
        One row for each interval, one column for each node, ``(i, p)``, in that unit.
    """
    at, limits = np.asarray(nodes, dtype=np.float64), np.asarray(edges, dtype=np.float64)
    powers = np.arange(1, len(at) + 1)
    integrals = np.diff(limits[:, np.newaxis] ** powers, axis=0) / powers
    weights: FloatArray = integrals @ np.linalg.inv(polynomial.polyvander(at, len(at) - 1))
    return weights


def _first_rates(
    interval: np.ndarray[tuple[int], np.dtype[np.int64]], degree: int, update: int
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the first rate of each interval's polynomial."""
    begin = interval // update * update
    earliest = begin if update >= degree else np.zeros_like(begin)
    latest = np.maximum(begin + update - degree, 0)
    return np.clip(interval - (degree - 1) // 2, earliest, latest)
