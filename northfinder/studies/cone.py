"""The cone of `coning-rate-vector`, half cone 1 deg at 8 Hz, and what methods make of it."""

from typing import Final, Unpack

import numpy as np

from northfinder.attitude import ConingMotion, coning_drift_rad_s, integrate
from northfinder.attitude.arrays import FloatArray
from northfinder.attitude.coning import MethodOptions
from northfinder.attitude.extraction import polynomial_weights
from northfinder.attitude.quaternion import (
    conjugate,
    from_rotation_vector,
    multiply,
    to_rotation_vector,
)
from northfinder.attitude.rotation_vectors import SCHEMES, Kind, rotation_vectors
from northfinder.units import DEG, DEG_PER_HOUR

CONE: Final = ConingMotion(1.0 * DEG, 16.0 * np.pi)
UPDATE_S: Final = 0.010
CONDITIONS: Final = "half cone 1 deg at 8 Hz, update 10 ms, no sensor errors"


def drift_deg_h(
    method: str,
    samples: int = 2,
    kind: Kind = "rates",
    motion: ConingMotion = CONE,
    **options: Unpack[MethodOptions],
) -> float:
    """Return how fast the attitude drifts, with so many samples to 10 ms."""
    drift = coning_drift_rad_s(motion, UPDATE_S / samples, method, kind, **options)
    return drift / DEG_PER_HOUR


def step_drift_deg_h(phi: FloatArray) -> float:
    """Return the drift of a method whose first update turns by ``phi``, rad, ``(3,)``.

    As ``coning_drift_rad_s``: every update is the first one, turned about the cone's axis.
    """
    turn = CONE.cone_rate_rad_s * UPDATE_S
    about_x = from_rotation_vector(np.array([turn, 0.0, 0.0]))
    whole = multiply(from_rotation_vector(phi), about_x)
    angle = 2.0 * np.arctan2(np.sqrt(whole[1:] @ whole[1:]), whole[0])
    return float((angle - turn) / UPDATE_S / DEG_PER_HOUR)


def three_rates() -> FloatArray:
    """Return the rates at 0, h/2 and h, rad/s, ``(3, 3)``."""
    return CONE.rate(UPDATE_S * np.arange(3) / 2)


def parabola_drift_deg_h() -> float:
    """Return the drift of the three-sample form fed by the parabola through three rates."""
    thirds = UPDATE_S * np.arange(4) / 3
    d = polynomial_weights([0.0, UPDATE_S / 2, UPDATE_S], thirds) @ three_rates()
    phi = rotation_vectors(SCHEMES["three-sample"], [row[:, np.newaxis] for row in d])
    return step_drift_deg_h(phi[:, 0])


def errors_rad(
    method: str, samples: int, kind: Kind, duration_s: float, **options: Unpack[MethodOptions]
) -> tuple[FloatArray, FloatArray]:
    """Return time in s and the angle between attitude and truth, rad, at each update's end."""
    dt = UPDATE_S / samples
    edges_s = dt * np.arange(round(duration_s / dt) + 1.0)
    taken = CONE.rate(edges_s) if kind == "rates" else CONE.increments(edges_s)
    q = integrate(taken, dt, method, CONE.attitude(0.0), kind, **options)
    time_s = UPDATE_S * np.arange(1.0, len(q) + 1.0)
    apart = to_rotation_vector(multiply(conjugate(CONE.attitude(time_s)), q))
    return time_s, np.sqrt(np.sum(apart * apart, axis=-1))
