"""The array type of the estimators, and the refusal of what is not a number."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def as_finite(name: str, values: ArrayLike) -> FloatArray:
    """Return ``values`` as floats.

    Raises:
        ValueError: One of them is NaN or infinite; the message names the first.
    """
    array = np.asarray(values, dtype=np.float64)
    bad = ~np.isfinite(array)
    if bad.any():
        where = tuple(int(i) for i in np.argwhere(bad)[0])
        msg = f"{name} holds {array[where]} at index {where}; leave such readings out of the fit"
        raise ValueError(msg)
    return array


def quadratic_form(vector: FloatArray, matrix: FloatArray) -> FloatArray:
    """Return ``v' M v`` of 2-vectors ``(..., 2)`` and symmetric matrices ``(..., 2, 2)``."""
    x, y = vector[..., 0], vector[..., 1]
    form: FloatArray = (
        x * x * matrix[..., 0, 0] + 2.0 * x * y * matrix[..., 0, 1] + y * y * matrix[..., 1, 1]
    )
    return form
