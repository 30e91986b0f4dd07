"""The azimuth solvers of `levelling` and two of ours, as plain algebra of their inputs.

Each takes (a, b, p, q, L): the gyro's coefficients in rad/s, the sines of the elevations of y_t
and -x_t, ``p = a_A/g`` and ``q = b_A/g``, and the latitude. It returns the numerator and the
denominator of ``tan(phi)``; their signs tell the quadrant. Written without inverse functions,
so that a complex step through them gives exact derivatives.
"""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from northfinder.earth import EARTH_RATE_RAD_S

Method = Literal[
    "coordinate_transform",
    "vector",
    "vector_published",
    "vector_uncorrected",
    "two_vector",
    "uncompensated",
]
Number = NDArray[np.inexact[Any]]
Solver = Callable[[Number, Number, Number, Number, Number], tuple[Number, Number]]


def coordinate_transform(
    a: Number, b: Number, p: Number, q: Number, latitude: Number
) -> tuple[Number, Number]:
    """Eq 3, exact."""
    up = EARTH_RATE_RAD_S * np.sin(latitude)
    sin_pitch, cos_pitch = p, np.sqrt(1.0 - p * p)
    sin_roll = q / cos_pitch
    cos_roll = np.sqrt(1.0 - sin_roll * sin_roll)
    numerator = b * cos_pitch + a * sin_roll * sin_pitch - up * sin_roll
    return numerator, (a - up * sin_pitch) * cos_roll


def vector(a: Number, b: Number, p: Number, q: Number, latitude: Number) -> tuple[Number, Number]:
    """Eq 10 made exact: the horizontal projections of two tilted axes are not perpendicular.

    D is the angle between them; ours, not the paper's.
    """
    along_b, along_a = vector_published(a, b, p, q, latitude)
    cos_d = -p * q / np.sqrt((1.0 - p * p) * (1.0 - q * q))
    return (along_b - along_a * cos_d) / np.sqrt(1.0 - cos_d * cos_d), along_a


def vector_published(
    a: Number, b: Number, p: Number, q: Number, latitude: Number
) -> tuple[Number, Number]:
    """Eq 10 as printed, with its s_a = p and s_b = q: exact only for a tilt along one axis."""
    numerator, denominator = vector_uncorrected(a, b, p, q, latitude)
    return numerator / np.sqrt(1.0 - q * q), denominator / np.sqrt(1.0 - p * p)


def vector_uncorrected(
    a: Number, b: Number, p: Number, q: Number, latitude: Number
) -> tuple[Number, Number]:
    """Eq 11, which the paper shows to be wrong: the angle within the tilted plane."""
    up = EARTH_RATE_RAD_S * np.sin(latitude)
    return b - up * q, a - up * p


def uncompensated(
    a: Number, b: Number, _p: Number, _q: Number, _latitude: Number
) -> tuple[Number, Number]:
    """Eq 8: as if the table were level."""
    return b, a


def north_vector_t(
    a: Number, b: Number, p: Number, q: Number, latitude: Number
) -> tuple[Number, Number, Number]:
    """Horizontal Earth rate in t, rad/s, from the up vector and the two measured rates.

    The third rate, along the table's axis, follows from the vertical rate that the latitude
    gives; ``|n|`` therefore tests the scale factor and the latitude.
    """
    vertical = EARTH_RATE_RAD_S * np.sin(latitude)
    u_x, u_y = -q, p
    u_z = np.sqrt(1.0 - p * p - q * q)
    omega_z = (vertical + b * u_x - a * u_y) / u_z
    return -b - vertical * u_x, a - vertical * u_y, omega_z - vertical * u_z


def two_vector(
    a: Number, b: Number, p: Number, q: Number, latitude: Number
) -> tuple[Number, Number]:
    """East = north x up, an exact route that shares no formula with the paper's."""
    n_x, n_y, n_z = north_vector_t(a, b, p, q, latitude)
    east_y = -n_z * q - n_x * np.sqrt(1.0 - p * p - q * q)
    return east_y, n_y


SOLVERS: dict[Method, Solver] = {
    "coordinate_transform": coordinate_transform,
    "vector": vector,
    "vector_published": vector_published,
    "vector_uncorrected": vector_uncorrected,
    "two_vector": two_vector,
    "uncompensated": uncompensated,
}
