"""Gravity as an inertial frame sees it, and the angle between a quaternion and scipy's rotation."""

import numpy as np
from scipy.spatial.transform import Rotation

from tests.alignment.bases import EARTH_RATE_RAD_S, LATITUDE_RAD, Array


def gravity_fan(
    duration_s: float, count: int, latitude_rad: float = LATITUDE_RAD
) -> tuple[Array, Array]:
    """Times, and the vertical turned by scipy about the Earth's axis, ``(count, 3)``."""
    time_s: Array = duration_s * np.arange(1.0, count + 1.0) / count
    axis = np.array([0.0, np.cos(latitude_rad), np.sin(latitude_rad)])
    turned = Rotation.from_rotvec(EARTH_RATE_RAD_S * time_s[:, np.newaxis] * axis)
    fan: Array = turned.apply([0.0, 0.0, 1.0])
    return time_s, fan


def apart_rad(q: Array, truth: Rotation) -> float:
    """Angle of the rotation from one to the other, rad."""
    return float((truth.inv() * Rotation.from_quat(q, scalar_first=True)).magnitude())
