"""What an alignment found."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.limits import Limits
from northfinder.alignment.pairs import FloatArray
from northfinder.attitude.quaternion import conjugate, rotate

_LEAST_HORIZONTAL = math.sin(math.radians(1.0))
_INTERVAL_95 = 1.959963984540054  # sigma, two-sided, normal


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """The attitude at the end of the stream; b is right-front-up, n East-North-Up.

    Attributes:
        method: By which.
        q_b_n: Unit quaternion ``(4,)``, scalar first: b's coordinates to n's.
        time_s: Of the attitude, since the beginning of the stream, s.
        duration_s: Time in the fit, s.
        limits: Where its uncertainty comes from.
    """

    method: str
    q_b_n: FloatArray
    time_s: float
    duration_s: float
    limits: Limits

    def heading_rad(self, axis_b: ArrayLike = (0.0, 1.0, 0.0)) -> float:
        """Return the azimuth of a body direction, clockwise from north, [0, 2 pi).

        Args:
            axis_b: The direction, any length, ``(3,)``; the front by default.

        Raises:
            ValueError: It is no direction, or within 1 deg of the vertical.
        """
        axis = np.asarray(axis_b, dtype=np.float64)
        if axis.shape != (3,) or not np.isfinite(axis).all() or not axis.any():
            msg = f"axis_b is {axis_b!r}; give three finite numbers, not all zero"
            raise ValueError(msg)
        east, north, up = rotate(self.q_b_n, axis / math.hypot(*axis))
        if math.hypot(east, north) < _LEAST_HORIZONTAL:
            msg = f"axis_b points {math.degrees(math.asin(up)):.3g} deg up: it has no heading"
            raise ValueError(msg)
        heading = math.atan2(east, north) % math.tau
        return 0.0 if heading == math.tau else heading

    @property
    def pitch_rad(self) -> float:
        """Elevation of the front, rad."""
        _, front_up, _ = self._up_b()
        return math.asin(min(1.0, max(-1.0, front_up)))

    @property
    def roll_rad(self) -> float:
        """Turn about the front, right side down positive, rad."""
        right_up, _, up = self._up_b()
        return math.atan2(-right_up, up)

    @property
    def heading_sigma_rad(self) -> float:
        """One standard deviation of the heading, all sources."""
        return self.limits.heading_sigma_rad

    @property
    def level_sigma_rad(self) -> float:
        """One standard deviation of the level about each axis, all sources."""
        return self.limits.level_sigma_rad

    def heading_interval95_rad(self, axis_b: ArrayLike = (0.0, 1.0, 0.0)) -> tuple[float, float]:
        """Return heading -+ 1.96 sigma; the ends are not wrapped.

        Raises:
            ValueError: As ``heading_rad``.
        """
        heading, half = self.heading_rad(axis_b), _INTERVAL_95 * self.heading_sigma_rad
        return heading - half, heading + half

    def _up_b(self) -> tuple[float, float, float]:
        x, y, z = rotate(conjugate(self.q_b_n), [0.0, 0.0, 1.0])
        return float(x), float(y), float(z)
