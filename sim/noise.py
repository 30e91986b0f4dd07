"""Seeded sensor noise: white, bias, drift, bias instability and random walk."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from drivers.interfaces import FloatArray

# Flicker noise as a sum of first-order Markov processes, one time constant per factor of three
# from half a second to half a day; the ripple of the summed density is below 2 %.
_SPACING = 3.0
_TIME_CONSTANTS_S = 0.5 * _SPACING ** np.arange(11)


@dataclass(frozen=True, slots=True)
class NoiseLevels:
    """How a sensor errs; the unit is rad/s for a gyro and g for an accelerometer.

    Attributes:
        white_sqrt_s: The mean over T seconds has sigma ``white_sqrt_s / sqrt(T)``.
        bias: Offset at power-up, or since it was last changed.
        drift_per_s: By how much the offset grows with time since then.
        bias_instability: B of IEEE Std 952: the Allan deviation is flat at 0.664 B.
        random_walk_per_sqrt_s: The offset walks by this times sqrt(T).
    """

    white_sqrt_s: float = 0.0
    bias: float = 0.0
    drift_per_s: float = 0.0
    bias_instability: float = 0.0
    random_walk_per_sqrt_s: float = 0.0


class SensorNoise:
    """The error of a three-axis sensor as it goes forward in time.

    Args:
        levels: At power-up.
        random: The generator; equal seeds and equal calls give equal noise, bit for bit.
    """

    def __init__(self, levels: NoiseLevels, random: Generator) -> None:
        self._levels = levels
        self._random = random
        self._walk = np.zeros(3)
        self._markov = random.standard_normal((len(_TIME_CONSTANTS_S), 3))
        self._drifted = 0.0
        self._drifting_since_s = math.nan  # until the first sample
        self._last_s = math.nan

    @property
    def levels(self) -> NoiseLevels:
        """How it errs; may be replaced while running: a technician tries what noise does.

        A new bias is the offset from now on, whatever the old one had drifted to. A new drift
        alone goes on from where the offset has got to: a sensor that warms up faster does not
        jump.
        """
        return self._levels

    @levels.setter
    def levels(self, levels: NoiseLevels) -> None:
        before, self._levels = self._levels, levels
        if math.isnan(self._last_s):
            return
        if levels.bias != before.bias:
            self._drifted, self._drifting_since_s = 0.0, self._last_s
        elif levels.drift_per_s != before.drift_per_s:
            self._drifted += before.drift_per_s * (self._last_s - self._drifting_since_s)
            self._drifting_since_s = self._last_s

    def sample(self, time_s: FloatArray, period_s: float) -> FloatArray:
        """Return the errors of consecutive samples, each the mean over one period, ``(k, 3)``."""
        if math.isnan(self._last_s):
            self._drifting_since_s = float(time_s[0]) - period_s
        self._last_s = float(time_s[-1])
        levels, shape = self._levels, (len(time_s), 3)
        error: FloatArray = self._random.standard_normal(shape)
        error *= levels.white_sqrt_s / np.sqrt(period_s)
        drifting_s = (time_s - self._drifting_since_s)[:, np.newaxis]
        error += levels.bias + self._drifted + levels.drift_per_s * drifting_s
        if levels.random_walk_per_sqrt_s:
            steps = self._random.standard_normal(shape) * np.sqrt(period_s)
            walk = self._walk + levels.random_walk_per_sqrt_s * np.cumsum(steps, axis=0)
            self._walk = walk[-1]
            error += walk
        if levels.bias_instability:
            error += levels.bias_instability * self._flicker(len(time_s), period_s)
        return error

    def _flicker(self, count: int, period_s: float) -> FloatArray:
        """Unit flicker: each process steps once per call; between, the sum goes linearly."""
        decay = np.exp(-count * period_s / _TIME_CONSTANTS_S)[:, np.newaxis]
        fresh = self._random.standard_normal(self._markov.shape)
        before, self._markov = self._markov, decay * self._markov + np.sqrt(1 - decay**2) * fresh
        scale = np.sqrt(np.log(_SPACING) / np.pi)
        fraction = (np.arange(1, count + 1) / count)[:, np.newaxis]
        start, end = scale * before.sum(axis=0), scale * self._markov.sum(axis=0)
        flicker: FloatArray = start + fraction * (end - start)
        return flicker
