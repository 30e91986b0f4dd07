"""What came of a sensor's stream and what is missing: every sample placed and counted once."""

import numpy as np

from drivers.device_clock import DeviceClock
from drivers.interfaces import Counters, FloatArray, IntArray


class SampleAccount:
    """Places each delivery by the device's clock and enters it in the counters.

    Args:
        clock: The device's.
        counters: Its ``frames`` and ``lost`` are kept here; a gap of the ticks is lost samples.
    """

    def __init__(self, clock: DeviceClock, counters: Counters) -> None:
        self._clock = clock
        self._counters = counters
        self._tick = -1
        self._discarded_bytes = 0

    def place(
        self, counter: IntArray, arrival_s: float, discarded_bytes: int
    ) -> tuple[IntArray, FloatArray]:
        """Return ticks and loop times of one delivery, each of the counter's shape.

        Args:
            counter: The device's counter of each sample, at least one.
            arrival_s: Loop time at which the last one arrived.
            discarded_bytes: How many bytes the decoder has discarded so far.
        """
        bytes_lost = discarded_bytes > self._discarded_bytes
        self._discarded_bytes = discarded_bytes
        tick, time_s = self._clock.place(counter, arrival_s, bytes_lost=bytes_lost)
        reached = np.maximum.accumulate(np.concatenate([[self._tick], tick]))
        fresh = int(np.count_nonzero(np.diff(reached)))  # the others came before
        self._counters.frames += len(tick)
        self._counters.lost += int(reached[-1]) - self._tick - fresh
        self._tick = int(reached[-1])
        return tick, time_s

    def restart(self, arrival_s: float, discarded_bytes: int) -> None:
        """Begin anew after the link or the device was away; what was missed meanwhile is lost."""
        self._discarded_bytes = discarded_bytes
        self._clock.restart(arrival_s)
