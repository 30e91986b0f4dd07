"""TRIAD and Optimized TRIAD: a rotation from just two pairs of vectors.

Sign convention as in ``wahba``: ``W = A(q) V``, q takes V's frame to W's, scalar first.

Source: `rocking-base`, section 2.
"""

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.matrices import quaternion_from_matrix
from northfinder.alignment.pairs import FloatArray, as_pairs, as_weights, check_finite
from northfinder.errors import EstimationError

_LEAST_SINE = 1e-12  # between two directions: rounding fills 1e-16 of it


def triad(W: ArrayLike, V: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """TRIAD: the heavier direction is met exactly, the other one gives the turn about it.

    Args:
        W: Two vectors in the frame that q leads to, ``(..., 2, 3)``; only directions count.
        V: The same two in the frame that q comes from, same shape.
        weights: ``1/sigma^2`` of both, ``(..., 2)``; None, or equal ones: the first is heavier.

    Returns:
        q with ``W = A(q) V``, ``(..., 4)``, its scalar part not negative.

    Raises:
        ValueError: As ``as_pairs``, or another number of pairs than two.
        EstimationError: The two directions are parallel.
    """
    w, v, a = _two_pairs(W, V, weights)
    second = (a[..., 1] > a[..., 0])[..., np.newaxis, np.newaxis]
    w, v = (np.where(second, x[..., ::-1, :], x) for x in (w, v))
    return quaternion_from_matrix(_through(w, v))


def optimized_triad(W: ArrayLike, V: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """Optimized TRIAD: both TRIADs weighed, then one step back to a rotation.

    ``A = (s2^2 A1 + s1^2 A2) / (s1^2 + s2^2)`` with ``1/s^2`` the weights, A1 exact in the first
    direction and A2 in the second; then ``(A + A^-T) / 2``. A third-order error of the step
    remains in its length and none in its direction: q is normalised.

    Arguments, result and errors are those of ``triad``.
    """
    w, v, a = _two_pairs(W, V, weights)
    share = (a / a.sum(axis=-1, keepdims=True))[..., np.newaxis, np.newaxis]
    A = share[..., 0, :, :] * _through(w, v) + share[..., 1, :, :] * _through(
        w[..., ::-1, :], v[..., ::-1, :]
    )
    return quaternion_from_matrix(0.5 * (A + np.swapaxes(np.linalg.inv(A), -1, -2)))


def _two_pairs(
    W: ArrayLike, V: ArrayLike, weights: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    w, v, _ = as_pairs(W, V, weights)
    check_finite("W", w)
    check_finite("V", v)
    if w.shape[-2] != 2:
        msg = f"TRIAD takes two pairs; got {w.shape[-2]}: choose two, or use quest"
        raise ValueError(msg)
    equal = np.full(2, 0.5)
    return w, v, equal if weights is None else as_weights(weights, w.shape[:-1])


def _through(W: FloatArray, V: FloatArray) -> FloatArray:
    """Return the rotation that takes V's triad to W's, ``(..., 3, 3)``."""
    return _frame("W", W) @ np.swapaxes(_frame("V", V), -1, -2)


def _frame(name: str, pair: FloatArray) -> FloatArray:
    """Return the axes ``x, n, x cross n`` as columns, n normal to both directions.

    Raises:
        EstimationError: A vector is zero, or the two are parallel.
    """
    length = np.sqrt(np.sum(pair * pair, axis=-1, keepdims=True))
    if not (length > 0.0).all():
        msg = f"a vector of {name} is zero; it has no direction"
        raise EstimationError(msg)
    unit = pair / length
    normal = np.cross(unit[..., 0, :], unit[..., 1, :])
    sine = np.sqrt(np.sum(normal * normal, axis=-1, keepdims=True))
    if not (sine > _LEAST_SINE).all():
        msg = f"the two vectors of {name} are parallel; they leave the turn about them open"
        raise EstimationError(msg)
    normal /= sine
    # Rounding leaves the normal of a narrow pair slanting; the second pass sets it upright.
    slant = np.sum(normal * unit[..., 0, :], axis=-1, keepdims=True)
    normal -= slant * unit[..., 0, :]
    normal /= np.sqrt(np.sum(normal * normal, axis=-1, keepdims=True))
    return np.stack([unit[..., 0, :], normal, np.cross(unit[..., 0, :], normal)], axis=-1)
