"""Attitude against the stars and velocity increments in the same frame, from a stream.

ib0 is the body frame at the beginning of the stream, kept still among the stars.
"""

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.pairs import FloatArray
from northfinder.attitude import integrate
from northfinder.attitude.arrays import as_samples
from northfinder.attitude.quaternion import conjugate, multiply, normalise, rotate

_METHOD = "trailing-3"
_BEHIND = 3  # increments that it looks back at
_BEHIND_AND_AHEAD = 2 * _BEHIND  # the first three look as far ahead


class InertialIncrements:
    """Turns increments in b into velocity increments in ib0, however they are cut into chunks.

    The attitude is integrated by a method that corrects each increment by the three before it;
    the very first ones wait until it can look ahead instead. The velocity increment is
    ``C (dv + 1/2 dth x dv + (dth_- x dv + dv_- x dth) / 12)``: rotation and sculling, without
    which 5 deg of rocking costs minutes of heading.
    """

    def __init__(self) -> None:
        self.attitude = np.array([1.0, 0.0, 0.0, 0.0])
        self._first = True
        self._angle, self._velocity = np.empty((0, 3)), np.empty((0, 3))

    def add(self, angle_rad: ArrayLike, velocity: ArrayLike) -> FloatArray:
        """Return the velocity increments in ib0 that are ready, ``(m, 3)``.

        Args:
            angle_rad: Integrals of the body's rate over successive periods, ``(k, 3)``.
            velocity: Integrals of the specific force over the same, any unit, ``(k, 3)``.

        Raises:
            ValueError: Shapes that do not fit, or a number that is not finite.
        """
        angle, gained = as_samples(angle_rad), as_samples(velocity)
        if angle.shape != gained.shape:
            msg = f"one velocity for each angle increment; got {gained.shape} for {angle.shape}"
            raise ValueError(msg)
        self._angle = np.vstack([self._angle, angle])
        self._velocity = np.vstack([self._velocity, gained])
        if len(self._angle) <= (_BEHIND_AND_AHEAD if self._first else _BEHIND):
            return np.empty((0, 3))
        turned = self._turned()
        increments = self._in_ib0(turned)
        self.attitude, self._first = turned[-1], False
        self._angle, self._velocity = self._angle[-_BEHIND:], self._velocity[-_BEHIND:]
        return increments

    def _turned(self) -> FloatArray:
        """Attitudes ``(m + 1, 4)`` at the beginning and end of each increment that is new."""
        attitude = integrate(self._angle, 1.0, _METHOD, kind="increments")
        if self._first:
            return np.vstack([self.attitude, attitude])
        # The three old increments are turned through without what lies behind them; undo that.
        since = multiply(conjugate(attitude[_BEHIND - 1]), attitude[_BEHIND - 1 :])
        return normalise(multiply(self.attitude, since))

    def _in_ib0(self, turned: FloatArray) -> FloatArray:
        """Velocity increments in ib0, one for each but the last of the attitudes."""
        begin = len(self._angle) - len(turned) + 1
        angle, gained = self._angle[begin:], self._velocity[begin:]
        before = np.roll(self._angle, 1, axis=0)[begin:], np.roll(self._velocity, 1, axis=0)[begin:]
        sculling = (np.cross(before[0], gained) + np.cross(before[1], angle)) / 12.0
        if self._first:  # nothing before it: the same parabola, by the increment after it
            ahead = np.cross(angle[0], gained[1]) + np.cross(gained[0], angle[1])
            sculling[0] = ahead / 12.0
        return rotate(turned[:-1], gained + 0.5 * np.cross(angle, gained) + sculling)
