"""Quaternion Runge-Kutta of the fourth order (`coning-rk4`, eq 4 with its factors 2 restored)."""

import numpy as np

from northfinder.attitude.arrays import FloatArray
from northfinder.attitude.scan import Pair, pair_from_parts, pair_product


def rk4_steps(first: FloatArray, middle: FloatArray, last: FloatArray) -> Pair:
    """Return the step of each update, normalised.

    ``qdot = 1/2 q (x) [0, omega]`` is linear in q: the step from the identity serves every
    attitude, and normalising it normalises the attitude.

    Args:
        first: Rate at 0 times the sampling period, rad, ``(3, m)``; the update lasts two periods.
        middle: The same at dt.
        last: The same at 2 dt.
    """
    zero = np.zeros(first.shape[1])
    w1, w2, w3 = (pair_from_parts(zero, rate) for rate in (first, middle, last))
    k1 = w1
    k2 = pair_product(_moved(k1, 0.5), w2)
    k3 = pair_product(_moved(k2, 0.5), w2)
    k4 = pair_product(_moved(k3, 1.0), w3)
    a, b = ((p + 2.0 * q + 2.0 * r + s) / 6.0 for p, q, r, s in zip(k1, k2, k3, k4, strict=True))
    a += 1.0
    length = np.sqrt(a.real**2 + a.imag**2 + b.real**2 + b.imag**2)
    return a / length, b / length


def _moved(slope: Pair, share: float) -> Pair:
    """Return the identity moved along a slope."""
    return 1.0 + share * slope[0], share * slope[1]
