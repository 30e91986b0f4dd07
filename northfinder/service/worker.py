"""The rig's worker: keeps the bench open, one run at a time, the table stopped at every end.

Everything here runs on the rig's own loop, in its own thread (`rig_thread`).
"""

import asyncio
import logging
from typing import Any

from pydantic import BaseModel

from drivers.errors import DriverError
from northfinder.formatting import sentence_of
from northfinder.recording import Ending, Publish, begin, resume
from northfinder.records import (
    Idempotency,
    IdempotencyKeyUsedError,
    Records,
    RecordsError,
    Run,
    Writer,
)
from northfinder.records.states import ENDED
from northfinder.rig import Rig, Simulation
from northfinder.service.errors import RigOfflineError
from northfinder.service.run_slot import RunSlot
from northfinder.starting import with_start
from northfinder.telemetry import RigTelemetry, unreached

JsonObject = dict[str, Any]

_LOG = logging.getLogger(__name__)
_RETRY_S = 2.0


class Worker:
    """One rig and what it is doing.

    Args:
        bench: The rig, not open yet; one for ever, as a simulated world outlives its closing.
        records: Where runs are kept.
        publish: Receives every event of every run, once it is durable.
    """

    def __init__(self, bench: Rig, records: Records, publish: Publish) -> None:
        self._bench = bench
        self._records = records
        self._publish = publish
        self._writer = Writer(records)
        self._telemetry: RigTelemetry | None = None  # while the bench is open
        self._offline = "the instruments are being opened"
        self._opening = True
        self._slot = RunSlot()
        self._starting = asyncio.Lock()
        self._leaving = False
        self._reopen = asyncio.Event()

    async def serve(self) -> None:
        """Keep the rig open until :meth:`shut_down`; open it again whenever it was lost."""
        async with self._writer:
            while not self._leaving:
                self._reopen.clear()
                try:
                    await self._keep_open()
                except DriverError as error:
                    self._opening, self._offline = False, sentence_of(error)
                    _LOG.warning("the rig is offline: %s", self._offline)
                    await _wait(self._reopen, _RETRY_S)

    async def shut_down(self) -> None:
        """Stop the table, leave a run as interrupted, and end :meth:`serve`."""
        self._leaving = True
        try:
            await self._stop("interrupted")
            async with self._starting:  # a run that was just being begun ends as well
                await self._stop("interrupted")
        except DriverError as error:
            _LOG.error("the table did not confirm that it stopped: %s", sentence_of(error))
        finally:
            self._reopen.set()

    async def interrupt_abandoned(self) -> None:
        """Mark this rig's runs whose process is gone; they can be resumed then.

        It writes, or would: so it is also how an idle rig learns that the records take nothing.
        """
        try:
            events = await self._writer.interrupt_abandoned(self._bench.name)
        except RecordsError as error:
            self._slot.note_trouble(error)
            return
        self._slot.note_success()
        for event in events:
            _LOG.warning("run %s was abandoned by its process: interrupted", event.run_id)
            self._publish(event)

    async def start(self, plan: BaseModel, idempotency: Idempotency | None) -> str:
        """Begin a run and return its id.

        Raises:
            IdempotencyKeyUsedError: The key belongs to another request.
            RigBusyError: Another one is on.
            RigOfflineError: The instruments are not there.
            ConfigError: The plan cannot be carried out.
            RecordsError: It cannot be recorded.
        """
        async with self._starting:
            if idempotency and (earlier := await self._same_request(idempotency)):
                return earlier
            await self._require_empty_slot()
            rig = self.rig()
            chosen = await asyncio.to_thread(with_start, plan, self._records, rig.name)
            run = await begin(rig, chosen, self._writer, self._publish, idempotency)
            self._slot.fill(run)
            return run.id

    async def resume(self, run: Run) -> None:
        """Carry a failed or interrupted run on, or let a paused one continue.

        Raises:
            RigBusyError: Another one is on.
            RigOfflineError: The instruments are not there.
            ConfigError: The bench is not what it was.
            IllegalStepError: The run is in another state by now.
            RecordsError: Its samples are damaged, or the records cannot be used.
        """
        async with self._starting:
            if self._slot.run is not None and self._slot.run_id == run.id:
                self._slot.run.gate.open()
                return
            await self._require_empty_slot()
            rig = self.rig()
            self._slot.fill(await resume(rig, self._records, run, self._writer, self._publish))

    async def pause(self, run_id: str) -> bool:
        """Have the run wait after the present visit; False where it is not the one that is on."""
        if self._slot.run is None or self._slot.run_id != run_id:
            return False
        self._slot.run.gate.close()
        return True

    async def abort(self, run_id: str) -> bool:
        """End the run now; False where it is not the one that is on."""
        if self._slot.run_id != run_id:
            return False
        await self._stop("aborted")
        return True

    async def stop(self) -> str | None:
        """Stop the table at once and abort the run; return the run's id.

        Raises:
            RigOfflineError: There is no table to be reached.
            DriverError: The table did not confirm that it stands.
        """
        run_id = self._slot.run_id
        await self._stop("aborted")
        self.rig()
        return run_id

    @property
    def run_id(self) -> str | None:
        """Return the id of the run that is on."""
        return self._slot.run_id

    @property
    def is_pausing(self) -> bool:
        """Return whether the run that is on waits, or will after the present visit."""
        run = self._slot.run
        return run is not None and not run.gate.is_open

    def rig(self) -> Rig:
        """Return the open rig.

        Raises:
            RigOfflineError: It is not open, or will soon not be; the message says why.
        """
        if self._leaving:
            reason = "the service is ending; start it again"
            raise RigOfflineError(reason)
        if self._telemetry is None:
            raise RigOfflineError(self._offline)
        return self._bench

    @property
    def simulation(self) -> Simulation | None:
        """Return the simulated world, also of a rig that is offline: its faults can be mended."""
        return self._bench.simulation

    def warn_of_change(self, changes: JsonObject) -> None:
        """Tell the run that is on of a change of the simulated world."""
        if self._slot.run is not None:
            what = ", ".join(f"{key} = {value}" for key, value in changes.items())
            self._slot.run.warn(f"The simulated world was changed during the run: {what}.")

    async def snapshot(self) -> JsonObject:
        """Return what changes of `GET /rig`: state, table, devices."""
        always = {
            "run_id": self.run_id,
            "last_run_id": self._slot.last_run_id,
            "records_trouble": self._slot.trouble,
        }
        if self._telemetry is None:
            state = "starting" if self._opening else "offline"
            seen = unreached(self._bench.config, self._offline)
            return {"state": state, "detail": self._offline, **always, **seen}
        state = "ready" if self.run_id is None else "busy"
        seen = await self._telemetry.snapshot()
        if seen["table"] is None and self.run_id is None:
            self._reopen.set()
        return {"state": state, "detail": None, **always, **seen}

    async def _keep_open(self) -> None:
        async with self._bench as rig, RigTelemetry(rig) as telemetry:
            await rig.stop()  # it may still turn after a crash
            await self.interrupt_abandoned()
            self._telemetry, self._opening = telemetry, False
            _LOG.info("the rig is ready")
            try:
                await self._reopen.wait()
            finally:
                self._telemetry = None
                self._offline = "the table does not answer; it is being looked for"
                self._slot.cancel("interrupted", leaving=self._leaving)
                await self._slot.emptied()

    async def _stop(self, ending: Ending) -> None:
        """Stop the table; the run is told first, or it would take the stop for a fault."""
        self._slot.cancel(ending, leaving=self._leaving)
        try:
            if self._telemetry is not None:
                await self._bench.stop()
        finally:
            await self._slot.emptied()

    async def _require_empty_slot(self) -> None:
        """Refuse a second run; let one go first whose end is in the records already.

        Whoever saw that end may ask for the next run before our own loop has.

        Raises:
            RigBusyError: One is on.
        """
        run_id = self._slot.run_id
        if run_id is not None:
            run = await asyncio.to_thread(self._records.run, run_id)
            if run.state in ENDED:
                await self._slot.emptied()
        self._slot.require_empty()

    async def _same_request(self, idempotency: Idempotency) -> str | None:
        """Return the run that the same request has begun before.

        Raises:
            IdempotencyKeyUsedError: Its key came with another body.
        """
        run = await asyncio.to_thread(self._records.same_request, idempotency.key)
        if run is None:
            return None
        if run.idempotency != idempotency:
            msg = (
                f"the idempotency key {idempotency.key!r} came with another body before, for run "
                f"{run.id}: choose a new key for a new run"
            )
            raise IdempotencyKeyUsedError(msg)
        return run.id


async def _wait(event: asyncio.Event, timeout_s: float) -> None:
    """Wait for an event, but not longer."""
    try:
        async with asyncio.timeout(timeout_s):
            await event.wait()
    except TimeoutError:
        return
