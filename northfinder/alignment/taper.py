"""Anchored taper QUEST: a streaming solution of Wahba's problem, exact for narrow fans.

Beyond the papers. The weights ``a(t) = t^p (T-t)^p`` are zero at both ends, so that a sway that
the observation starts or stops in the middle of does not pass for a turn: p = 0, 1 and 2 suit
white noise in acceleration, velocity and position of the base.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.matrices import quaternion_from_matrix
from northfinder.alignment.pairs import FloatArray, check_finite
from northfinder.errors import EstimationError

_UNIT_S = 60.0  # powers of minutes stay near 1
_LEAST_WEIGHT = 1e-12  # of the terms that cancel where T is the only time there is
_LEAST_FAN = 1e-13  # rad^2; the squared spread of directions, of which rounding fills 1e-16


class TaperQuest:
    """Takes pairs as they come, and has the rotation of all of them at any time.

    With ``W = A(q) V``, q takes V's frame to W's (as in ``wahba``). The weighted means of W and V
    are the anchor, matched exactly: they give the level. The covariance C of what differs from
    them, put into the planes across the anchors, gives the turn about it: the rotation is the
    maximum of ``tr(A B')`` for ``B = w v' + C / |C|``, which has a closed form in frames that hold
    w and v. So nothing is lost by rounding in a fan of 0.1 deg. Memory and time do not grow.

    Args:
        power: p of the weights: 0, 1 or 2.

    Raises:
        ValueError: Another power.
    """

    def __init__(self, power: int = 2) -> None:
        if power not in {0, 1, 2}:
            msg = f"power is {power!r}; the taper t^p (T-t)^p has p = 0, 1 or 2"
            raise ValueError(msg)
        self.power = power
        self.last_s = 0.0
        self._coefficients = [(-1) ** j * math.comb(power, j) for j in range(power + 1)]
        self._origin: FloatArray | None = None
        self._moments = np.zeros((power + 1, 7, 7))

    def add(self, t_s: ArrayLike, W: ArrayLike, V: ArrayLike) -> None:
        """Take one pair, or many.

        Args:
            t_s: Since the beginning of the fit, not negative, s, ``()`` or ``(k,)``; in any order.
            W: In the frame that q leads to, ``(3,)`` or ``(k, 3)``.
            V: In the frame that q comes from, same shape.

        Raises:
            ValueError: Shapes that do not fit, a number that is not finite, a time below zero.
        """
        time_s, pairs = _as_timed_pairs(t_s, W, V)
        if len(time_s) == 0:
            return
        self.last_s = max(self.last_s, float(time_s.max()))
        if self._origin is None:  # differences from it keep the digits that the fan needs
            self._origin = pairs[0].copy()
        rows = np.hstack([np.ones((len(time_s), 1)), pairs - self._origin])
        x = time_s / _UNIT_S
        for j in range(self.power + 1):
            self._moments[j] += (x ** (self.power + j) * rows.T) @ rows

    def solve(self, t_s: float | None = None) -> FloatArray:
        """Return q ``(4,)`` of all pairs so far, scalar first and not negative.

        Args:
            t_s: T, at which the weights end, s; None for the last pair's time.

        Raises:
            ValueError: T lies before the last pair.
            EstimationError: The pairs do not determine the rotation: none of weight, or all
                parallel.
        """
        m, w, v, C = self._weighted(self._end(t_s))
        if not m > 0.0:
            msg = "no pair has weight yet; add pairs at times between 0 and T"
            raise EstimationError(msg)
        w_frame, v_frame = _frame("W", w), _frame("V", v)
        across = w_frame.T @ C @ v_frame
        cos, sin = across[1, 1] + across[2, 2], across[2, 1] - across[1, 2]
        size = math.hypot(cos, sin)
        if not size > _LEAST_FAN * math.sqrt(float((w @ w) * (v @ v))):
            msg = (
                f"up to {self.last_s:g} s the vectors are parallel, |C| = {size:.3g}: the turn "
                "about them is not determined; observe longer"
            )
            raise EstimationError(msg)
        twist = np.array([[size, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]]) / size
        return quaternion_from_matrix(w_frame @ twist @ v_frame.T)

    def _end(self, t_s: float | None) -> float:
        end_s = self.last_s if t_s is None else float(t_s)
        if not (math.isfinite(end_s) and end_s >= self.last_s):
            msg = f"T is {end_s:g} s, but a pair came at {self.last_s:g} s: T cannot lie before it"
            raise ValueError(msg)
        return end_s

    def _weighted(self, end_s: float) -> tuple[float, FloatArray, FloatArray, FloatArray]:
        """Return the sum of weights, the means of W and V, and their covariance ``(3, 3)``."""
        x, p = end_s / _UNIT_S, self.power
        total = sum(
            (c * x ** (p - j) * self._moments[j] for j, c in enumerate(self._coefficients)),
            start=np.zeros((7, 7)),
        )
        m = float(total[0, 0])
        terms = x**p * float(self._moments[0, 0, 0])
        if self._origin is None or not m > _LEAST_WEIGHT * terms:
            return 0.0, np.zeros(3), np.zeros(3), np.zeros((3, 3))
        mean = total[0, 1:] / m
        covariance = total[1:, 1:] / m - np.outer(mean, mean)
        middle = self._origin + mean
        return m, middle[:3], middle[3:], covariance[:3, 3:]


def _as_timed_pairs(t_s: ArrayLike, W: ArrayLike, V: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return times ``(k,)``, and W and V side by side, ``(k, 6)``.

    Raises:
        ValueError: As ``TaperQuest.add``.
    """
    times = np.asarray(t_s, dtype=np.float64)
    w, v = np.asarray(W, dtype=np.float64), np.asarray(V, dtype=np.float64)
    if times.ndim > 1 or w.shape != (*times.shape, 3) or v.shape != w.shape:
        msg = f"W and V need a row (3,) for each time; got {w.shape}, {v.shape} for {times.shape}"
        raise ValueError(msg)
    time_s, pairs = times.reshape(-1), np.hstack([w.reshape(-1, 3), v.reshape(-1, 3)])
    check_finite("t_s", time_s)
    check_finite("W, V", pairs)
    if (time_s < 0.0).any():
        msg = f"a pair's time is {time_s.min():g} s; count from the beginning of the fit"
        raise ValueError(msg)
    return time_s, pairs


def _frame(name: str, anchor: FloatArray) -> FloatArray:
    """Return a right-handed frame as columns, the anchor's direction first.

    Raises:
        EstimationError: The mean vector is zero.
    """
    length = math.sqrt(float(anchor @ anchor))
    if not length > 0.0:
        msg = f"the vectors of {name} cancel: their mean has no direction to hold on to"
        raise EstimationError(msg)
    x = anchor / length
    y = np.eye(3)[int(np.argmin(np.abs(x)))]
    y = y - (y @ x) * x
    y /= math.sqrt(float(y @ y))
    return np.stack([x, y, np.cross(x, y)], axis=-1)
