"""How much of a gyro's white noise a method lets through, over the plain sum of its rates."""

from typing import Unpack

import numpy as np

from northfinder.attitude import integrate
from northfinder.attitude.coning import MethodOptions
from northfinder.attitude.quaternion import to_rotation_vector

_PULSE_RAD_S = 1e-5
_UPDATES = 12


def noise_gain(method: str, samples: int, **options: Unpack[MethodOptions]) -> float:
    """Return the random walk of the attitude over that of the sum of the rates.

    Each rate of an update in the middle of a rest is disturbed in turn: what it moves the last
    attitude by is its weight, and white noise adds their squares.

    Args:
        method: As for ``integrate``, fed with rates.
        samples: Sampling periods in an update.
        **options: As for ``integrate``.
    """
    middle = _UPDATES // 2 * samples
    weights = [_weight(method, samples, middle + i, options) for i in range(samples)]
    return float(np.sqrt(np.mean(np.square(weights))))


def _weight(method: str, samples: int, disturbed: int, options: MethodOptions) -> float:
    rates = np.zeros((_UPDATES * samples + 1, 3))
    rates[disturbed, 0] = _PULSE_RAD_S
    turned = to_rotation_vector(integrate(rates, 1.0, method, **options)[-1])
    return float(turned[0]) / _PULSE_RAD_S
