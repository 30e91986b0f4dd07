"""The motion of `rate-correction`: yaw, pitch and roll swing in step; by scipy's rotations."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from northfinder.attitude.arrays import FloatArray
from northfinder.units import DEG


@dataclass(frozen=True, slots=True)
class Swinging:
    """Yaw (clockwise), pitch and roll, all ``A sin(2 pi f t)``: z, then x, then y (eqs 8 and 13).

    Attributes:
        amplitude_rad: A.
        frequency_hz: f.
    """

    amplitude_rad: float = 40.0 * DEG
    frequency_hz: float = 0.039

    def angle_rad(self, time_s: FloatArray) -> FloatArray:
        """Return what all three angles are, ``(k,)``."""
        angle = self.amplitude_rad * np.sin(2.0 * np.pi * self.frequency_hz * time_s)
        return np.asarray(angle)

    def euler_rad(self, time_s: FloatArray) -> FloatArray:
        """Return the angles as scipy's "ZXY" has them, yaw counter-clockwise, ``(k, 3)``."""
        angle = self.angle_rad(time_s)
        return np.stack([-angle, angle, angle], axis=-1)

    def attitude(self, time_s: FloatArray) -> Rotation:
        """Return the body's axes in the reference."""
        return Rotation.from_euler("ZXY", self.euler_rad(time_s))

    def angle_rate_rad_s(self, time_s: FloatArray) -> FloatArray:
        """Return how fast all three angles grow, ``(k,)``."""
        omega = 2.0 * np.pi * self.frequency_hz
        return np.asarray(self.amplitude_rad * omega * np.cos(omega * time_s))

    def rate(self, time_s: FloatArray) -> FloatArray:
        """Return the body's rate by Euler kinematics, rad/s, ``(k, 3)``."""
        angle = self.angle_rad(time_s)
        speed = self.angle_rate_rad_s(time_s)[:, np.newaxis]
        about_x, about_y = (Rotation.from_euler(axis, angle[:, np.newaxis]) for axis in "xy")
        of_yaw = about_x.inv().apply([0.0, 0.0, -1.0])
        of_pitch, of_roll = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
        rate: FloatArray = speed * (about_y.inv().apply(of_yaw + of_pitch) + of_roll)
        return rate

    def euler_rates(self, time_s: FloatArray) -> FloatArray:
        """Return the angles' own rates in the places of body rates, as eq 10 has it, ``(k, 3)``."""
        speed = self.angle_rate_rad_s(time_s)
        return np.stack([speed, speed, -speed], axis=-1)
