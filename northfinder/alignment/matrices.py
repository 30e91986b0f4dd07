"""Rotation matrices and the quaternions that turn alike, ``C v = q (x) [0, v] (x) q*``."""

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.pairs import FloatArray


def matrix_from_quaternion(q: ArrayLike) -> FloatArray:
    """Return the matrices ``(..., 3, 3)`` of unit quaternions ``(..., 4)``, scalar first."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    C = np.empty((*w.shape, 3, 3))
    C[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    C[..., 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    C[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    C[..., 0, 1], C[..., 1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
    C[..., 0, 2], C[..., 2, 0] = 2.0 * (x * z + w * y), 2.0 * (x * z - w * y)
    C[..., 1, 2], C[..., 2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)
    return C


def quaternion_from_matrix(C: ArrayLike) -> FloatArray:
    """Return the unit quaternions ``(..., 4)``, scalar not negative, of rotations ``(..., 3, 3)``.

    Davenport's K of a rotation is ``4 q q' - 1``: any column is q's direction, and the one with
    the largest diagonal is right for every angle, 180 deg too.
    """
    K = davenport_matrix(np.asarray(C, dtype=np.float64))
    return canonical(largest_column(K + np.eye(4)))


def davenport_matrix(B: FloatArray) -> FloatArray:
    """Return ``K = [[sigma, z'], [z, B + B' - sigma]]`` of ``B = sum a W V'``, ``(..., 4, 4)``.

    ``q' K q`` is Wahba's gain ``tr(A(q) B')``, for Hamilton quaternions, scalar first.
    """
    sigma = trace(B)
    K = np.empty((*B.shape[:-2], 4, 4))
    K[..., 0, 0] = sigma
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        K[..., 0, i + 1] = K[..., i + 1, 0] = B[..., k, j] - B[..., j, k]
        K[..., i + 1, i + 1] = 2.0 * B[..., i, i] - sigma
        K[..., j + 1, k + 1] = K[..., k + 1, j + 1] = B[..., j, k] + B[..., k, j]
    return K


def largest_column(matrix: FloatArray) -> FloatArray:
    """Return the column of ``(..., n, n)`` with the largest diagonal, ``(..., n)``."""
    diagonal = np.abs(np.diagonal(matrix, axis1=-2, axis2=-1))
    at = np.argmax(diagonal, axis=-1)[..., np.newaxis, np.newaxis]
    column: FloatArray = np.take_along_axis(matrix, at, axis=-1)[..., 0]
    return column


def trace(matrix: FloatArray) -> FloatArray:
    """Return the trace of matrices ``(..., n, n)``; on many small ones faster than NumPy's."""
    total: FloatArray = np.asarray(np.einsum("...ii->...", matrix))
    return total


def cofactors(matrix: FloatArray) -> FloatArray:
    """Return the adjugate of symmetric matrices ``(..., 3, 3)``."""
    result = np.empty_like(matrix)
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        result[..., i, i] = (
            matrix[..., j, j] * matrix[..., k, k] - matrix[..., j, k] * matrix[..., j, k]
        )
        off = matrix[..., i, j] * matrix[..., i, k] - matrix[..., i, i] * matrix[..., j, k]
        result[..., j, k] = result[..., k, j] = off
    return result


def canonical(q: FloatArray) -> FloatArray:
    """Return ``q / |q|`` with its scalar part not negative."""
    signed = np.where(q[..., :1] < 0.0, -q, q)
    unit: FloatArray = signed / np.sqrt(np.einsum("...i,...i->...", q, q))[..., np.newaxis]
    return unit
