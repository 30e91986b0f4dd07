"""What goes wrong inside an inertial sensor: stuck, spiking, at its limit, warming up."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from drivers.interfaces import FloatArray
from sim.interfaces import Felt


@dataclass(slots=True)
class SensorFaults:
    """The faults of one sensor, settable while it runs.

    Attributes:
        frozen: It repeats its last reading, on every axis, with new numbers.
        spikes_per_s: How often on average a single sample is far off, on every axis.
        spike_rad_s: By how much the rate is off then, either way.
        limit_rad_s: Where every rate is cut off, as by an amplifier at its limit; None is beyond
            any motion.
        drift_rad_s2: What the rates gain a second, from when it was set.
        curvature_rad_s3: What the rates gain with the square of the time since it was set, as in
            a room that warms up.
    """

    frozen: bool = False
    spikes_per_s: float = 0.0
    spike_rad_s: float = 0.0
    limit_rad_s: float | None = None
    drift_rad_s2: float = 0.0
    curvature_rad_s3: float = 0.0


_HEALTHY = SensorFaults()


class FaultySensor:
    """Spoils what a sensor reads as its faults say.

    Args:
        random: Seeded; decides which samples are hit.
    """

    def __init__(self, random: Generator) -> None:
        self.faults = SensorFaults()
        self._random = random
        self._last: Felt | None = None
        self._drifting = (0.0, 0.0)
        self._since_s = 0.0

    def spoiled(self, felt: Felt, time_s: FloatArray, period_s: float) -> Felt:
        """Return what it reads instead; successive calls go forward in time."""
        faults = self.faults
        if faults.frozen and self._last is not None:
            return Felt(*(np.repeat(part[-1:], len(time_s), axis=0) for part in self._last))
        self._last = felt if faults == _HEALTHY else self._misread(felt, time_s, period_s)
        return self._last

    def _misread(self, felt: Felt, time_s: FloatArray, period_s: float) -> Felt:
        faults = self.faults
        rate = felt.rate_rad_s + self._drift(time_s, period_s)
        if faults.spikes_per_s:
            hit = self._random.random(len(time_s)) < faults.spikes_per_s * period_s
            way = self._random.choice([-1.0, 1.0], len(time_s))
            rate += (hit * way * faults.spike_rad_s)[:, np.newaxis]
        if faults.limit_rad_s is not None:
            rate = np.clip(rate, -faults.limit_rad_s, faults.limit_rad_s)
        return felt._replace(rate_rad_s=rate)

    def _drift(self, time_s: FloatArray, period_s: float) -> FloatArray:
        """Return what the rates have gained, ``(k, 1)``; a new setting begins at nothing."""
        linear, square = drifting = self.faults.drift_rad_s2, self.faults.curvature_rad_s3
        if drifting != self._drifting:
            self._drifting, self._since_s = drifting, float(time_s[0]) - period_s
        elapsed_s = time_s - self._since_s
        gained: FloatArray = (elapsed_s * (linear + square * elapsed_s))[:, np.newaxis]
        return gained
