"""The SYNC of a bus, produced by whoever needs it first (CiA 301, 7.2.5)."""

import asyncio
import contextlib
from collections import deque

import numpy as np

from drivers.canopen_node import CanopenNode
from drivers.codecs.canopen import SYNC
from drivers.errors import DriverError
from drivers.interfaces import CanFrame, Counters, FloatArray, IntArray

_KEPT = 1000  # an answer so late belongs to nothing


class SyncClock:
    """Sends SYNC at a steady rate, and tells which one an answer belongs to.

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
        newest = len(self._sent) - 1
        places = [self._before(time_s, newest) for time_s in arrivals_s]
        sent_s = [self._sent[place] for place in places]
        tick = np.array(places, np.int64) + (self._ticks - 1 - newest)
        self._counters.frames += len(tick)
        self._counters.lost += max(0, int(tick[-1]) - self._answered - len(tick))
        self._answered = max(self._answered, int(tick[-1]))
        return tick, np.array(sent_s)

    def _before(self, time_s: float, newest: int) -> int:
        """Return the place of the last SYNC that was not sent later: nearly always the newest."""
        place = newest
        while place > 0 and self._sent[place] > time_s:
            place -= 1
        return place

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
                due_s += self._period_s * max(1.0, (now_s - due_s) // self._period_s)
