"""Attitude from increments that keep coming: the same as integrating all of them at once."""

from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from northfinder.attitude.arrays import FloatArray, as_samples, as_unit_quaternion, check_name
from northfinder.attitude.integrate import integrate
from northfinder.attitude.quaternion import conjugate, multiply, normalise
from northfinder.attitude.rotation_vectors import SCHEMES

#: The methods that feed on increments, which a gyro that integrates delivers.
IncrementMethod = Literal[
    "one-sample",
    "two-sample",
    "three-sample-taylor",
    "three-sample",
    "four-sample-taylor",
    "four-sample",
    "trailing-1",
    "trailing-2",
    "trailing-3",
    "trailing-4",
]
INCREMENT_METHODS: Final[tuple[IncrementMethod, ...]] = get_args(IncrementMethod)


class AttitudeStream:
    """Holds an attitude that increments turn.

    Args:
        method: How they are integrated.
        q0: Where it begins, scalar first, body to reference.

    Attributes:
        attitude: After the last whole update, ``(4,)``.

    Raises:
        ValueError: An unknown method, or a q0 that is no unit quaternion.
    """

    def __init__(self, method: IncrementMethod, q0: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> None:
        check_name("method", method, INCREMENT_METHODS)
        self.attitude = as_unit_quaternion(q0)
        self._method = method
        self._stride = SCHEMES[method].stride
        self._behind = SCHEMES[method].window - 1 if method.startswith("trailing") else 0
        self._old = 0  # of the increments kept, those that have turned it already
        self._kept = np.empty((0, 3))

    def add(self, angle_rad: ArrayLike) -> FloatArray:
        """Turn it by increments over successive periods, however they are cut into chunks.

        Those that fill no update yet, or have too few before them, wait.

        Args:
            angle_rad: Integrals of the body's rate, rad, ``(k, 3)``.

        Returns:
            The attitude after each update that was made, ``(m, 4)``; the last is the one held.

        Raises:
            ValueError: Another shape, or a number that is not finite.
        """
        self._kept = np.vstack([self._kept, as_samples(angle_rad)])
        updates = len(self._kept) // self._stride
        if updates <= max(self._old, 2 * (self._behind - self._old)):
            return np.empty((0, 4))
        used = updates * self._stride
        turned = integrate(self._kept[:used], 1.0, self._method, kind="increments")
        if self._old:  # they were turned through without what lies behind them; undo that
            turned = multiply(conjugate(turned[self._old - 1]), turned[self._old :])
        attitudes = normalise(multiply(self.attitude, turned))
        self.attitude = attitudes[-1]
        self._old = self._behind
        self._kept = self._kept[used - self._behind :]
        return attitudes
