"""The coning motion, and how far a method drifts under it.

Source: `coning-rate-vector`, eqs 1-3: the body turns by the half cone p about an axis that runs
round in its own y-z plane with the cone's rate O. No harsher motion is common, and its attitude,
rate and increments are known in closed form.
"""

from dataclasses import dataclass
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from northfinder.attitude.arrays import FloatArray, as_period, check_name
from northfinder.attitude.extraction import Extraction
from northfinder.attitude.integrate import integrate
from northfinder.attitude.methods import METHODS, update_periods
from northfinder.attitude.quaternion import conjugate, multiply, rotate
from northfinder.attitude.rotation_vectors import Kind

_UPDATES_BEFORE = 4  # the longest that a method looks back


class MethodOptions(TypedDict, total=False):
    """The options of ``integrate`` that belong to some methods."""

    extraction: Extraction
    alpha: float
    beta: float
    n: int


@dataclass(frozen=True, slots=True)
class ConingMotion:
    """A body axis x that runs round a cone.

    Attributes:
        half_cone_rad: p, the angle between the cone's axis and x.
        cone_rate_rad_s: O, 2 pi times the cone's frequency.
    """

    half_cone_rad: float
    cone_rate_rad_s: float

    def attitude(self, time_s: ArrayLike) -> FloatArray:
        """``[cos(p/2), 0, sin(p/2) cos(Ot), sin(p/2) sin(Ot)]`` (eq 3), ``(..., 4)``."""
        phase = self.cone_rate_rad_s * np.asarray(time_s, dtype=np.float64)
        scalar = np.full_like(phase, np.cos(0.5 * self.half_cone_rad))
        across = np.sin(0.5 * self.half_cone_rad)
        parts = [scalar, np.zeros_like(phase), across * np.cos(phase), across * np.sin(phase)]
        return np.stack(parts, axis=-1)

    def rate(self, time_s: ArrayLike) -> FloatArray:
        """``[-2 O sin^2(p/2), -O sin p sin(Ot), O sin p cos(Ot)]`` (eq 2), rad/s, ``(..., 3)``."""
        phase = self.cone_rate_rad_s * np.asarray(time_s, dtype=np.float64)
        along = np.full_like(phase, -2.0 * np.sin(0.5 * self.half_cone_rad) ** 2)
        across = np.sin(self.half_cone_rad)
        parts = [along, -across * np.sin(phase), across * np.cos(phase)]
        return self.cone_rate_rad_s * np.stack(parts, axis=-1)

    def increments(self, edges_s: ArrayLike) -> FloatArray:
        """Integrals of the rate between successive edges, rad, ``(k, 3)`` of ``(k + 1,)``."""
        edges = np.asarray(edges_s, dtype=np.float64)
        span = self.cone_rate_rad_s * np.diff(edges)
        middle = 0.5 * self.cone_rate_rad_s * (edges[1:] + edges[:-1])
        along = -2.0 * np.sin(0.5 * self.half_cone_rad) ** 2 * span
        across = 2.0 * np.sin(self.half_cone_rad) * np.sin(0.5 * span)
        return np.stack([along, -across * np.sin(middle), across * np.cos(middle)], axis=-1)

    def in_body(self, vector: ArrayLike, time_s: ArrayLike) -> FloatArray:
        """Body coordinates ``(..., 3)`` of a vector ``(3,)`` that the reference holds still."""
        return rotate(conjugate(self.attitude(time_s)), vector)

    def body_integrals(self, vector: ArrayLike, edges_s: ArrayLike) -> FloatArray:
        """Integrals of ``in_body`` between successive edges, ``(k, 3)`` of ``(k + 1,)``.

        With u the unit axis (0, cos Ot, sin Ot) of the turn by p, a vector v is
        ``v cos p - u x v sin p + u (u . v)(1 - cos p)`` in the body.
        """
        edges = np.asarray(edges_s, dtype=np.float64)
        x, y, z = np.asarray(vector, dtype=np.float64)
        span, middle = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
        phase, half = self.cone_rate_rad_s * middle, 0.5 * self.cone_rate_rad_s * span
        once, twice = span * np.sinc(half / np.pi), 0.5 * span * np.sinc(2.0 * half / np.pi)
        cos, sin = once * np.cos(phase), once * np.sin(phase)
        cos2, sin2 = twice * np.cos(2.0 * phase), twice * np.sin(2.0 * phase)
        across = np.stack([z * cos - y * sin, x * sin, -x * cos], axis=-1)
        along_y = y * (0.5 * span + cos2) + z * sin2
        along_z = y * sin2 + z * (0.5 * span - cos2)
        along = np.stack([np.zeros_like(span), along_y, along_z], axis=-1)
        still = span[:, np.newaxis] * np.array([x, y, z])
        p = self.half_cone_rad
        integrals: FloatArray = np.cos(p) * still - np.sin(p) * across + (1 - np.cos(p)) * along
        return integrals


def coning_drift_rad_s(
    motion: ConingMotion,
    dt: float,
    method: str,
    kind: Kind = "rates",
    **options: Unpack[MethodOptions],
) -> float:
    """Mean rate by which the method's attitude turns about the cone's axis, exact, signed.

    Under coning every step is the first one, turned about the cone's axis by the phase: with
    ``P`` the step of one update of h seconds and ``r`` the turn by ``O h`` about x, ``P (x) r``
    turns by ``O h`` plus the drift. So one update tells what an hour would.

    Args:
        motion: The cone.
        dt: Sampling period, s.
        method: As for ``integrate``.
        kind: Of samples: the motion's exact rates or increments.
        **options: As for ``integrate``.

    Raises:
        ValueError: The cone runs round in less than an update, or as ``integrate`` raises.
    """
    check_name("method", method, METHODS)
    periods = update_periods(method, options.get("n"))
    step_s = periods * as_period(dt)
    turn = motion.cone_rate_rad_s * step_s
    if not 0.0 < turn < 2.0 * np.pi:
        msg = f"the cone turns by {turn:.3g} rad in an update; sample it more often, or forwards"
        raise ValueError(msg)
    samples = _samples(motion, dt, kind, periods * (_UPDATES_BEFORE + 1))
    attitude = integrate(samples, dt, method, kind=kind, **options)
    whole = multiply(multiply(conjugate(attitude[-2]), attitude[-1]), _about_x(turn))
    angle = 2.0 * np.arctan2(np.sqrt(whole[1:] @ whole[1:]), whole[0])
    return float((angle - turn) / step_s)


def _samples(motion: ConingMotion, dt: float, kind: Kind, periods: int) -> FloatArray:
    edges_s = dt * np.arange(periods + 1)
    return motion.rate(edges_s) if kind == "rates" else motion.increments(edges_s)


def _about_x(angle_rad: float) -> FloatArray:
    return np.array([np.cos(0.5 * angle_rad), np.sin(0.5 * angle_rad), 0.0, 0.0])
