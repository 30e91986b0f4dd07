"""Rotation matrices as arrays and in components, and the quaternions that turn alike."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.pairs import FloatArray

Component = Any  # float for one matrix, FloatArray for many
Row = Sequence[Component]
Rows = Sequence[Row]


def components(matrices: FloatArray) -> Rows:
    """Return the rows of ``(p, q)``, in floats, or of ``(..., p, q)``, in arrays ``(...)``."""
    if matrices.ndim == 2:
        rows: Rows = matrices.tolist()
        return rows
    p, q = matrices.shape[-2:]
    return [[matrices[..., i, j] for j in range(q)] for i in range(p)]


def stacked(rows: Rows) -> FloatArray:
    """Return the matrices of such rows, ``(p, q)`` or ``(..., p, q)``."""
    return np.moveaxis(np.array(rows, dtype=np.float64), (0, 1), (-2, -1))


def davenport_rows(B: Rows) -> Rows:
    """Return ``K = [[sigma, z'], [z, B + B' - sigma]]`` of ``B = sum a W V'``.

    ``q' K q`` is Wahba's gain ``tr(A(q) B')``, for Hamilton quaternions, scalar first.
    """
    (b11, b12, b13), (b21, b22, b23), (b31, b32, b33) = B
    x, y, z = b32 - b23, b13 - b31, b21 - b12
    xy, xz, yz = b12 + b21, b13 + b31, b23 + b32
    return [
        [b11 + b22 + b33, x, y, z],
        [x, b11 - b22 - b33, xy, xz],
        [y, xy, b22 - b11 - b33, yz],
        [z, xz, yz, b33 - b11 - b22],
    ]


def quaternion_from_matrix(C: ArrayLike) -> FloatArray:
    """Return the unit quaternions ``(..., 4)``, scalar not negative, of rotations ``(..., 3, 3)``.

    ``C v = q (x) [0, v] (x) q*``. Davenport's K of a rotation is ``4 q q' - 1``: any column is
    q's direction, and the one with the largest diagonal is right for every angle, 180 deg too.
    """
    K = stacked(davenport_rows(components(np.asarray(C, dtype=np.float64))))
    q = largest_column(K + np.eye(4))
    length = np.sqrt(np.einsum("...i,...i->...", q, q))
    signed: FloatArray = q / np.where(q[..., 0] < 0.0, -length, length)[..., np.newaxis]
    return signed


def largest_column(matrix: FloatArray) -> FloatArray:
    """Return the column of ``(..., n, n)`` with the largest diagonal, ``(..., n)``."""
    diagonal = np.abs(np.diagonal(matrix, axis1=-2, axis2=-1))
    at = np.argmax(diagonal, axis=-1)[..., np.newaxis, np.newaxis]
    column: FloatArray = np.take_along_axis(matrix, at, axis=-1)[..., 0]
    return column
