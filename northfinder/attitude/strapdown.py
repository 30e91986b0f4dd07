"""Velocity and position of a strapdown navigator: East-North-Up on WGS 84, horizontal channels.

Two speeds: the attitude and the velocity increments come in bulk, against the inertial frame that
is n at the start; gravity, Coriolis, the turning of n and the position follow in steps of about a
second, over which they hardly change.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.attitude.arrays import FloatArray, as_period, as_samples, as_unit_quaternion
from northfinder.attitude.quaternion import from_rotation_vector, multiply, rotate
from northfinder.earth import curvature_radii_m, earth_rate_n

_STEP_S = 1.0  # the Earth turns 7e-5 rad: the middle of the step stands for it within 2e-9 m/s^2


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Where a navigator believes it is, at the end of each step; index 0 is the start.

    Attributes:
        time_s: Since the start, ``(k,)``.
        latitude_rad: Geodetic, positive north, ``(k,)``.
        longitude_rad: From the start, positive east, ``(k,)``.
        velocity_n: East and north, m/s, ``(k, 2)``.
        from_start_m: Horizontal distance from the start, ``(k,)``.
    """

    time_s: FloatArray
    latitude_rad: FloatArray
    longitude_rad: FloatArray
    velocity_n: FloatArray
    from_start_m: FloatArray


def velocity_increments(angle_rad: ArrayLike, force_m_s: ArrayLike) -> FloatArray:
    """Velocity gained in each update of two samples, in body axes at the update's beginning.

    ``v + 1/2 d x v + 2/3 (d1 x v2 + v1 x d2)``: the velocity's rotation and sculling, as eq 5 of
    `coning-rate-vector` has coning.

    Args:
        angle_rad: Angle increments, two an update, ``(2 m, 3)``.
        force_m_s: Integrals of the specific force over the same intervals, m/s, ``(2 m, 3)``.

    Returns:
        ``(m, 3)``, m/s.

    Raises:
        ValueError: A shape does not fit, or a number is not finite.
    """
    angle, force = as_samples(angle_rad), as_samples(force_m_s)
    if angle.shape != force.shape or len(angle) % 2:
        msg = f"angle and force need the same shape (2 m, 3); got {angle.shape}, {force.shape}"
        raise ValueError(msg)
    d1, d2, v1, v2 = angle[0::2], angle[1::2], force[0::2], force[1::2]
    sculling = 2.0 / 3.0 * (np.cross(d1, v2) + np.cross(v1, d2))
    gained: FloatArray = v1 + v2 + 0.5 * np.cross(d1 + d2, v1 + v2) + sculling
    return gained


def navigate(
    attitude: ArrayLike, velocity_b: ArrayLike, update_s: float, latitude_rad: float
) -> Track:
    """Navigate from rest at height 0, the vertical channel held still.

    Args:
        attitude: Body to the frame that is n at the start and then keeps still among the stars:
            at the start and at the end of each update, ``(m + 1, 4)``.
        velocity_b: As ``velocity_increments`` returns it, m/s, ``(m, 3)``.
        update_s: Duration of an update, s.
        latitude_rad: Of the start, positive north.

    Raises:
        ValueError: A shape does not fit, a number is not finite, or there is less than a second.
    """
    gained, q = as_samples(velocity_b), np.asarray(attitude, dtype=np.float64)
    if q.shape != (len(gained) + 1, 4):
        msg = f"{len(gained)} updates need attitudes ({len(gained) + 1}, 4); got {q.shape}"
        raise ValueError(msg)
    as_unit_quaternion(q[0])
    each = max(1, round(_STEP_S / as_period(update_s)))
    steps = len(gained) // each
    if steps == 0:
        msg = f"{len(gained)} updates of {update_s:g} s do not fill one step of {each}"
        raise ValueError(msg)
    gained_i = rotate(q[: steps * each], gained[: steps * each])
    return _tracked(gained_i.reshape(steps, each, 3).sum(axis=1), each * update_s, latitude_rad)


def _tracked(gained_i: FloatArray, step_s: float, start_rad: float) -> Track:
    """Go through the steps; ``gained_i`` is the velocity of each in the frame of the stars."""
    states = np.zeros((len(gained_i) + 1, 4))  # latitude, longitude, east, north
    states[0, 0] = start_rad
    to_n, change = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(2)
    for k, gained in enumerate(gained_i):
        latitude, longitude, *velocity = states[k]
        middle = np.array(velocity) + 0.5 * change  # as if the step before went on
        meridian_m, normal_m = curvature_radii_m(latitude)
        latitude += 0.5 * step_s * middle[1] / meridian_m
        earth, transport = earth_rate_n(latitude), _transport_rate(middle, latitude)
        turn = -step_s * (earth + transport)
        in_n = rotate(multiply(from_rotation_vector(0.5 * turn), to_n), gained)
        coriolis = np.cross(2.0 * earth + transport, [*middle, 0.0])
        change = (in_n - step_s * coriolis)[:2]
        to_n = multiply(from_rotation_vector(turn), to_n)
        moved = step_s * (np.array(velocity) + 0.5 * change)
        states[k + 1, 0] = states[k, 0] + moved[1] / meridian_m
        states[k + 1, 1] = longitude + moved[0] / (normal_m * math.cos(latitude))
        states[k + 1, 2:] = velocity + change
    return _track(states, step_s)


def _transport_rate(velocity: FloatArray, latitude_rad: float) -> FloatArray:
    """Rate at which n turns because it moves over the Earth, in n, rad/s."""
    meridian_m, normal_m = curvature_radii_m(latitude_rad)
    east, north = velocity / np.array([normal_m, meridian_m])
    return np.array([-north, east, east * math.tan(latitude_rad)])


def _track(states: FloatArray, step_s: float) -> Track:
    latitude, longitude = states[:, 0], states[:, 1]
    meridian_m, normal_m = curvature_radii_m(latitude[0])
    north_m = meridian_m * (latitude - latitude[0])
    east_m = normal_m * math.cos(latitude[0]) * longitude
    time_s: FloatArray = step_s * np.arange(len(states), dtype=np.float64)
    return Track(time_s, latitude, longitude, states[:, 2:], np.hypot(east_m, north_m))
