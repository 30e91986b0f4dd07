"""The SYNC of a bus, produced by whoever needs it first (CiA 301, 7.2.5)."""

import asyncio
import contextlib
from collections import deque

import numpy as np

from drivers.canopen.node import CanopenNode
from drivers.codecs.canopen import SYNC
from drivers.errors import DriverError
from drivers.interfaces import CanFrame, Counters, FloatArray, IntArray

_KEPT = 1000
_SURE = 20  # answers in a row that shall show whether they catch up


class SyncClock:
    """Sends SYNC at a steady rate, and tells which one an answer belongs to.

    A device answers in order, and its answer may come after the next SYNC was sent: so each
    belongs to the oldest SYNC that has none. Where answers lag behind and do not catch up, some
    were lost; a device or a bus that was held up for a moment does catch up.

    Args:
        node: Who answers.
        period_s: From one to the next.
        counters: Its ``frames`` and ``lost`` are kept here: every SYNC has one answer.
    """

    def __init__(self, node: CanopenNode, period_s: float, counters: Counters) -> None:
        self._node = node
        self._period_s = period_s
        self._counters = counters
        self._sent: deque[float] = deque(maxlen=_KEPT)
        self._ticks = 0
        self._answered = -1
        self._behind: deque[int] = deque(maxlen=_SURE)
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to send."""
        self._task = asyncio.create_task(self._send(), name=f"SYNC for {self._node.name}")

    def count_from_here(self) -> None:
        """Miss no answer to what was sent until now."""
        self._answered = self._ticks - 1

    async def stop(self) -> None:
        """Send no more."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])
            if not task.cancelled():
                task.result()  # a defect must not pass in silence

    def place(self, arrivals_s: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the number and the time of the SYNC that each answer followed, shape ``(k,)``.

        A second answer to one SYNC keeps its number; whoever listens sees time stand still.
        """
        ticks = [self._answer(time_s) for time_s in arrivals_s]
        self._counters.frames += len(ticks)
        return np.array(ticks, np.int64), np.array([self._sent_s(tick) for tick in ticks])

    def _answer(self, time_s: float) -> int:
        """Return the number of the SYNC that an answer belongs to; those left out are lost."""
        newest = self._ticks - 1
        tick = max(self._answered + 1, self._ticks - len(self._sent))
        self._behind.append(self._sent_between(tick, time_s))
        tick = min(tick + self._left_out(), newest)
        self._counters.lost += max(0, tick - self._answered - 1)
        self._answered = max(self._answered, tick)
        return tick

    def _left_out(self) -> int:
        """Return by how many answers the last ones are behind for good; then begin anew."""
        if len(self._behind) < _SURE:
            return 0
        behind = list(self._behind)
        before, now = min(behind[: _SURE // 2]), min(behind[_SURE // 2 :])
        if before == 0 or now < before:  # not behind, or catching up
            return 0
        self._behind.clear()
        return before

    def _sent_between(self, tick: int, time_s: float) -> int:
        """Return how many SYNCs after this one had been sent by a time."""
        newer = range(tick + 1, self._ticks)
        return next((n for n, one in enumerate(newer) if self._sent_s(one) > time_s), len(newer))

    def _sent_s(self, tick: int) -> float:
        return self._sent[tick - self._ticks]

    async def _send(self) -> None:
        """Send at even times; a loop that was held up leaves out what it missed."""
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        with contextlib.suppress(DriverError):  # the node has failed, and says so itself
            while True:
                await asyncio.sleep(due_s - loop.time())
                now_s = loop.time()
                self._sent.append(now_s)
                self._ticks += 1
                await self._node.send(CanFrame(SYNC))
                due_s += self._period_s * (1 + round((now_s - due_s) / self._period_s))
