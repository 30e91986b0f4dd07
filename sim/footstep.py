"""A footstep beside the bench: the floor tilts, swings back and rests as it was."""

import math
from dataclasses import dataclass

import numpy as np

from drivers.interfaces import FloatArray

_FREQUENCY_HZ = 6.0  # of a wooden floor, and of a heavy bench on its feet
_DECAY_S = 0.2
_LASTS_S = 2.0  # by then 5e-5 of it is left


@dataclass(frozen=True, slots=True)
class Footstep:
    """A damped swing ``A exp(-t/d) sin(2 pi f t)`` about a horizontal axis.

    Attributes:
        start_s: Loop time of the step.
        tilt_rad: A, at most some hundredths of a degree.
        towards_rad: The table's angle that is raised first, counter-clockwise from the mark.
    """

    start_s: float
    tilt_rad: float
    towards_rad: float = 0.0

    @property
    def end_s(self) -> float:
        """Return the loop time from which it can no longer be told."""
        return self.start_s + _LASTS_S

    def felt(
        self, force_t: FloatArray, time_s: FloatArray, period_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return what it adds to rate (rad/s) and force along the table's axes, ``(3, k)`` each.

        The rate is the mean over the period that ends at each time, so that it integrates to
        nothing. Raising a direction u turns the bench about the horizontal axis ``u x up`` and
        lets u feel that much of gravity: to first order in the tilt.

        Args:
            force_t: The specific force at rest along the same axes, ``(3,)``.
            time_s: Ends of the periods, ``(k,)``.
            period_s: Their length.
        """
        raised = np.array([-math.sin(self.towards_rad), math.cos(self.towards_rad), 0.0])
        axis = np.cross(raised, [0.0, 0.0, 1.0])
        after = self._tilt_rad(time_s)
        rate = np.outer(axis, (after - self._tilt_rad(time_s - period_s)) / period_s)
        return rate, np.outer(np.cross(force_t, axis), after)

    def _tilt_rad(self, time_s: FloatArray) -> FloatArray:
        elapsed_s = np.maximum(time_s - self.start_s, 0.0)
        tilt: FloatArray = (
            self.tilt_rad
            * np.exp(-elapsed_s / _DECAY_S)
            * np.sin(2 * math.pi * _FREQUENCY_HZ * elapsed_s)
        )
        return tilt
