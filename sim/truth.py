"""What the Earth does to a sensor on a tilted table: the oracle that the estimators are held to.

Built from the table's axes as vectors in East-North-Up, with constants of its own, and shares no
code with the estimators: a sign error there cannot cancel itself here.
"""

from dataclasses import dataclass

import numpy as np

from drivers.interfaces import FloatArray

EARTH_RATE_RAD_S = 7.292115e-5  # WGS 84
_STANDARD_GRAVITY_M_S2 = 9.80665


@dataclass(frozen=True, slots=True)
class Truth:
    """Where the table stands and how; angles in rad.

    Attributes:
        latitude_rad: Geodetic, positive north.
        azimuth_rad: Of the index mark (the table's y axis at angle zero), clockwise from north.
        pitch_rad: Elevation of the index mark.
        roll_rad: Rotation about the index mark, right side down.
        height_m: Above the ellipsoid.
        gravity_m_s2: Local gravity; by the formula of 1980 where not given.
    """

    latitude_rad: float
    azimuth_rad: float
    pitch_rad: float
    roll_rad: float
    height_m: float = 0.0
    gravity_m_s2: float | None = None

    def table_axes_n(self) -> FloatArray:
        """Return the axes x, y, z of the table at angle zero as rows, in East-North-Up."""
        sin_phi, cos_phi = np.sin(self.azimuth_rad), np.cos(self.azimuth_rad)
        level_mark = np.array([sin_phi, cos_phi, 0.0])
        right = np.array([cos_phi, -sin_phi, 0.0])
        up = np.array([0.0, 0.0, 1.0])
        y = np.cos(self.pitch_rad) * level_mark + np.sin(self.pitch_rad) * up
        over = np.cross(right, y)
        x = np.cos(self.roll_rad) * right - np.sin(self.roll_rad) * over
        return np.stack([x, y, np.cross(x, y)])

    def earth_rate_t(self) -> FloatArray:
        """Return the Earth's rate along the table's axes at angle zero, rad/s, shape ``(3,)``."""
        north_up = [0.0, np.cos(self.latitude_rad), np.sin(self.latitude_rad)]
        rate: FloatArray = self.table_axes_n() @ (EARTH_RATE_RAD_S * np.array(north_up))
        return rate

    def specific_force_t(self) -> FloatArray:
        """Return the reaction to gravity along the same axes, standard gravities, ``(3,)``."""
        force: FloatArray = self.table_axes_n()[:, 2] * (self.gravity() / _STANDARD_GRAVITY_M_S2)
        return force

    def gravity(self) -> float:
        """Return local gravity in m/s^2: the given one, or the 1980 series with free air."""
        if self.gravity_m_s2 is not None:
            return self.gravity_m_s2
        sin2 = np.sin(self.latitude_rad) ** 2
        sin2_double = np.sin(2 * self.latitude_rad) ** 2
        series = 9.780327 * (1 + 0.0053024 * sin2 - 0.0000058 * sin2_double)
        return float(series - 3.086e-6 * self.height_m)
