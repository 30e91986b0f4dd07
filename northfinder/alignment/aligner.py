"""Attitude and heading on a rocking base, from a stream of increments."""

import math

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.increments import InertialIncrements
from northfinder.alignment.limits import Limits, SensorErrors, check_latitude, find_limits
from northfinder.alignment.methods import method_named
from northfinder.alignment.observations import (
    Observations,
    increments_in_observation,
    reaction_to_gravity,
)
from northfinder.alignment.pairs import FloatArray
from northfinder.alignment.result import Alignment
from northfinder.alignment.taper import TaperQuest
from northfinder.alignment.triad import optimized_triad, triad
from northfinder.alignment.wahba import quest
from northfinder.attitude.arrays import as_period
from northfinder.attitude.quaternion import conjugate, from_rotation_vector, multiply, rotate
from northfinder.earth import earth_rate_n
from northfinder.errors import EstimationError

#: Below this the Earth turns by less than 2.5': no sensor here finds north in it.
SHORTEST_S = 10.0


class Aligner:
    """Aligns while the stream goes on: ``add`` chunks as they come, ``solve`` at any time.

    However the stream is cut, the result is the same but for rounding.

    Args:
        method: A name of ``METHODS``.
        latitude_rad: Geodetic, positive north.
        dt: Sampling period, s.
        sensors: What is known of the sensors' errors; the stated uncertainty follows from it.
        gravity: Local gravity in the unit of the velocity increments over s: m/s^2, or g.
        warm_s: How long the low-pass runs before the fit begins, s.

    Raises:
        ValueError: An unknown method, a period or gravity that is not positive, or ``warm_s``
            with a method that has no filter.
        EstimationError: A latitude beyond 89 deg.
    """

    def __init__(  # noqa: PLR0913 (what, where, how often, how good)
        self,
        method: str,
        latitude_rad: float,
        dt: float,
        *,
        sensors: SensorErrors,
        gravity: float = 1.0,
        warm_s: float = 0.0,
    ) -> None:
        self.method, self.sensors = method, sensors
        self._method = method_named(method, warm_s)
        self.latitude_rad = check_latitude(latitude_rad)
        if not 0.0 < gravity < math.inf:
            msg = f"gravity is {gravity:g}; give local gravity in the increments' unit per second"
            raise ValueError(msg)
        self._dt, self._each = as_period(dt), increments_in_observation(dt)
        self._period_s, self._gravity = self._dt * self._each, gravity
        self._before = round(warm_s / self._period_s)
        self._increments, self._rest = InertialIncrements(), np.empty((0, 3))
        self._observations = Observations(self._method.form, self._period_s)
        self._taper = TaperQuest(self._method.power)
        self._samples = self._seen = 0
        self._raw: list[FloatArray] = []
        self._fitted: list[tuple[FloatArray, FloatArray]] = []

    @property
    def time_s(self) -> float:
        """Length of the stream, s."""
        return self._samples * self._dt

    @property
    def duration_s(self) -> float:
        """Time in the fit so far, s."""
        return max(0, self._seen - self._before) * self._period_s

    def add(self, angle_rad: ArrayLike, velocity: ArrayLike) -> None:
        """Take the next increments.

        Args:
            angle_rad: Integrals of the body's inertial rate over successive periods, ``(k, 3)``.
            velocity: Integrals of the specific force over the same, ``(k, 3)``, m/s or g s.

        Raises:
            ValueError: Shapes that do not fit, or a number that is not finite.
        """
        ready = self._increments.add(angle_rad, velocity)
        self._samples += len(ready)
        waiting = np.vstack([self._rest, ready])
        whole = len(waiting) // self._each * self._each
        self._rest = waiting[whole:]
        if whole:
            self._observe(waiting[:whole].reshape(-1, self._each, 3).sum(axis=1))

    def solve(self) -> Alignment:
        """Return the attitude at the end of the stream, with its uncertainty.

        Raises:
            EstimationError: Less than 10 s in the fit, or pairs that determine no rotation.
        """
        if self.duration_s < SHORTEST_S:
            msg = (
                f"the fit has {self.duration_s:.3g} s of data; the Earth must turn for at least "
                f"{SHORTEST_S:g} s before north can be seen"
            )
            raise EstimationError(msg)
        in0_to_ib0 = self._rotation()
        to_n = from_rotation_vector(-self.time_s * earth_rate_n(self.latitude_rad))
        in_in0 = multiply(conjugate(in0_to_ib0), self._increments.attitude)
        return Alignment(
            method=self.method,
            q_b_n=multiply(to_n, in_in0),
            time_s=self.time_s,
            duration_s=self.duration_s,
            limits=self._limits(in0_to_ib0),
        )

    def _observe(self, gained: FloatArray) -> None:
        """Take the velocity that each of the next observations gained, ``(m, 3)``."""
        count = self._seen + np.arange(len(gained) + 1.0)
        edges_s = self._period_s * count
        W = gained / (self._gravity * self._period_s)
        V = reaction_to_gravity(self.latitude_rad, edges_s[:-1], edges_s[1:])
        self._seen += len(gained)
        w, v = self._observations.add(W, V)
        begin = np.searchsorted(count[:-1], self._before)
        self._raw.append(W[begin:])
        if self._method.solver == "taper":
            self._taper.add(edges_s[:-1] + 0.5 * self._period_s, W, V)
        else:
            self._fitted.append((w[begin:], v[begin:]))

    def _rotation(self) -> FloatArray:
        """Return q from in0 to ib0, by the method's solver."""
        if self._method.solver == "taper":
            return self._taper.solve(self.duration_s)
        W, V = (np.concatenate(parts) for parts in zip(*self._fitted, strict=True))
        self._fitted = [(W, V)]
        if self._method.solver == "quest":
            return quest(W, V)
        ends = [len(W) - 1, len(W) // 2 - 1]  # the later one first: its filter is the calmer
        return (triad if self._method.solver == "triad" else optimized_triad)(W[ends], V[ends])

    def _limits(self, in0_to_ib0: FloatArray) -> Limits:
        raw = np.concatenate(self._raw)
        self._raw = [raw]
        edges_s = self._period_s * (self._before + np.arange(len(raw) + 1.0))
        expected = reaction_to_gravity(self.latitude_rad, edges_s[:-1], edges_s[1:])
        residual = rotate(conjugate(in0_to_ib0), raw) - expected
        warm_s = self._before * self._period_s
        return find_limits(
            self.method, self.latitude_rad, self.duration_s, self.sensors, warm_s, residual
        )
