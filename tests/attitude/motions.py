"""A motion whose attitude and body rates are known from scipy's rotations and Euler kinematics."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

DEG = np.pi / 180.0
ARCSEC = DEG / 3600.0
DEG_PER_HOUR = DEG / 3600.0


@dataclass(frozen=True)
class Swinging:
    """Yaw (clockwise), pitch and roll, all ``A sin(2 pi f t)``: z, then x, then y."""

    amplitude_rad: float = 40.0 * DEG
    frequency_hz: float = 0.039

    def attitude(self, time_s: Array) -> Rotation:
        angle = self.amplitude_rad * np.sin(2.0 * np.pi * self.frequency_hz * time_s)
        return Rotation.from_euler("ZXY", np.stack([-angle, angle, angle], axis=-1))

    def rate(self, time_s: Array) -> Array:
        omega = 2.0 * np.pi * self.frequency_hz
        angle = self.amplitude_rad * np.sin(omega * time_s)
        speed = (self.amplitude_rad * omega * np.cos(omega * time_s))[:, np.newaxis]
        about_x, about_y = (Rotation.from_euler(axis, angle[:, np.newaxis]) for axis in "xy")
        of_yaw = about_x.inv().apply([0.0, 0.0, -1.0])
        of_pitch, of_roll = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
        rate: Array = speed * (about_y.inv().apply(of_yaw + of_pitch) + of_roll)
        return rate


def rotation(q: Array) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


def angle_between(q: Array, truth: Rotation) -> Array:
    """Angle of the rotation from one to the other, rad."""
    return np.asarray((truth.inv() * rotation(q)).magnitude())
