"""The line through the polled positions of a table that turns steadily."""

import asyncio
import math

import numpy as np

from drivers.interfaces import MotionLimits
from northfinder.errors import AcquisitionError
from northfinder.units import DEG

_FEWEST_POLLS = 5
_UNSTEADY_RAD = 0.1 * DEG
_OFF_SPEED = 0.02
_PAST_RAMP = 1.2  # times its length, and as much as the table may start late


class SteadyLine:
    """Angle over time by least squares, from when the ramp is past.

    Args:
        speed_rad_s: At which the table was told to turn.
        limits: For the length of the ramp.
    """

    def __init__(self, speed_rad_s: float, limits: MotionLimits) -> None:
        self._speed_rad_s = speed_rad_s
        self._ramp_rad = _PAST_RAMP * speed_rad_s**2 / (2 * limits.acceleration_rad_s2)
        self._start_rad: float | None = None
        self._origin = (0.0, 0.0)
        self._sums = np.zeros(6)  # of 1, t, x, t t, t x, x x, from the origin
        self._known = asyncio.Event()

    def add(self, time_s: float, angle_rad: float) -> None:
        """Take a position and the loop time at which it was."""
        if self._start_rad is None:
            self._start_rad = angle_rad
        if abs(angle_rad - self._start_rad) <= self._ramp_rad:
            return
        if not self._sums[0]:
            self._origin = time_s, angle_rad
        t, x = time_s - self._origin[0], angle_rad - self._origin[1]
        self._sums += (1.0, t, x, t * t, t * x, x * x)
        if self._sums[0] >= _FEWEST_POLLS:
            self._known.set()

    async def known(self) -> None:
        """Wait until there are positions enough for a line."""
        await self._known.wait()

    def angle_rad(self, time_s: float) -> float:
        """Return the table's angle at a loop time.

        Raises:
            AcquisitionError: It does not turn steadily, or at another speed.
        """
        t, x, slope = self._line()
        return self._origin[1] + x + slope * (time_s - self._origin[0] - t)

    def time_s(self, angle_rad: float) -> float:
        """Return the loop time at which the table has an angle.

        Raises:
            AcquisitionError: It does not turn steadily, or at another speed.
        """
        t, x, slope = self._line()
        return self._origin[0] + t + (angle_rad - self._origin[1] - x) / slope

    def _line(self) -> tuple[float, float, float]:
        """Return the middle of the positions, from the origin, and the speed."""
        n, t, x, tt, tx, xx = self._sums.tolist()
        stt, stx, sxx = tt - t * t / n, tx - t * x / n, xx - x * x / n
        slope = stx / stt
        if abs(abs(slope) - self._speed_rad_s) > _OFF_SPEED * self._speed_rad_s:
            msg = (
                f"the table turns at {abs(slope) / DEG:.4g} deg/s and was told to turn at "
                f"{self._speed_rad_s / DEG:.4g} deg/s: its speed is too coarse, or something "
                f"holds it. Take a shorter dwell, or stop at each angle"
            )
            raise AcquisitionError(msg)
        scatter_rad = math.sqrt(max(sxx - slope * stx, 0.0) / n)
        if scatter_rad > _UNSTEADY_RAD:
            msg = (
                f"the table does not turn steadily: its positions are {scatter_rad / DEG:.2g} deg "
                f"(1 sigma) off a line, limit {_UNSTEADY_RAD / DEG:g} deg. Check its bearing and "
                f"its load, or stop at each angle"
            )
            raise AcquisitionError(msg)
        return t / n, x / n, slope
