"""The rig's worker: keeps the bench open, one run at a time, the table stopped at every end.

Everything here runs on the rig's own loop, in its own thread (`rig_thread`).
"""

import asyncio
import logging
from typing import Any

import structlog

from drivers.errors import DriverError
from northfinder.errors import NorthfinderError
from northfinder.formatting import sentence_of
from northfinder.procedures.north_seek import Plan
from northfinder.recording import Ending, Publish, RecordedRun, begin, resume
from northfinder.records import (
    Idempotency,
    IdempotencyKeyUsedError,
    Records,
    RecordsError,
    Run,
    Writer,
)
from northfinder.rig import Rig, Simulation
from northfinder.service.errors import RigBusyError, RigOfflineError
from northfinder.telemetry import RigTelemetry

JsonObject = dict[str, Any]

_LOG = logging.getLogger(__name__)
_RETRY_S = 2.0
_END_S = 5.0


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
        self._rig: Rig | None = None  # the bench while it is open
        self._telemetry: RigTelemetry | None = None
        self._offline = "the instruments are being opened"
        self._opening = True
        self._run: RecordedRun | None = None
        self._task: asyncio.Task[None] | None = None
        self._settling = False
        self._starting = asyncio.Lock()
        self._records_trouble: str | None = None
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
            if self._rig is not None:
                await self._stop(self._rig, "interrupted")
        except DriverError as error:
            _LOG.error("the table did not confirm that it stopped: %s", sentence_of(error))
        finally:
            self._reopen.set()

    async def interrupt_abandoned(self) -> None:
        """Mark this rig's runs whose process is gone; they can be resumed then."""
        try:
            events = await self._writer.interrupt_abandoned(self._bench.name)
        except RecordsError as error:
            self._note_trouble(error)
            return
        for event in events:
            _LOG.warning("run %s was abandoned by its process: interrupted", event.run_id)
            self._publish(event)

    async def start(self, plan: Plan, idempotency: Idempotency | None) -> str:
        """Begin a run and return its id.

        Raises:
            IdempotencyKeyUsedError: The key belongs to another request.
            RigBusyError: Another one is on.
            RigOfflineError: The instruments are not there.
            ConfigError: The plan cannot be carried out.
            RecordsError: It cannot be recorded.
        """
        async with self._starting:
            if earlier := await self._same_request(idempotency):
                return earlier
            rig = self._free_rig()
            run = await begin(rig, plan, self._writer, self._publish, idempotency)
            self._carry_out(run)
            return run.id

    async def _same_request(self, idempotency: Idempotency | None) -> str | None:
        """Return the run that the same request has begun before.

        Raises:
            IdempotencyKeyUsedError: Its key came with another body.
        """
        if idempotency is None:
            return None
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

    async def resume(self, run: Run) -> None:
        """Carry a failed or interrupted run on, or let a paused one continue.

        Raises:
            RigBusyError: Another one is on.
            RigOfflineError: The instruments are not there.
            ConfigError: The bench is not what it was.
            RecordsError: Its samples are damaged, or the records cannot be used.
        """
        async with self._starting:
            if self._run is not None and self._run.id == run.id:
                self._run.gate.open()
                return
            rig = self._free_rig()
            revived = await asyncio.to_thread(
                resume, rig, self._records, run, self._writer, self._publish
            )
            self._carry_out(revived)

    async def pause(self, run_id: str) -> bool:
        """Have the run wait after the present visit; False where it is not the one that is on."""
        if self._run is None or self._run.id != run_id:
            return False
        self._run.gate.close()
        return True

    async def abort(self, run_id: str) -> bool:
        """End the run now; False where it is not the one that is on."""
        if self._run is None or self._run.id != run_id:
            return False
        await self._stop(self.rig(), "aborted")
        return True

    async def stop(self) -> str | None:
        """Stop the table at once and abort the run; return the run's id.

        Raises:
            RigOfflineError: There is no table to be reached.
            DriverError: The table did not confirm that it stands.
        """
        run_id = self.run_id
        await self._stop(self.rig(), "aborted")
        return run_id

    @property
    def run_id(self) -> str | None:
        """Return the id of the run that is on."""
        return None if self._run is None else self._run.id

    @property
    def is_pausing(self) -> bool:
        """Return whether the run that is on waits, or will after the present visit."""
        return self._run is not None and not self._run.gate.is_open

    def rig(self) -> Rig:
        """Return the open rig.

        Raises:
            RigOfflineError: It is not open; the message says why.
        """
        if self._rig is None:
            raise RigOfflineError(self._offline)
        return self._rig

    @property
    def simulation(self) -> Simulation | None:
        """Return the simulated world, also of a rig that is offline: its faults can be mended."""
        return self._bench.simulation

    def warn_of_change(self, changes: JsonObject) -> None:
        """Tell the run that is on of a change of the simulated world."""
        if self._run is not None:
            what = ", ".join(f"{key} = {value}" for key, value in changes.items())
            self._run.warn(f"The simulated world was changed during the run: {what}.")

    async def snapshot(self) -> JsonObject:
        """Return what changes of `GET /rig`: state, table, devices."""
        if self._telemetry is None:
            state = "starting" if self._opening else "offline"
            return {
                "state": state,
                "detail": self._offline,
                "run_id": self.run_id,
                "records_trouble": self._records_trouble,
                "table": None,
                "devices": self._unreached(),
            }
        seen = await self._telemetry.snapshot()
        if seen["table"] is None and self._run is None:
            self._reopen.set()
        return {
            "state": "ready" if self._run is None else "busy",
            "detail": None,
            "run_id": self.run_id,
            "records_trouble": self._records_trouble,
            **seen,
        }

    async def _keep_open(self) -> None:
        async with self._bench as rig, RigTelemetry(rig) as telemetry:
            await rig.stop()  # it may still turn after a crash
            await self.interrupt_abandoned()
            self._rig, self._telemetry, self._opening = rig, telemetry, False
            _LOG.info("the rig is ready")
            try:
                await self._reopen.wait()
            finally:
                self._rig = self._telemetry = None
                self._offline = "the table does not answer; it is being looked for"
                await self._end_run("interrupted")

    def _carry_out(self, run: RecordedRun) -> None:
        self._run = run
        self._settling = False
        self._task = asyncio.create_task(self._until_settled(run), name=f"run {run.id}")

    async def _until_settled(self, run: RecordedRun) -> None:
        """Carry a run out; the rig is busy until its end is in the records."""
        structlog.contextvars.bind_contextvars(run_id=run.id)  # of this task's context alone
        try:
            await run.carry_out()
        except asyncio.CancelledError:
            _LOG.info("run %s was ended: %s", run.id, run.cancelled_as)
        except (NorthfinderError, DriverError) as error:
            _LOG.warning("run %s failed: %s", run.id, sentence_of(error))
        except Exception:  # noqa: BLE001 -- the record says so too, and the worker lives on
            _LOG.exception("run %s failed by a defect", run.id)
        self._settling = True
        try:
            while not run.settled:
                await self._settle(run)
        finally:
            if not run.settled:
                _LOG.error("the end of run %s could not be written", run.id)
            self._run = self._task = None

    async def _settle(self, run: RecordedRun) -> None:
        try:
            await run.settle()
        except RecordsError as error:
            self._note_trouble(error)
            await asyncio.sleep(_RETRY_S)
        else:
            self._records_trouble = None

    async def _stop(self, rig: Rig, ending: Ending) -> None:
        """Stop the table; the run is told first, or it would take the stop for a fault."""
        task = self._cancel_run(ending)
        try:
            await rig.stop()
        finally:
            await _ended(task)

    async def _end_run(self, ending: Ending) -> None:
        await _ended(self._cancel_run(ending))

    def _cancel_run(self, ending: Ending) -> asyncio.Task[None] | None:
        """End the run that is on; one that has ended is left to write that down, until we leave."""
        if self._run is not None and self._task is not None:
            self._run.cancelled_as = ending
            if not self._settling or self._leaving:
                self._task.cancel()
        return self._task

    def _unreached(self) -> list[JsonObject]:
        """Return what is known of the devices without having reached them."""
        return [
            {
                "role": role,
                "driver": getattr(self._bench.config, role).driver,
                "link": getattr(self._bench.config, role).link,
                "identity": None,
                "state": "offline",
                "detail": self._offline,
                "rate_hz": None,
                "temperature_deg_c": None,
                "reading": None,
                "reading_unit": None,
                "counters": {"frames": 0, "crc_errors": 0, "lost": 0, "reconnects": 0},
            }
            for role in ("turntable", "gyro", "accelerometer")
        ]

    def _free_rig(self) -> Rig:
        if self._run is not None:
            raise RigBusyError(self._run.id)
        return self.rig()

    def _note_trouble(self, error: RecordsError) -> None:
        sentence = sentence_of(error)
        if sentence != self._records_trouble:
            _LOG.warning("%s", sentence)
        self._records_trouble = sentence


async def _ended(task: asyncio.Task[None] | None) -> None:
    """Wait until a run's task has ended; records that take no writes must not hold us up."""
    if task is not None:
        await asyncio.wait([task], timeout=_END_S)


async def _wait(event: asyncio.Event, timeout_s: float) -> None:
    """Wait for an event, but not longer."""
    try:
        async with asyncio.timeout(timeout_s):
            await event.wait()
    except TimeoutError:
        return
