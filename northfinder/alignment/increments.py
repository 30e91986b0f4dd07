"""Attitude against the stars and velocity increments in the same frame, from a stream.

ib0 is the body frame at the beginning of the stream, kept still among the stars.
"""

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.pairs import FloatArray
from northfinder.attitude.arrays import as_samples
from northfinder.attitude.quaternion import rotate
from northfinder.attitude.streaming import AttitudeStream


class InertialIncrements:
    """Turns increments in b into velocity increments in ib0, however they are cut into chunks.

    The attitude is integrated by a method that corrects each increment by the three before it;
    the very first ones wait until it can look ahead instead. The velocity increment is
    ``C (dv + 1/2 dth x dv + (dth_- x dv + dv_- x dth) / 12)``: rotation and sculling, without
    which 5 deg of rocking costs minutes of heading.
    """

    def __init__(self) -> None:
        self._stream = AttitudeStream("trailing-3")
        self._first = True
        self._angle, self._velocity = np.empty((0, 3)), np.empty((0, 3))

    @property
    def attitude(self) -> FloatArray:
        """Return the attitude at the end of the increments that were ready, b to ib0, ``(4,)``."""
        return self._stream.attitude

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
        began = self._stream.attitude
        ended = self._stream.add(angle)
        if len(ended) == 0:
            return np.empty((0, 3))
        increments = self._in_ib0(np.vstack([began, ended[:-1]]))
        self._first = False
        self._angle, self._velocity = self._angle[-1:], self._velocity[-1:]  # sculling looks back
        return increments

    def _in_ib0(self, turned: FloatArray) -> FloatArray:
        """Velocity increments in ib0, from the attitude at the beginning of each, ``(m, 4)``."""
        begin = len(self._angle) - len(turned)
        angle, gained = self._angle[begin:], self._velocity[begin:]
        before = np.roll(self._angle, 1, axis=0)[begin:], np.roll(self._velocity, 1, axis=0)[begin:]
        sculling = (np.cross(before[0], gained) + np.cross(before[1], angle)) / 12.0
        if self._first:  # nothing before it: the same parabola, by the increment after it
            ahead = np.cross(angle[0], gained[1]) + np.cross(gained[0], angle[1])
            sculling[0] = ahead / 12.0
        return rotate(turned, gained + 0.5 * np.cross(angle, gained) + sculling)
