"""True attitudes by the thousand, and what the Earth does to each: matrices, not the solvers.

Built from the table's axes as vectors in East-North-Up, as the simulator's truth is, and sharing
no formula with the estimators: a sign error there cannot cancel itself here.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from northfinder.campaign.settings import Campaign
from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.estimators.arrays import FloatArray
from northfinder.units import DEG


@dataclass(frozen=True, slots=True, eq=False)
class Attitudes:
    """How the table stands in each of k seeks, rad, ``(k,)`` each.

    Attributes:
        azimuth_rad: Of the index mark, clockwise from north, [0, 2 pi).
        pitch_rad: Its elevation.
        roll_rad: Rotation about it, right side down.
    """

    azimuth_rad: FloatArray
    pitch_rad: FloatArray
    roll_rad: FloatArray

    def axes_n(self) -> tuple[FloatArray, FloatArray]:
        """Return the table's x and y axes at angle zero in East-North-Up, ``(3, k)`` each."""
        sin_azimuth, cos_azimuth = np.sin(self.azimuth_rad), np.cos(self.azimuth_rad)
        level = np.zeros_like(sin_azimuth)
        right = np.stack([cos_azimuth, -sin_azimuth, level])
        mark = np.cos(self.pitch_rad) * np.stack([sin_azimuth, cos_azimuth, level])
        mark[2] = np.sin(self.pitch_rad)
        over = _cross(right, mark)
        return np.cos(self.roll_rad) * right - np.sin(self.roll_rad) * over, mark

    def earth_rate(self, latitude_rad: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Return the Earth's rate along x and y, rad/s, ``(k,)`` each."""
        north = EARTH_RATE_RAD_S * np.cos(latitude_rad)
        up = EARTH_RATE_RAD_S * np.sin(latitude_rad)
        x, y = self.axes_n()
        return north * x[1] + up * x[2], north * y[1] + up * y[2]

    def specific_force(self, gravity_g: float) -> tuple[FloatArray, FloatArray]:
        """Return the reaction to gravity along x and y, standard gravities, ``(k,)`` each."""
        x, y = self.axes_n()
        return gravity_g * x[2], gravity_g * y[2]


def draw_attitudes(campaign: Campaign, random: Generator, count: int) -> Attitudes:
    """Draw azimuth and tilt of ``count`` seeks; what is fixed takes no random number."""
    if campaign.azimuth_deg == "uniform":
        azimuth_rad = random.uniform(0.0, 2.0 * np.pi, count)
    else:
        azimuth_rad = np.full(count, campaign.azimuth_deg % 360.0 * DEG)
    if campaign.tilt_deg is None:
        simulated = campaign.rig.simulation
        pitch_rad = np.full(count, simulated.pitch_deg * DEG)
        return Attitudes(azimuth_rad, pitch_rad, np.full(count, simulated.roll_deg * DEG))
    tilt_rad = random.uniform(0.0, campaign.tilt_deg * DEG, count)
    towards_rad = random.uniform(0.0, 2.0 * np.pi, count)
    pitch_rad = np.arcsin(np.sin(tilt_rad) * np.cos(towards_rad))
    roll_rad = np.arcsin(np.sin(tilt_rad) * np.sin(towards_rad) / np.cos(pitch_rad))
    return Attitudes(azimuth_rad, pitch_rad, roll_rad)


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.stack(
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    )
