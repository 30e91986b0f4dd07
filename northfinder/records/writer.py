"""The one thread that writes, as an event loop sees it."""

import asyncio
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Literal, Self, TypeVar, TypeVarTuple

from northfinder.records.entries import NewRun, VisitStatistics
from northfinder.records.portable_json import JsonObject
from northfinder.records.samples import Stream
from northfinder.records.store import Records
from northfinder.samples import Samples

T = TypeVar("T")
Ts = TypeVarTuple("Ts")

_QUEUE_JOBS = 16


class Writer:
    """Writes records from a coroutine without holding up its loop.

    Jobs run one after another, in the order of the calls; a call returns when its transaction
    is durable. Whoever is cancelled meanwhile leaves at once: the transaction goes on to its
    end, and what is written next comes after it. The records stay the caller's to close.
    """

    def __init__(self, records: Records) -> None:
        self._records = records
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="records")
        self._room = asyncio.Semaphore(_QUEUE_JOBS)

    async def create_run(self, new: NewRun) -> str:
        """See :meth:`Records.create_run`."""
        return await self._do(self._records.create_run, new)

    async def set_state(
        self, run_id: str, state: Literal["running", "paused", "aborted", "interrupted"]
    ) -> None:
        """See :meth:`Records.set_state`."""
        await self._do(self._records.set_state, run_id, state)

    async def finish(self, run_id: str, result: JsonObject) -> None:
        """See :meth:`Records.finish`."""
        await self._do(self._records.finish, run_id, result)

    async def fail(self, run_id: str, error: str) -> None:
        """See :meth:`Records.fail`."""
        await self._do(self._records.fail, run_id, error)

    async def add_visit(
        self, run_id: str, visit: VisitStatistics, samples: Mapping[Stream, Samples]
    ) -> None:
        """See :meth:`Records.add_visit`."""
        await self._do(self._records.add_visit, run_id, visit, samples)

    async def close(self) -> None:
        """Wait for what was submitted and end the thread."""
        try:
            await self._do(_nothing)  # first in, first out: when this is done, all is
        finally:
            self._thread.shutdown()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def _do(self, job: Callable[[*Ts], T], *args: *Ts) -> T:
        await self._room.acquire()
        future = asyncio.get_running_loop().run_in_executor(self._thread, job, *args)
        future.add_done_callback(lambda _: self._room.release())
        # A cancelled wait leaves the job alone; an awaited future would be cancelled with us.
        # Should such a job fail, asyncio reports its exception as never retrieved.
        await asyncio.wait((future,))
        return future.result()


def _nothing() -> None:
    """Do nothing, after everything before it."""
