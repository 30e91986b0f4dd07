"""From a device's wrapping sample counter to sample ticks and loop time."""

import math

import numpy as np

from drivers.interfaces import FloatArray, IntArray

_WINDOW_S = 10.0  # a 50 ppm crystal drifts 0.5 ms in this time, less than any link's jitter
_EARLY_WRAPS = 0.25  # latency only ever adds, so most of a wrap is left to lateness


class DeviceClock:
    """Place samples on a device's own time axis, and that axis in loop time.

    The counter says which sample it is, modulo its size. Losses longer than a wrap are told by
    the arrival time, but only where something was lost: a late delivery loses nothing, however
    late; one that is late and incomplete is placed right if it is less than three quarters of a
    wrap late. A delivery that came twice is told by its counter going back, for no sample can
    arrive before it was taken: it gets the ticks that it had. Device time is mapped to loop time
    by the smallest latency seen in the last ten to twenty seconds, for latency is never negative
    and the quickest bytes waited least.

    Args:
        modulus: Size of the counter: 128 for KVH, 256 for STIM300.
        counts_per_sample: By how much the counter steps from sample to sample.
        sample_period_s: Time between samples by the device's clock.
    """

    def __init__(self, modulus: int, counts_per_sample: int, sample_period_s: float) -> None:
        self._modulus = modulus
        self._counts_per_sample = counts_per_sample
        self._period_s = sample_period_s
        self._counter = -1
        self._tick = -1
        self._arrival_s = -math.inf
        self._epoch_s = math.inf
        self._previous_epoch_s = math.inf
        self._window_end_s = -math.inf

    def place(
        self, counter: IntArray, arrival_s: float, *, bytes_lost: bool
    ) -> tuple[IntArray, FloatArray]:
        """Return the tick and the loop time of each sample of one delivery.

        Args:
            counter: The device's counter of each sample, in order, at least one.
            arrival_s: Loop time at which the last one arrived.
            bytes_lost: Whether bytes were discarded since the last delivery.

        Returns:
            Ticks and loop times, each of the counter's shape; those of samples that came before
            do not ascend.
        """
        steps = self._steps(counter)
        ticks = int(steps.sum())
        if bytes_lost or ticks > len(steps):
            steps[steps.argmax()] += self._missed_wraps(ticks, arrival_s)
        if ticks > len(steps):
            self._take_back(steps, arrival_s)
        tick = self._tick + np.cumsum(steps)
        self._counter, self._tick, self._arrival_s = int(counter[-1]), int(tick[-1]), arrival_s
        time_s = tick.astype(np.float64) * self._period_s + self._epoch(arrival_s)
        return tick, time_s

    def restart(self, arrival_s: float) -> None:
        """Begin anew after the link or the device was away; ticks go on by the time passed."""
        if self._tick >= 0:
            self._tick += max(0, round((arrival_s - self._arrival_s) / self._period_s) - 1)
            self._counter = -1
        self._epoch_s = self._previous_epoch_s = math.inf

    def _steps(self, counter: IntArray) -> IntArray:
        counts = np.empty_like(counter)
        np.subtract(counter[1:], counter[:-1], out=counts[1:])
        previous = self._counter if self._counter >= 0 else counter[0] - self._counts_per_sample
        counts[0] = counter[0] - previous
        counts %= self._modulus
        counts[counts == 0] = self._modulus
        steps: IntArray = np.maximum(1, counts // self._counts_per_sample)
        return steps

    def _missed_wraps(self, ticks: int, arrival_s: float) -> int:
        epoch_s = min(self._epoch_s, self._previous_epoch_s)
        if math.isinf(epoch_s):  # the first delivery: nothing to compare its arrival with
            return 0
        wrap = self._modulus // self._counts_per_sample
        excess = (arrival_s - epoch_s) / self._period_s - self._tick - ticks
        return wrap * max(0, math.floor(excess / wrap + _EARLY_WRAPS))

    def _take_back(self, steps: IntArray, arrival_s: float) -> None:
        """Turn the widest steps ahead into steps back, as many as lead beyond the arrival."""
        epoch_s = min(self._epoch_s, self._previous_epoch_s)
        if math.isinf(epoch_s):
            return
        wrap = self._modulus // self._counts_per_sample
        ahead = self._tick + int(steps.sum()) - (arrival_s - epoch_s) / self._period_s
        surely = max(0, math.floor(ahead / wrap + _EARLY_WRAPS))
        perhaps = max(0, math.ceil(ahead / wrap - _EARLY_WRAPS))
        widest = np.argsort(-steps, kind="stable")[:perhaps]
        # Less than a wrap ahead: perhaps a latency that has never been so small.
        back = (np.arange(len(widest)) < surely) | (steps[widest] > wrap // 2)
        steps[widest[back]] -= wrap

    def _epoch(self, arrival_s: float) -> float:
        if arrival_s >= self._window_end_s:
            self._previous_epoch_s, self._epoch_s = self._epoch_s, math.inf
            self._window_end_s = arrival_s + _WINDOW_S
        self._epoch_s = min(self._epoch_s, arrival_s - self._tick * self._period_s)
        return min(self._epoch_s, self._previous_epoch_s)
