"""A motion whose attitude and body rates are known from scipy's rotations and Euler kinematics."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from northfinder.studies.swinging import Swinging

__all__ = ["ARCSEC", "DEG", "DEG_PER_HOUR", "Array", "Swinging", "angle_between", "rotation"]

Array = NDArray[np.float64]

DEG = np.pi / 180.0
ARCSEC = DEG / 3600.0
DEG_PER_HOUR = DEG / 3600.0


def rotation(q: Array) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


def angle_between(q: Array, truth: Rotation) -> Array:
    """Angle of the rotation from one to the other, rad."""
    return np.asarray((truth.inv() * rotation(q)).magnitude())
