"""Inclinometers: slopes about two axes, and the specific force that they stand for (CiA 410)."""

import math

import numpy as np

from drivers.codecs.sdo import Entry
from drivers.interfaces import FloatArray

#: The low word of 1000h.
PROFILE = 410

RESOLUTION = Entry(0x6000)
LONGITUDINAL_16, LATERAL_16 = Entry(0x6010), Entry(0x6020)
LONGITUDINAL_32, LATERAL_32 = Entry(0x6110), Entry(0x6120)

#: What 6000h may say, in thousandths of a degree.
RESOLUTIONS = (1, 10, 100, 1000)


def unit_rad(resolution: int) -> float:
    """Return the angle that one count of a slope stands for.

    Raises:
        ValueError: CiA 410 knows no such resolution.
    """
    if resolution not in RESOLUTIONS:
        msg = f"a resolution of {resolution} is none of CiA 410's {RESOLUTIONS}"
        raise ValueError(msg)
    return math.radians(resolution / 1000)


def specific_force(longitudinal_rad: FloatArray, lateral_rad: FloatArray) -> FloatArray:
    """Return the specific force at rest along (longitudinal, lateral, up), in local gravities.

    A slope is the elevation of its axis above the horizon: its sine is what an accelerometer on
    that axis reads. The third axis has what is left of 1, and points up.

    Args:
        longitudinal_rad: Slopes of the longitudinal axis, any shape.
        lateral_rad: Those of the lateral axis, the same shape.

    Returns:
        Shape ``(..., 3)``; NaN along the third axis where two slopes cannot belong together.
    """
    along, across = np.sin(longitudinal_rad), np.sin(lateral_rad)
    with np.errstate(invalid="ignore"):
        up = np.sqrt(1.0 - along**2 - across**2)
    return np.stack([along, across, up], axis=-1)


def slopes(specific_force_g: FloatArray) -> FloatArray:
    """Return the slopes of the first two axes, radians: what an inclinometer makes of a force.

    Args:
        specific_force_g: Shape ``(..., 3)``; only its direction counts.

    Returns:
        Shape ``(..., 2)``.
    """
    norm = np.linalg.norm(specific_force_g, axis=-1, keepdims=True)
    inclined: FloatArray = np.arcsin(specific_force_g[..., :2] / norm)
    return inclined
