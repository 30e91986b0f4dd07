"""The rig's thread: its own event loop, away from the web's."""

import asyncio
import logging
import threading
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from northfinder.config import RigConfig
from northfinder.rig import Rig
from northfinder.service.errors import RigOfflineError
from northfinder.service.worker import Worker
from northfinder.wiring import event_loop

T = TypeVar("T")

_LOG = logging.getLogger(__name__)
_CALL_S = 15.0  # longer than any deadline of a driver
_JOIN_S = 1.0


class RigThread:
    """Runs a worker, and lets the web's loop call it.

    Args:
        config: The rig, its speed filled in.
        worker: Its worker; nobody else may touch it.
    """

    def __init__(self, config: RigConfig, worker: Worker) -> None:
        self._loop_factory = event_loop(config, 1.0)
        self._worker = worker
        self._loop: asyncio.AbstractEventLoop | None = None
        self._running = threading.Event()
        self._thread = threading.Thread(target=self._main, name="rig", daemon=True)

    def start(self) -> None:
        """Start the thread; returns once its loop takes calls."""
        self._thread.start()
        self._running.wait()

    async def call(self, job: Callable[[Worker], Coroutine[Any, Any, T]]) -> T:
        """Run a job on the rig's loop and wait for it; cancelling the wait leaves the job alone.

        Raises:
            RigOfflineError: The thread has ended, or does not answer in time.
        """
        if self._loop is None:
            reason = "its thread has ended; see the log, and start the service again"
            raise RigOfflineError(reason)
        future = asyncio.run_coroutine_threadsafe(job(self._worker), self._loop)
        try:
            async with asyncio.timeout(_CALL_S):
                return await asyncio.shield(asyncio.wrap_future(future))
        except TimeoutError:
            reason = f"it did not answer within {_CALL_S:g} s; look at its cables, then try again"
            raise RigOfflineError(reason) from None

    def rig(self) -> Rig:
        """Return the open rig, to read what does not change.

        Raises:
            RigOfflineError: It is not open.
        """
        return self._worker.rig()

    def carries_out(self, run_id: str) -> bool:
        """Say whether a run is the one that is on here."""
        return self._worker.run_id == run_id

    def will_pause(self, run_id: str) -> bool:
        """Say whether a run is paused, or about to be."""
        return self._worker.run_id == run_id and self._worker.is_pausing

    async def stop(self) -> None:
        """Stop the table and end the thread; a bench that does not answer is left alone."""
        if self._loop is None:
            return
        await self.call(Worker.shut_down)
        await asyncio.to_thread(self._thread.join, _JOIN_S)
        if self._thread.is_alive():
            _LOG.error("the rig's thread has not ended within %g s and is left behind", _JOIN_S)

    def _main(self) -> None:
        try:
            with asyncio.Runner(loop_factory=self._loop_factory) as runner:
                runner.run(self._serve())
        except Exception:  # noqa: BLE001 -- a thread's defect would be told to nobody
            _LOG.exception("the rig's thread has ended by a defect")
        finally:
            self._loop = None
            self._running.set()

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._running.set()
        await self._worker.serve()
