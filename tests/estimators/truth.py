"""What ideal sensors read on the table, from rotation matrices written out here alone."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

OMEGA_RAD_S = 7.292115e-5
DEG = np.pi / 180.0
ARCMIN = DEG / 60.0
DEG_PER_HOUR = DEG / 3600.0
TWENTY_FOUR_RAD: Array = np.arange(24.0) * 15.0 * DEG


class Readings(NamedTuple):
    rate_rad_s: Array
    force_g: Array


def _rotation(axis: int, angle: Array) -> Array:
    """Coordinates turned counter-clockwise by ``angle`` about an axis, by Rodrigues."""
    cross = np.zeros((3, 3))
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    cross[i, j], cross[j, i] = 1.0, -1.0
    angle = angle[..., np.newaxis, np.newaxis]
    rotation: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return rotation


def read(
    azimuth_rad: ArrayLike,
    pitch_rad: ArrayLike,
    roll_rad: ArrayLike,
    latitude_rad: ArrayLike,
    angle_rad: ArrayLike = TWENTY_FOUR_RAD,
) -> Readings:
    """Readings ``(..., n)`` of both sensors, their axes along the turned index mark."""
    azimuth, pitch, roll, latitude = np.broadcast_arrays(
        *(np.asarray(x, dtype=float) for x in (azimuth_rad, pitch_rad, roll_rad, latitude_rad))
    )
    n_to_t = _rotation(1, roll) @ _rotation(0, pitch) @ _rotation(2, -azimuth)
    zero = np.zeros_like(latitude)
    earth_n = OMEGA_RAD_S * np.stack([zero, np.cos(latitude), np.sin(latitude)], axis=-1)
    earth_t = (n_to_t @ earth_n[..., np.newaxis])[..., 0]
    up_t = n_to_t @ np.array([0.0, 0.0, 1.0])
    angle = np.asarray(angle_rad)
    axis_t = np.stack([-np.sin(angle), np.cos(angle), np.zeros_like(angle)], axis=-1)
    rate = np.sum(axis_t * earth_t[..., np.newaxis, :], axis=-1)
    force = np.sum(axis_t * up_t[..., np.newaxis, :], axis=-1)
    return Readings(rate, force)


def angle_between(first_rad: ArrayLike, second_rad: ArrayLike) -> Array:
    """Difference of azimuths within half a turn of zero."""
    difference = np.asarray(first_rad) - np.asarray(second_rad)
    turned: Array = (difference + np.pi) % (2.0 * np.pi) - np.pi
    return turned
