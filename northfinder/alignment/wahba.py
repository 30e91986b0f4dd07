"""Wahba's problem: the rotation that turns V into W with the least weighted squares.

Every solver here minimises ``sum a |W - A(q) V|^2`` and returns the unit quaternion q, scalar
first and not negative, with ``A(q) v = q (x) [0, v] (x) q*``: q takes V's frame to W's. Where W
is seen in the body and V known in the reference, the project's attitude (body to reference) is
``conjugate(q)``. The vectors are not normalised: a longer one counts more.

Source: `rocking-base`, section 2, with Davenport's K for Hamilton quaternions.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.gain import (
    adjugate,
    everywhere,
    largest_eigenvalue,
    newton_turn,
    product_rows,
    rotation_rows,
    turned,
    unit,
)
from northfinder.alignment.matrices import (
    components,
    davenport_rows,
    largest_column,
    quaternion_from_matrix,
    stacked,
)
from northfinder.alignment.pairs import FloatArray, as_pairs, check_finite

_BLOCK = 2048  # of many problems: what is made of them stays in cache
_EIGENVALUES_APART = 1e-7  # of the largest; closer ones Newton finds too coarsely to start from
_CORRECTIONS = 8
_BY_PROFILE = 2  # of them by B alone, which no data need be looked at for
_STANDS_STILL_RAD = 1e-15
_ROUNDING = 1e-15
_WIDE = 1e-6  # squared spread of the directions: above, B's rounding turns q by 1e-10 rad at most


def quest(W: ArrayLike, V: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """QUEST: the largest eigenvalue of K by Newton, its eigenvector out of the adjugate.

    Newton starts from ``sqrt(3) |B|_F``, which no eigenvalue exceeds; 1 does not bound it for
    vectors that are not unit. The adjugate's column with the largest diagonal is right for every
    angle, exactly 180 deg too. B squares the spread of the directions, so in a fan of 0.1 deg the
    published form errs by minutes from rounding alone. Newton's steps on the gain itself mend
    that, in a fan below some 0.2 deg by the residuals ``W - A V``: the optimum is met to 1e-10 rad
    in every fan that is not refused. Where Newton cannot
    tell the eigenvalues apart, below 0.02 deg, ``eigh`` gives the start.

    Args:
        W: Vectors in the frame that q leads to, ``(..., k, 3)``.
        V: The same in the frame that q comes from, same shape.
        weights: ``1/sigma^2`` of each pair, ``(..., k)``; None for equal ones.

    Returns:
        q with ``W = A(q) V``, ``(..., 4)``.

    Raises:
        ValueError: As ``as_pairs``.
        EstimationError: All directions are parallel.
    """
    return _solved(_by_newton, W, V, weights)


def davenport(W: ArrayLike, V: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """Davenport's q method: the eigenvector of K with the largest eigenvalue, by ``eigh``.

    Arguments, result and errors are those of ``quest``; so are the steps to the optimum.
    """
    return _solved(_by_eigh, W, V, weights)


def svd(W: ArrayLike, V: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """Markley's solution: ``A = U diag(1, 1, det U det V) V'`` of ``B = U S V'``.

    Arguments, result and errors are those of ``quest``; so are the steps to the optimum.
    """
    return _solved(_by_svd, W, V, weights)


def _solved(
    start: Callable[[FloatArray], FloatArray],
    W: ArrayLike,
    V: ArrayLike,
    weights: ArrayLike | None,
) -> FloatArray:
    """Return q from what ``start`` makes of B ``(3, 3)`` or ``(m, 3, 3)``, corrected."""

    def solve(w: FloatArray, v: FloatArray, weighted: FloatArray) -> FloatArray:
        B, size = _profile(w, weighted)
        return _corrected(start(B), B, w, v, weighted, size)

    pairs = as_pairs(W, V, weights)
    if pairs[0].ndim == 2:
        return solve(*pairs)
    flat = [x.reshape(-1, *x.shape[-2:]) for x in pairs]
    blocks = ([x[i : i + _BLOCK] for x in flat] for i in range(0, len(flat[0]), _BLOCK))
    q = np.vstack([np.empty((0, 4)), *(solve(*block) for block in blocks)])
    return q.reshape(*pairs[0].shape[:-2], 4)


def _by_newton(B: FloatArray) -> FloatArray:
    K = davenport_rows(components(B))
    root = largest_eigenvalue(K)
    columns = adjugate(K, root)
    q = largest_column(stacked(columns))
    spread = columns[0][0] + columns[1][1] + columns[2][2] + columns[3][3]
    close = np.asarray(spread <= _EIGENVALUES_APART * root**3)
    if close.any():
        q[close] = _by_eigh(B[close])
    return q


def _by_eigh(B: FloatArray) -> FloatArray:
    q: FloatArray = np.linalg.eigh(stacked(davenport_rows(components(B))))[1][..., -1]
    return q


def _by_svd(B: FloatArray) -> FloatArray:
    left, _, right = np.linalg.svd(B)
    sign = np.linalg.det(left) * np.linalg.det(right)
    left[..., 2] *= sign[..., np.newaxis]
    return quaternion_from_matrix(left @ right)


def _profile(W: FloatArray, weighted: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Attitude profile matrix ``B = sum a W V'``, ``(..., 3, 3)``, over its size, and that.

    Raises:
        ValueError: A vector is not finite; one look at B is cheaper than one at each.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        B: FloatArray = np.swapaxes(W, -1, -2) @ weighted
        size = np.abs(B).max(axis=(-2, -1), keepdims=True)
    if not np.isfinite(size).all():
        check_finite("W", W)
        check_finite("V", weighted)
        msg = "W and V are so long that their products overflow; scale them"
        raise ValueError(msg)
    size = np.where(size > 0.0, size, 1.0)
    return B / size, size


def _corrected(  # noqa: PLR0913, PLR0917 (all that there is of a problem)
    q: FloatArray,
    B: FloatArray,
    W: FloatArray,
    V: FloatArray,
    weighted: FloatArray,
    size: FloatArray,
) -> FloatArray:
    """Step from q to the optimum by B; in a narrow fan then by residuals, which lose no digits.

    Newton's method on Wahba's gain, whose gradient is ``sum a (A V) x W``, or the same with
    ``W - A V`` in W's place.

    Raises:
        EstimationError: The directions are parallel: the turn about them is not determined.
    """
    profile, now = components(B), unit(q.tolist() if q.ndim == 1 else list(q.T))
    for step in range(_CORRECTIONS):
        A = rotation_rows(now)
        P = product_rows(profile, A)
        M = P
        if step >= _BY_PROFILE:
            M = product_rows(components(_left_over(stacked(A), W, V, weighted) / size), A)
        turn, spread = newton_turn(P, (M[2][1] - M[1][2], M[0][2] - M[2][0], M[1][0] - M[0][1]))
        now = turned(now, turn)
        if step < _BY_PROFILE and not everywhere(spread > _WIDE):
            continue
        # A step leaves its own square, and what rounding makes of it in a narrow fan.
        moved = abs(turn[0]) + abs(turn[1]) + abs(turn[2])
        if everywhere(moved * (moved + _ROUNDING / spread) < _STANDS_STILL_RAD):
            break
    return np.array(now).T


def _left_over(A: FloatArray, W: FloatArray, V: FloatArray, weighted: FloatArray) -> FloatArray:
    """Return ``sum a (W - s A V) V'``, s the ratio of lengths, by a few: little is left to round.

    A part along ``A V`` has no share in the gradient, so any s would do but for that.
    """
    few = slice(None, None, max(1, W.shape[-2] // 8))
    long, short = (np.sum(x[..., few, :] ** 2, axis=(-2, -1), keepdims=True) for x in (W, V))
    ratio = np.sqrt(long / np.where(short > 0.0, short, 1.0))
    residual = (ratio * A) @ np.swapaxes(V, -1, -2)
    np.subtract(np.swapaxes(W, -1, -2), residual, out=residual)
    left: FloatArray = residual @ weighted
    return left
