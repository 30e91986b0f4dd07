"""The pairs of vectors that determine a rotation, and the refusal of those that do not."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def as_pairs(
    W: ArrayLike, V: ArrayLike, weights: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return W and V, and V times its weights, ``(..., k, 3)`` each.

    Raises:
        ValueError: Shapes that do not fit, fewer than two pairs, or a weight that is not finite,
            below zero, or zero like all others.
    """
    w, v = _as_vectors("W", W), _as_vectors("V", V)
    if w.shape != v.shape:
        msg = f"W and V need the same shape, one row a pair; got {w.shape} and {v.shape}"
        raise ValueError(msg)
    if w.shape[-2] < 2:
        msg = f"one direction leaves the turn about it open: give two pairs, not {w.shape[-2]}"
        raise ValueError(msg)
    if weights is None:
        return w, v, v
    return w, v, v * as_weights(weights, w.shape[:-1])[..., np.newaxis]


def as_weights(weights: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Return weights ``(..., k)`` that sum to 1, for pairs of shape ``(..., k)``.

    Raises:
        ValueError: As ``as_pairs``.
    """
    array = np.asarray(weights, dtype=np.float64)
    if array.shape[-1:] != shape[-1:] or len(array.shape) > len(shape):
        msg = f"weights need one number for each of {shape[-1]} pairs; they have {array.shape}"
        raise ValueError(msg)
    check_finite("weights", array)
    if (array < 0.0).any():
        msg = f"a weight is {array.min():g}; weights are 1/sigma^2 and cannot be negative"
        raise ValueError(msg)
    total = array.sum(axis=-1, keepdims=True)
    if not (total > 0.0).all():
        msg = "the weights are all zero: no pair counts; give at least two a positive weight"
        raise ValueError(msg)
    scaled: FloatArray = array / total
    return scaled


def check_finite(name: str, array: FloatArray) -> None:
    """Refuse what is not a number.

    Raises:
        ValueError: The message names the first NaN or infinity.
    """
    if np.isfinite(array).all():
        return
    where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
    msg = f"{name} holds {array[where]} at index {where}; leave such samples out"
    raise ValueError(msg)


def _as_vectors(name: str, vectors: ArrayLike) -> FloatArray:
    array = np.asarray(vectors, dtype=np.float64)
    if array.ndim < 2 or array.shape[-1] != 3:
        msg = f"{name} needs shape (k, 3), one row a vector; it has {array.shape}"
        raise ValueError(msg)
    return array
