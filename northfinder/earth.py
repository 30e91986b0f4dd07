"""The Earth's rate, figure and normal gravity, WGS 84.

Constants from NIMA TR8350.2, third edition; gravity is its
Somigliana formula (4-1) with the height expansion (4-3).
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

EARTH_RATE_RAD_S: Final = 7.292115e-5

_SEMI_MAJOR_AXIS_M = 6378137.0
_FLATTENING = 1.0 / 298.257223563
_ECCENTRICITY_SQUARED = _FLATTENING * (2.0 - _FLATTENING)
_EQUATORIAL_GRAVITY_M_S2 = 9.7803253359
_SOMIGLIANA = 0.00193185265241
_CENTRIFUGAL_RATIO = 0.00344978650684  # m = omega^2 a^2 b / GM

Vector3 = NDArray[np.float64]


def earth_rate_n(latitude_rad: float) -> Vector3:
    """Earth rate in East-North-Up, ``Omega_e * [0, cos L, sin L]``.

    Args:
        latitude_rad: Geodetic latitude, positive north.

    Returns:
        Rate of the Earth relative to inertial space, rad/s, shape ``(3,)``.
    """
    return EARTH_RATE_RAD_S * np.array([0.0, math.cos(latitude_rad), math.sin(latitude_rad)])


def curvature_radii_m(latitude_rad: float) -> tuple[float, float]:
    """Radii of curvature of the ellipsoid, in the meridian and in the prime vertical, m."""
    x = 1.0 - _ECCENTRICITY_SQUARED * math.sin(latitude_rad) ** 2
    normal = _SEMI_MAJOR_AXIS_M / math.sqrt(x)
    return normal * (1.0 - _ECCENTRICITY_SQUARED) / x, normal


def normal_gravity_m_s2(latitude_rad: float, height_m: float = 0.0) -> float:
    """Normal gravity at a height above the ellipsoid, Somigliana (TR8350.2, 4-1 and 4-3).

    Local anomalies reach 1e-4 of it; a measured value is better where one is known.

    Args:
        latitude_rad: Geodetic latitude, positive north.
        height_m: Height above the ellipsoid, below about 20 km.

    Returns:
        Magnitude of normal gravity, m/s^2.
    """
    sin2 = math.sin(latitude_rad) ** 2
    at_ellipsoid_m_s2 = (
        _EQUATORIAL_GRAVITY_M_S2
        * (1.0 + _SOMIGLIANA * sin2)
        / math.sqrt(1.0 - _ECCENTRICITY_SQUARED * sin2)
    )
    h = height_m / _SEMI_MAJOR_AXIS_M
    slope = 2.0 * (1.0 + _FLATTENING + _CENTRIFUGAL_RATIO - 2.0 * _FLATTENING * sin2)
    return at_ellipsoid_m_s2 * (1.0 - slope * h + 3.0 * h * h)
