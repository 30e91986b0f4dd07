"""The array types of attitude integration, and the refusal of what it cannot integrate."""

import math
from collections.abc import Iterable
from difflib import get_close_matches

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_SQUARES_BELOW = 1e40  # far beyond any gyro; its fourth powers are still finite
_UNIT_WITHIN = 1e-6  # float32 keeps a unit quaternion to 1e-7


def as_samples(samples: ArrayLike) -> FloatArray:
    """Return samples ``(k, 3)`` as floats.

    Raises:
        ValueError: The shape is another, or one is NaN, infinite or absurd; the message names it.
    """
    array = np.asarray(samples, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        msg = f"samples need shape (k, 3), one row a sample; they have {array.shape}"
        raise ValueError(msg)
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.einsum("ij,ij->", array, array)  # one pass, faster than looking at each
    if squares < _SQUARES_BELOW:
        return array
    wrong = ~np.isfinite(array)
    wrong = wrong if wrong.any() else np.abs(array) == np.abs(array).max()
    row, column = (int(i) for i in np.argwhere(wrong)[0])
    msg = f"sample {row} holds {array[row, column]:g} on axis {column}; bridge such gaps first"
    raise ValueError(msg)


def as_unit_quaternion(q0: ArrayLike) -> FloatArray:
    """Return the quaternion ``(4,)``, normalised to the last digit.

    Raises:
        ValueError: Its shape is another, or its length is not 1 within 1e-6.
    """
    q = np.asarray(q0, dtype=np.float64)
    if q.shape != (4,):
        msg = f"q0 needs four components, scalar first; it has shape {q.shape}"
        raise ValueError(msg)
    length = float(np.sqrt(q @ q))
    if not abs(length - 1.0) <= _UNIT_WITHIN:
        msg = f"q0 has length {length:g}; an attitude is a unit quaternion, so normalise it first"
        raise ValueError(msg)
    return q / length


def as_period(dt: float) -> float:
    """Return the sampling period.

    Raises:
        ValueError: It is not a positive, finite number of seconds.
    """
    if not (math.isfinite(dt) and dt > 0.0):
        msg = f"dt is {dt:g}; it must be a positive, finite number of seconds"
        raise ValueError(msg)
    return float(dt)


def check_name(what: str, name: str, known: Iterable[str]) -> None:
    """Refuse a name that is not known.

    Raises:
        ValueError: The message holds the nearest known name and the whole list.
    """
    names = list(known)
    if name in names:
        return
    near = get_close_matches(str(name), names, n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}? " if near else ""
    msg = f"unknown {what} {name!r}; {hint}choose one of {', '.join(names)}"
    raise ValueError(msg)
