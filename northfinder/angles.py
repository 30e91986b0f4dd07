"""Angles on the circle."""

import numpy as np

from drivers.interfaces import FloatArray


def within_half_turn(angle_rad: FloatArray) -> FloatArray:
    """Return angles, rad, any shape, in [-pi, pi): by how much one direction is off another."""
    return np.asarray((angle_rad + np.pi) % (2.0 * np.pi) - np.pi)
