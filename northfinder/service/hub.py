"""Run events from the rig's thread to everyone who listens, in the web's loop."""

import asyncio
import json
import logging
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from starlette.concurrency import run_in_threadpool

from northfinder.records import Records, RecordsError, RunEvent
from northfinder.records.states import ENDED

_LOG = logging.getLogger(__name__)
_QUEUE_EVENTS = 1024  # a subscriber so far behind reads the rest from the records
_HERE_S = 15.0  # a live run says nothing during a long dwell
_ELSEWHERE_S = 1.0  # how often a run of another process is looked up
_READERS = 4  # of the records at a time; a hundred that subscribe at once must not starve the rest
_EVENTS = 1000  # that are read at once


@dataclass(frozen=True, slots=True)
class Frame:
    """A run's event as it goes over the wire; encoded once for all subscribers."""

    seq: int
    event: str
    data: str
    ends: bool

    @classmethod
    def of(cls, event: RunEvent) -> "Frame":
        """Encode an event."""
        data = {"seq": event.seq, "time": event.time_utc.isoformat(), **event.data}
        ends = event.event == "state" and event.data["state"] in ENDED
        return cls(event.seq, event.event, json.dumps(data), ends)


class Hub:
    """Who listens to which run. Everything but :meth:`publish` belongs to the web's loop.

    Args:
        records: Where the events of before are read.
        loop: The web's loop.
    """

    def __init__(self, records: Records, loop: asyncio.AbstractEventLoop) -> None:
        self._records = records
        self._loop = loop
        self._queues: dict[str, list[asyncio.Queue[Frame | None]]] = {}
        self._here: set[str] = set()
        self._reading = asyncio.Semaphore(_READERS)
        self._closed = False

    @property
    def subscribers(self) -> int:
        """Return how many listen."""
        return sum(map(len, self._queues.values()))

    def publish(self, event: RunEvent) -> None:
        """Hand on an event that is in the records; from any thread."""
        self._loop.call_soon_threadsafe(self._deliver, event)

    def close(self) -> None:
        """End every stream."""
        self._closed = True
        for queues in self._queues.values():
            for queue in queues:
                _put(queue, None)

    async def follow(self, run_id: str, after: int) -> AsyncIterator[Frame]:
        """Yield a run's events after a sequence number, without loss or repeat, until it ends.

        Live events come by the queue; what is missing between them, from the records.
        """
        with self._queue(run_id) as queue:
            seq = after
            while not self._closed:
                async with self._reading:
                    missing, over = await run_in_threadpool(self._recorded, run_id, seq)
                for frame in missing:
                    yield frame
                    seq = frame.seq
                if over:
                    return
                while (live := await self._next(run_id, queue)) and live.seq <= seq + 1:
                    if live.seq == seq + 1:
                        yield live
                        seq = live.seq
                        if live.ends:
                            return

    def _recorded(self, run_id: str, after: int) -> tuple[list[Frame], bool]:
        """Return the recorded events after a sequence number, and whether none will follow.

        While the records cannot be used there are none: the stream stays open and tries again.
        """
        frames: list[Frame] = []
        try:
            while True:
                events = self._records.events(run_id, after + len(frames), _EVENTS)
                frames += [Frame.of(event) for event in events]
                if len(events) < _EVENTS:
                    break
            over = frames[-1].ends if frames else self._records.run(run_id).state in ENDED
        except RecordsError as error:
            _LOG.warning("the events of run %s after %d cannot be read: %s", run_id, after, error)
            return frames, False
        return frames, over

    async def _next(self, run_id: str, queue: asyncio.Queue[Frame | None]) -> Frame | None:
        """Return the next live frame; None says to look into the records."""
        patience_s = _HERE_S if run_id in self._here else _ELSEWHERE_S
        try:
            async with asyncio.timeout(patience_s):
                return await queue.get()
        except TimeoutError:
            return None

    def _deliver(self, event: RunEvent) -> None:
        frame = Frame.of(event)
        if frame.ends:
            self._here.discard(event.run_id)
        else:
            self._here.add(event.run_id)
        for queue in self._queues.get(event.run_id, []):
            _put(queue, frame)

    @contextmanager
    def _queue(self, run_id: str) -> Iterator[asyncio.Queue[Frame | None]]:
        queue: asyncio.Queue[Frame | None] = asyncio.Queue(_QUEUE_EVENTS)
        queues = self._queues.setdefault(run_id, [])
        queues.append(queue)
        try:
            yield queue
        finally:
            queues.remove(queue)
            if not queues:
                self._queues.pop(run_id, None)


def _put(queue: asyncio.Queue[Frame | None], frame: Frame | None) -> None:
    """Put, and drop the oldest where nobody reads: the gap is filled from the records."""
    if queue.full():
        queue.get_nowait()
    queue.put_nowait(frame)
