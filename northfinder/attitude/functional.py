"""Functional iteration: the rotation vector's own integral equation, solved at Chebyshev nodes.

The rate of a block is the polynomial that its samples determine. The rotation vector starts as
the integral of the rate and is put through Bortz's equation, `coning-rate-vector` eq 4 with its
exact coefficient, until it stands still; three rounds do where the block turns little.
"""

from functools import cache

import numpy as np
from numpy.polynomial import chebyshev

from northfinder.attitude.arrays import FloatArray
from northfinder.attitude.rotation_vectors import Kind

_ROUNDS = 60
_STANDS_STILL = 1e-15  # rad, or relative beyond 1 rad
_SMALL = 1e-2  # rad^2: the series below errs by 1e-16


def functional_rotation_vectors(samples: FloatArray, n: int, kind: Kind) -> FloatArray:
    """Return the rotation vector of each block of ``n`` sampling periods, rad, ``(3, m)``.

    Args:
        samples: Increments ``(m n, 3)``, or rates times the sampling period ``(m n + 1, 3)``, rad.
        n: Sampling periods in a block.
        kind: What the samples are.

    Raises:
        ValueError: A block turns too far for the iteration.
    """
    fit, integral = _matrices(n, kind)
    blocks = _blocks(samples, n, kind)
    rate = fit @ blocks
    return np.ascontiguousarray(_iterated(rate, integral)[:, -1].T)


def _blocks(samples: FloatArray, n: int, kind: Kind) -> FloatArray:
    """Return the samples of each block; neighbours share the rate between them."""
    if kind == "increments":
        return samples.reshape(-1, n, 3)
    windows = np.lib.stride_tricks.sliding_window_view(samples, n + 1, axis=0)[::n]
    return np.swapaxes(windows, 1, 2)


@cache
def _matrices(n: int, kind: Kind) -> tuple[FloatArray, FloatArray]:
    """Return the maps from samples to rates at the nodes, and from those to their integral.

    The nodes are those of Chebyshev and Lobatto, from the block's beginning to its end; twice as
    many as samples, for the products of polynomials.
    """
    nodes = -np.cos(np.pi * np.arange(2 * n + 8) / (2 * n + 7))
    at = np.linspace(-1.0, 1.0, n + 1)
    if kind == "rates":
        basis = chebyshev.chebvander(at, n)
    else:
        basis = 0.5 * n * np.diff(_integrals(at, n), axis=0)
    fit = chebyshev.chebvander(nodes, len(basis) - 1) @ np.linalg.inv(basis)
    values = chebyshev.chebvander(nodes, len(nodes) - 1)
    integral = 0.5 * n * _integrals(nodes, len(nodes)) @ np.linalg.inv(values)
    return fit.astype(np.float64), integral.astype(np.float64)


def _integrals(at: FloatArray, count: int) -> FloatArray:
    """Integrals from -1 of the first ``count`` Chebyshev polynomials, ``(len(at), count)``."""
    columns = [chebyshev.chebval(at, chebyshev.chebint(row, lbnd=-1)) for row in np.eye(count)]
    return np.stack(columns, axis=-1)


def _iterated(rate: FloatArray, integral: FloatArray) -> FloatArray:
    """Return the rotation vector at every node, ``(m, nodes, 3)``."""
    phi, change = integral @ rate, np.float64(np.inf)
    for _ in range(_ROUNDS):
        with np.errstate(over="ignore", invalid="ignore"):
            refined = integral @ _bortz(phi, rate)
        change = np.abs(refined - phi).max(initial=0.0)
        phi = refined
        if not change > _STANDS_STILL * max(1.0, np.abs(phi).max(initial=0.0)):
            break
    if not change < 1e-9:
        turn = np.abs(integral @ rate).max()
        msg = f"functional iteration does not settle: a block turns by {turn:.3g} rad; lower n"
        raise ValueError(msg)
    return phi


def _bortz(phi: FloatArray, rate: FloatArray) -> FloatArray:
    """Rate of the rotation vector, from ``(..., 3)`` rotation vectors and rates."""
    once = np.cross(phi, rate)
    square = np.sum(phi * phi, axis=-1, keepdims=True)
    derivative: FloatArray = rate + 0.5 * once + _coefficient(square) * np.cross(phi, once)
    return derivative


def _coefficient(square: FloatArray) -> FloatArray:
    """``(1 - (p/2) cot(p/2)) / p^2`` of ``p^2``, with its series where it would cancel."""
    series = 1 / 12 + square * (1 / 720 + square * (1 / 30240 + square * (1 / 1209600)))
    half = 0.5 * np.sqrt(np.maximum(square, _SMALL))
    closed = (1.0 - half / np.tan(half)) / (4.0 * half * half)
    return np.where(square < _SMALL, series, closed)
