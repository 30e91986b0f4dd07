"""What one sensing axis read during one visit."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal, get_args

import numpy as np

from drivers.interfaces import BoolArray, FloatArray, IntArray

#: What a run keeps: the two sensing axes, or all six axes of one instrument.
Stream = Literal[
    "gyro", "accelerometer", "rate-x", "rate-y", "rate-z", "force-x", "force-y", "force-z"
]
STREAMS: Final[tuple[Stream, ...]] = get_args(Stream)
#: Of the samples' scatter, by the median: noise goes so far once in 10^12 samples.
SPIKE_SIGMAS: Final = 7.0
_ORDER: Final = 2
_TO_SIGMA: Final = 1.4826  # median absolute deviation of normal noise


@dataclass(frozen=True, eq=False)
class Samples:
    """One axis's samples of one visit, k of the ``expected``; the rest were lost on the way.

    The statistics are worked out once: north so far is solved anew after each visit, from all.

    Attributes:
        tick: Sample number in the device's own count, wraps resolved, shape ``(k,)``.
        time_s: Loop time, shape ``(k,)``.
        value: Rate in rad/s or specific force in standard gravities, NaN where the device sent
            none, shape ``(k,)``.
        valid: Which of them the device vouches for, shape ``(k,)``.
        expected: How many the dwell should have brought.

    Raises:
        ValueError: The arrays differ in length, or are not flat.
    """

    tick: IntArray
    time_s: FloatArray
    value: FloatArray
    valid: BoolArray
    expected: int

    def __post_init__(self) -> None:
        shapes = [array.shape for array in (self.tick, self.time_s, self.value, self.valid)]
        if any(shape != (len(self.tick),) for shape in shapes):
            msg = f"tick, time_s, value, valid have the shapes {shapes}; all must be (k,)"
            raise ValueError(msg)

    def __len__(self) -> int:
        return len(self.tick)

    @property
    def lost(self) -> int:
        """Return how many samples never came."""
        return self.expected - len(self)

    @cached_property
    def invalid(self) -> int:
        """Return how many came but were not vouched for."""
        return len(self) - int(np.count_nonzero(self.valid))

    @cached_property
    def spikes(self) -> int:
        """Return how many valid samples stand out so far that they are left out of the mean."""
        return int(np.count_nonzero(self.valid)) - len(self._kept)

    @cached_property
    def mean(self) -> float:
        """Return the mean of the valid samples, spikes left out."""
        return float(np.mean(self._kept))

    @cached_property
    def sigma(self) -> float:
        """Return the standard error of that mean, by the samples' scatter about a parabola in time.

        What a sensor reads on a table that turns, or warms up, follows one; it is no noise.
        """
        values = self._kept
        if np.ptp(values) == 0.0:  # the mean of equal numbers need not be that number
            return 0.0
        order = min(_ORDER, len(values) - 2)
        x = self.tick[self.valid][self._keeps]
        fit = np.polynomial.Legendre.fit(x, values, order)
        left = values - fit(x)
        return float(np.sqrt(np.sum(left**2) / (len(values) - 1 - order) / len(values)))

    @cached_property
    def _kept(self) -> FloatArray:
        kept: FloatArray = self.value[self.valid][self._keeps]
        return kept

    @cached_property
    def _keeps(self) -> BoolArray:
        """Return which of the valid samples are no spikes."""
        values = self.value[self.valid]
        apart = np.abs(values - np.median(values))
        limit = SPIKE_SIGMAS * _TO_SIGMA * float(np.median(apart))
        return apart <= limit if limit > 0.0 else np.ones(len(values), dtype=np.bool_)
