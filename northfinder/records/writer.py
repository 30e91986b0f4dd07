"""The one thread that writes, as an event loop sees it."""

import asyncio
import logging
from collections.abc import Callable, Mapping
from typing import Final, Self, TypeVar, TypeVarTuple

from northfinder.records.entries import EventName, NewRun, Run, RunEvent, VisitStatistics
from northfinder.records.errors import RecordsError
from northfinder.records.portable_json import JsonObject
from northfinder.records.states import SettableState
from northfinder.records.store import Records
from northfinder.records.thread import ChoreThread
from northfinder.samples import Samples, Stream

T = TypeVar("T")
Ts = TypeVarTuple("Ts")

_LOG = logging.getLogger(__name__)
_QUEUE_JOBS = 16
_RENEW_EVERY_S: Final = 10.0  # a lease lasts three times as long


class Writer:
    """Writes records from a coroutine without holding up its loop.

    Jobs run one after another, in the order of the calls; a call returns when its transaction
    is durable. Whoever is cancelled meanwhile leaves at once: the transaction goes on to its
    end, and what is written next comes after it. The thread renews the leases of the runs that
    this process holds. The records stay the caller's to close.
    """

    def __init__(self, records: Records) -> None:
        self._records = records
        self._thread = ChoreThread("records", self._renew_leases, _RENEW_EVERY_S)
        self._room = asyncio.Semaphore(_QUEUE_JOBS)

    async def create_run(self, new: NewRun) -> Run:
        """See :meth:`Records.create_run`."""
        return await self.call(self._records.create_run, new)

    async def set_state(
        self, run_id: str, state: SettableState, detail: JsonObject | None = None
    ) -> RunEvent:
        """See :meth:`Records.set_state`."""
        return await self.call(self._records.set_state, run_id, state, detail)

    async def finish(
        self, run_id: str, result: JsonObject, headline: JsonObject | None
    ) -> list[RunEvent]:
        """See :meth:`Records.finish`."""
        return await self.call(self._records.finish, run_id, result, headline)

    async def fail(self, run_id: str, error: str) -> list[RunEvent]:
        """See :meth:`Records.fail`."""
        return await self.call(self._records.fail, run_id, error)

    async def resume(self, run_id: str) -> RunEvent:
        """See :meth:`Records.resume`."""
        return await self.call(self._records.resume, run_id)

    async def add_visit(
        self,
        run_id: str,
        visit: VisitStatistics,
        samples: Mapping[Stream, Samples],
        data: JsonObject,
        progress: float,
    ) -> RunEvent:
        """See :meth:`Records.add_visit`."""
        return await self.call(self._records.add_visit, run_id, visit, samples, data, progress)

    async def add_event(
        self,
        run_id: str,
        event: EventName,
        data: JsonObject,
        *,
        progress: float | None = None,
        headline: JsonObject | None = None,
    ) -> RunEvent:
        """See :meth:`Records.add_event`."""
        return await self.call(
            lambda: self._records.add_event(
                run_id, event, data, progress=progress, headline=headline
            )
        )

    async def interrupt_abandoned(self, rig_name: str) -> list[RunEvent]:
        """See :meth:`Records.interrupt_abandoned`."""
        return await self.call(self._records.interrupt_abandoned, rig_name)

    async def close(self) -> None:
        """Wait for what was submitted and end the thread."""
        try:
            await self.call(_nothing)  # first in, first out: when this is done, all is
        finally:
            self._thread.shutdown()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def call(self, job: Callable[[*Ts], T], *args: *Ts) -> T:
        """Do anything else in the thread, in its turn: to read, for example."""
        await self._room.acquire()
        future = asyncio.get_running_loop().run_in_executor(self._thread, job, *args)
        future.add_done_callback(lambda _: self._room.release())
        # A cancelled wait leaves the job alone; an awaited future would be cancelled with us.
        # Should such a job fail, asyncio reports its exception as never retrieved.
        await asyncio.wait((future,))
        return future.result()

    def _renew_leases(self) -> None:
        """Renew, and go on where it fails: the database may be back before the leases expire."""
        try:
            self._records.renew_leases()
        except RecordsError as error:
            _LOG.warning("the leases of the runs in progress are not renewed: %s", error)


def _nothing() -> None:
    """Do nothing, after everything before it."""
