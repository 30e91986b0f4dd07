"""From samples as they came to increments at every tick: short gaps bridged, long ones told."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from drivers.interfaces import BoolArray, FloatArray, IntArray, SampleBlock

#: The longest gap that is bridged by a straight line between the samples beside it: an engine at
#: 23 Hz turns a vehicle by 4" in less, a seventh of a minute of heading.
BRIDGED_S: Final = 0.05


@dataclass(frozen=True, slots=True)
class Increments:
    """What an instrument turned and gained in successive sampling periods.

    Attributes:
        angle_rad: Shape ``(k, 3)``.
        velocity_g_s: Specific force times time, standard gravities times seconds, ``(k, 3)``.
        after_gap: Whether something too long to be bridged is missing before.
    """

    angle_rad: FloatArray
    velocity_g_s: FloatArray
    after_gap: bool


class Bridge:
    """Makes increments of an instrument's samples; stretches of samples must follow one another.

    A sample that the device does not vouch for, on any axis, is as good as lost.

    Args:
        period_s: Between two samples.

    Attributes:
        bridged: Samples that a straight line stands for, so far.
    """

    def __init__(self, period_s: float) -> None:
        self.bridged = 0
        self._period_s = period_s
        self._limit = max(1, int(BRIDGED_S / period_s))
        self._last: FloatArray | None = None  # the six readings of the tick before
        self._missing = 0  # ticks since then, at the end of what came so far

    def increments(self, block: SampleBlock, begin_tick: int, ticks: int) -> Iterator[Increments]:
        """Yield the increments of a stretch, in one piece or around its gaps.

        What is missing at its end is left to the next stretch, which knows what comes after.

        Args:
            block: Its samples.
            begin_tick: Where it begins.
            ticks: How many it has.
        """
        usable = _usable(block)
        place = (block.tick[usable] - begin_tick).astype(np.intp)
        readings = np.hstack([block.rate_rad_s, block.specific_force_g])[usable]
        ends = np.flatnonzero(np.diff(place) > self._limit + 1) + 1
        begin = -self._missing
        for part, piece in zip(np.split(place, ends), np.split(readings, ends), strict=True):
            if len(part):
                yield self._bridged(part, piece, begin)
                begin = int(part[-1]) + 1
        self._missing = ticks - begin

    def _bridged(self, place: IntArray, readings: FloatArray, begin: int) -> Increments:
        """Draw straight lines over what is missing between these readings, and before them."""
        lost = int(place[0]) - begin
        after_gap = self._last is not None and lost > self._limit
        if self._last is None or after_gap:
            begin = int(place[0])
        elif lost:
            place = np.concatenate([[begin - 1], place])
            readings = np.vstack([self._last, readings])
        grid = np.arange(begin, int(place[-1]) + 1)
        self.bridged += len(grid) - int(np.count_nonzero(place >= begin))
        if not np.array_equal(grid, place):
            readings = np.stack([np.interp(grid, place, axis) for axis in readings.T], axis=1)
        self._last = readings[-1]
        steady = readings * self._period_s
        return Increments(steady[:, :3], steady[:, 3:], after_gap)


def _usable(block: SampleBlock) -> BoolArray:
    vouched = np.hstack([block.rate_valid, block.force_valid])
    finite = np.isfinite(np.hstack([block.rate_rad_s, block.specific_force_g]))
    usable: BoolArray = np.all(vouched & finite, axis=1)
    return usable
