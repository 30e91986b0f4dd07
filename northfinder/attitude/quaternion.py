"""Hamilton quaternions, scalar first, of shape ``(..., 4)``; everything broadcasts.

A unit quaternion of an attitude takes the body's coordinates to the reference's,
``v_ref = q (x) [0, v_b] (x) q*``.
"""

import numpy as np
from numpy.typing import ArrayLike

from northfinder.attitude.arrays import FloatArray


def multiply(p: ArrayLike, q: ArrayLike) -> FloatArray:
    """Return the Hamilton product ``p (x) q``: first q's rotation, then p's."""
    p1, q1 = np.asarray(p, dtype=np.float64), np.asarray(q, dtype=np.float64)
    a, b, c, d = (p1[..., i] for i in range(4))
    w, x, y, z = (q1[..., i] for i in range(4))
    return np.stack(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ],
        axis=-1,
    )


def conjugate(q: ArrayLike) -> FloatArray:
    """Return ``q*``, the inverse rotation of a unit quaternion."""
    inverse: FloatArray = np.asarray(q, dtype=np.float64) * np.array([1.0, -1.0, -1.0, -1.0])
    return inverse


def normalise(q: ArrayLike) -> FloatArray:
    """Return ``q / |q|``.

    Raises:
        ValueError: One of them is zero, or not finite.
    """
    array = np.asarray(q, dtype=np.float64)
    length = np.sqrt(np.sum(array * array, axis=-1, keepdims=True))
    if not (np.isfinite(length).all() and (length > 0.0).all()):
        msg = "a quaternion of length zero, or not finite, has no direction to keep"
        raise ValueError(msg)
    unit: FloatArray = array / length
    return unit


def from_rotation_vector(phi: ArrayLike) -> FloatArray:
    """Return ``exp(Phi / 2)`` of rotation vectors ``(..., 3)``, rad."""
    vector = np.asarray(phi, dtype=np.float64)
    half = 0.5 * np.sqrt(np.sum(vector * vector, axis=-1, keepdims=True))
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * vector], axis=-1)


def to_rotation_vector(q: ArrayLike) -> FloatArray:
    """Return the shortest rotation vector of unit quaternions, rad, ``(..., 3)``."""
    array = np.asarray(q, dtype=np.float64)
    array = np.where(array[..., :1] < 0.0, -array, array)
    vector = array[..., 1:]
    length = np.sqrt(np.sum(vector * vector, axis=-1, keepdims=True))
    angle = 2.0 * np.arctan2(length, array[..., :1])
    scale = np.where(length > 0.0, angle / np.where(length > 0.0, length, 1.0), 2.0)
    return scale * vector


def to_matrix(q: ArrayLike) -> FloatArray:
    """Return the matrix ``(3, 3)`` that takes body coordinates to the reference's, of one q."""
    return rotate(q, np.eye(3)).T


def rotate(q: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return ``q (x) [0, v] (x) q*``: body coordinates ``(..., 3)`` in the reference's."""
    array, vector = np.asarray(q, dtype=np.float64), np.asarray(v, dtype=np.float64)
    w, axis = array[..., :1], array[..., 1:]
    twice = 2.0 * np.cross(axis, vector)
    rotated: FloatArray = vector + w * twice + np.cross(axis, twice)
    return rotated
