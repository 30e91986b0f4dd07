"""A navigator at rest on a base that cones about East: what its attitude method costs in metres.

Source: `coning-rate-vector`, section 4, with sensors free of error, at 30 deg of latitude.
"""

from typing import Unpack

import numpy as np

from northfinder.attitude.arrays import FloatArray, as_period, check_name
from northfinder.attitude.coning import ConingMotion, MethodOptions
from northfinder.attitude.extraction import extract_increments
from northfinder.attitude.integrate import integrate
from northfinder.attitude.methods import METHODS, update_periods
from northfinder.attitude.rotation_vectors import Kind
from northfinder.attitude.strapdown import Track, navigate, velocity_increments
from northfinder.earth import earth_rate_n, normal_gravity_m_s2
from northfinder.units import DEG

LATITUDE_RAD = 30.0 * DEG


def navigate_cone_at_rest(  # noqa: PLR0913, PLR0917 (the motion, the method and the place)
    motion: ConingMotion,
    dt: float,
    method: str,
    kind: Kind = "rates",
    duration_s: float = 3600.0,
    latitude_rad: float = LATITUDE_RAD,
    **options: Unpack[MethodOptions],
) -> Track:
    """Navigate from the samples that ideal sensors at rest would give; all distance is error.

    The cone's axis points East. Gyros feel the cone and the Earth; the velocity always comes from
    the accelerometers' exact increments, so that only the attitude method counts.

    Args:
        motion: The cone.
        dt: Sampling period, s; an update lasts two.
        method: As for ``integrate``, of those whose update lasts two sampling periods.
        kind: What the gyros give.
        duration_s: How long, s.
        latitude_rad: Where, positive north.
        **options: As for ``integrate``.

    Raises:
        ValueError: A method whose update does not last two periods, or as ``integrate`` raises.
    """
    check_name("method", method, METHODS)
    if update_periods(method, options.get("n")) != 2:
        msg = f"an update of {method} does not last two sampling periods, as the velocity's does"
        raise ValueError(msg)
    edges_s: FloatArray = as_period(dt) * np.arange(2.0 * round(duration_s / (2.0 * dt)) + 1.0)
    gyro = _gyro(motion, edges_s, kind, latitude_rad)
    start = motion.attitude(0.0)
    attitude = integrate(gyro, dt, method, start, kind, **options)
    angle = gyro if kind == "increments" else extract_increments(gyro, dt, "quadratic", 2)
    gravity_n = np.array([0.0, 0.0, normal_gravity_m_s2(latitude_rad)])
    gained = velocity_increments(angle, motion.body_integrals(gravity_n, edges_s))
    return navigate(np.vstack([start, attitude]), gained, 2.0 * dt, latitude_rad)


def _gyro(motion: ConingMotion, edges_s: FloatArray, kind: Kind, latitude_rad: float) -> FloatArray:
    """What ideal gyros give: the cone's turning and the Earth's, in body axes."""
    earth_n = earth_rate_n(latitude_rad)
    if kind == "rates":
        return motion.rate(edges_s) + motion.in_body(earth_n, edges_s)
    return motion.increments(edges_s) + motion.body_integrals(earth_n, edges_s)
