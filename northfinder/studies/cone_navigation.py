"""An hour of navigation on the cone: attitude, velocity and position errors of a method.

As ``northfinder.attitude.cone_at_rest``, with constant sensor errors and the attitude as well.
"""

from dataclasses import dataclass
from typing import Final, Unpack

import numpy as np
from scipy.spatial.transform import Rotation

from northfinder.attitude import extract_increments, integrate
from northfinder.attitude.arrays import FloatArray
from northfinder.attitude.cone_at_rest import LATITUDE_RAD
from northfinder.attitude.coning import MethodOptions
from northfinder.attitude.rotation_vectors import Kind
from northfinder.attitude.strapdown import Track, navigate, velocity_increments
from northfinder.earth import EARTH_RATE_RAD_S, earth_rate_n, normal_gravity_m_s2
from northfinder.studies.cone import CONE, UPDATE_S
from northfinder.units import DEG_PER_HOUR, STANDARD_GRAVITY_M_S2

_DT_S: Final = UPDATE_S / 2
_HOUR_S: Final = 3600.0


@dataclass(frozen=True, slots=True)
class Biases:
    """Constant errors, the same on every axis."""

    gyro_rad_s: float = 0.0
    accelerometer_m_s2: float = 0.0


#: `coning-rate-vector`, section 4.
PAPERS: Final = Biases(0.01 * DEG_PER_HOUR, 100e-6 * STANDARD_GRAVITY_M_S2)


@dataclass(frozen=True, slots=True, eq=False)
class Hour:
    """What went wrong, at every step of the track.

    Attributes:
        track: Where the navigator believes it is; all distance is error.
        tilt_rad: Errors of pitch, roll and heading: turns about east, north and, clockwise, up;
            ``(k, 3)``.
    """

    track: Track
    tilt_rad: FloatArray

    @property
    def position_m(self) -> float:
        """Largest error of position."""
        return float(self.track.from_start_m.max())


def navigate_an_hour(
    method: str,
    kind: Kind = "rates",
    biases: Biases = Biases(),
    duration_s: float = _HOUR_S,
    **options: Unpack[MethodOptions],
) -> Hour:
    """Navigate at rest at 30 deg of latitude, the cone's axis to the east.

    Args:
        method: As for ``integrate``, of those whose update lasts two samples.
        kind: What the gyros give.
        biases: Of the sensors.
        duration_s: How long.
        **options: As for ``integrate``.
    """
    edges_s = _DT_S * np.arange(2.0 * round(duration_s / UPDATE_S) + 1.0)
    gyro, angle = _gyro(edges_s, kind, biases.gyro_rad_s)
    start = CONE.attitude(0.0)
    attitude = np.vstack([start, integrate(gyro, _DT_S, method, start, kind, **options)])
    gravity_n = np.array([0.0, 0.0, normal_gravity_m_s2(LATITUDE_RAD)])
    force = CONE.body_integrals(gravity_n, edges_s) + _DT_S * biases.accelerometer_m_s2
    track = navigate(attitude, velocity_increments(angle, force), UPDATE_S, LATITUDE_RAD)
    each = (len(attitude) - 1) // (len(track.time_s) - 1)
    return Hour(track, _tilt_rad(track, attitude[::each]))


def _gyro(edges_s: FloatArray, kind: Kind, bias_rad_s: float) -> tuple[FloatArray, FloatArray]:
    """Return what the gyros give, and increments for the velocity's part."""
    earth_n = earth_rate_n(LATITUDE_RAD)
    if kind == "rates":
        rates = CONE.rate(edges_s) + CONE.in_body(earth_n, edges_s) + bias_rad_s
        return rates, extract_increments(rates, _DT_S, "quadratic", 2)
    angles = CONE.increments(edges_s) + CONE.body_integrals(earth_n, edges_s) + _DT_S * bias_rad_s
    return angles, angles


def _tilt_rad(track: Track, attitude: FloatArray) -> FloatArray:
    """Compare the navigator's attitude, in its own n, with the true one in the true n."""
    turned = track.longitude_rad + EARTH_RATE_RAD_S * track.time_s
    from_start = _axes(track.latitude_rad, turned).inv() * _axes(
        np.array([LATITUDE_RAD]), np.zeros(1)
    )
    believed = from_start * Rotation.from_quat(attitude, scalar_first=True)
    true = Rotation.from_quat(CONE.attitude(track.time_s), scalar_first=True)
    east, north, up = (believed * true.inv()).as_rotvec().T
    return np.stack([east, north, -up], axis=-1)


def _axes(latitude_rad: FloatArray, longitude_rad: FloatArray) -> Rotation:
    """Return the rotations from East-North-Up to axes that the Earth's axis is the third of."""
    angles = np.stack([longitude_rad + np.pi / 2, np.pi / 2 - latitude_rad], axis=-1)
    return Rotation.from_euler("ZX", angles)
