"""The one run that a rig carries out, until its end is in the records."""

import asyncio
import logging

import structlog

from drivers.errors import DriverError
from northfinder.errors import NorthfinderError
from northfinder.formatting import sentence_of
from northfinder.recording import Ending, RecordedRun
from northfinder.records import RecordsError
from northfinder.service.errors import RigBusyError

_LOG = logging.getLogger(__name__)
_RETRY_S = 2.0
_END_S = 5.0


class RunSlot:
    """Empty, or holding a run; belongs to the rig's loop.

    Attributes:
        trouble: Why the records took the last write not; None where they did.
        last_run_id: The run that is on, or the last that was; None before the first.
    """

    def __init__(self) -> None:
        self.trouble: str | None = None
        self.last_run_id: str | None = None
        self._run: RecordedRun | None = None
        self._task: asyncio.Task[None] | None = None
        self._measuring = False

    @property
    def run(self) -> RecordedRun | None:
        """Return the run that is on."""
        return self._run

    @property
    def run_id(self) -> str | None:
        """Return its id."""
        return None if self._run is None else self._run.id

    def require_empty(self) -> None:
        """Refuse a second run.

        Raises:
            RigBusyError: One is on.
        """
        if self._run is not None:
            raise RigBusyError(self._run.id)

    def fill(self, run: RecordedRun) -> None:
        """Begin to carry a run out."""
        self._run = run
        self.last_run_id = run.id
        self._measuring = True
        self._task = asyncio.create_task(self._until_settled(run), name=f"run {run.id}")

    def cancel(self, ending: Ending, *, leaving: bool) -> None:
        """End the run; one that has ended is left to write that down, unless the process ends."""
        if self._run is not None and self._task is not None:
            self._run.cancelled_as = ending
            if self._measuring or leaving:
                # Not before its first step: a run that never began would write no end.
                asyncio.get_running_loop().call_soon(self._task.cancel)

    async def emptied(self) -> None:
        """Wait until the run has ended; records that take no writes must not hold us up."""
        if self._task is not None:
            await asyncio.wait([self._task], timeout=_END_S)

    def note_trouble(self, error: RecordsError) -> None:
        """Remember that the records failed; said in the log once."""
        sentence = sentence_of(error)
        if sentence != self.trouble:
            _LOG.warning("%s", sentence)
        self.trouble = sentence

    def note_success(self) -> None:
        """Forget the trouble, unless something is still to be written."""
        if self._run is None or self._run.settled:
            self.trouble = None

    async def _until_settled(self, run: RecordedRun) -> None:
        structlog.contextvars.bind_contextvars(run_id=run.id)  # of this task's context alone
        try:
            await self._measure(run)
            while not run.settled:
                await self._settle(run)
        finally:
            if not run.settled:
                _LOG.error("the end of run %s could not be written", run.id)
            self._run = self._task = None

    async def _measure(self, run: RecordedRun) -> None:
        try:
            await run.carry_out()
        except asyncio.CancelledError:
            _LOG.info("run %s was ended: %s", run.id, run.cancelled_as)
        except (NorthfinderError, DriverError) as error:
            _LOG.warning("run %s failed: %s", run.id, sentence_of(error))
        except Exception:  # noqa: BLE001 -- the record says so too, and the worker lives on
            _LOG.exception("run %s failed by a defect", run.id)
        finally:
            self._measuring = False

    async def _settle(self, run: RecordedRun) -> None:
        try:
            await run.settle()
        except RecordsError as error:
            self.note_trouble(error)
            await asyncio.sleep(_RETRY_S)
        else:
            self.note_success()
