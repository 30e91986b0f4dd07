"""What one sensing axis read during one visit."""

import math
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
    def mean(self) -> float:
        """Return the mean of the valid samples."""
        return float(np.mean(self.value[self.valid]))

    @cached_property
    def sigma(self) -> float:
        """Return the standard error of that mean, by the scatter of the samples."""
        values = self.value[self.valid]
        return float(np.std(values, ddof=1) / math.sqrt(len(values)))
