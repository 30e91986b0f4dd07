"""Samples that come one a message: placed by their counter, or without one by their arrival."""

import math

import numpy as np

from drivers.device_clock import DeviceClock
from drivers.interfaces import Counters, FloatArray, IntArray
from drivers.sample_account import SampleAccount

_PAUSE_S = 0.1  # less may be the computer's delay and not the instrument's
_CATCH_UP_S = 1.0  # time to read what came while the computer was held up


class ArrivalAccount:
    """Gives every message its tick and its time, and counts those that are missing.

    Without a counter the messages are taken to follow each other, but for pauses of more than a
    tenth of a second, which are measured by the clock: a shorter loss stays unseen. With one only
    whole wraps of it can be lost unseen; whether a pause hid some shows a second later, when a
    computer that was merely held up has caught up.

    Args:
        modulus: At how much the counter wraps; None where there is none.
        period_s: Between messages.
        counters: Its ``frames`` and ``lost`` are kept here.
    """

    def __init__(self, modulus: int | None, period_s: float, counters: Counters) -> None:
        self._period_s = period_s
        self._account = SampleAccount(DeviceClock(modulus or 1, 1, period_s), counters)
        self._after_break = False
        self._last_s = 0.0
        self._pauses = 0
        self._judge_s = math.inf

    def restart(self) -> None:
        """Begin anew with the next messages: the bus or the instrument was away."""
        self._after_break = True

    def place(
        self, counter: IntArray | None, times_s: FloatArray, damaged: int
    ) -> tuple[IntArray, FloatArray]:
        """Return ticks and loop times of one delivery, each of its length.

        Args:
            counter: What each message counts, None where nothing does.
            times_s: When each has arrived, at least one.
            damaged: How many were damaged so far: what they counted is not known.
        """
        if np.max(np.diff(times_s, prepend=self._last_s)) > _PAUSE_S + self._period_s:
            self._judge_s = float(times_s[-1]) + (0.0 if counter is None else _CATCH_UP_S)
        self._last_s = float(times_s[-1])
        if self._last_s >= self._judge_s:
            self._pauses, self._judge_s = self._pauses + 1, math.inf
        doubts = damaged + self._pauses  # losses that the counter may not show
        if self._after_break:
            self._account.restart(self._last_s - (len(times_s) - 1) * self._period_s, doubts)
            self._after_break = False
        if counter is None:
            counter = np.zeros(len(times_s), np.int64)
        return self._account.place(counter, self._last_s, doubts)
