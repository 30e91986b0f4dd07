"""The rig as everyone sees it: asked once per tick, whoever and however many listen."""

import asyncio
import json
import logging
from collections.abc import AsyncIterator
from typing import Any

from starlette.concurrency import run_in_threadpool

from northfinder.config import RigConfig
from northfinder.formatting import sentence_of
from northfinder.ports import SIMULATED, links
from northfinder.records import Records, RecordsError
from northfinder.service.errors import RigOfflineError
from northfinder.service.rig_thread import RigThread
from northfinder.service.worker import Worker
from northfinder.software import version

JsonObject = dict[str, Any]

_LOG = logging.getLogger(__name__)
_MOVING_S = 0.05
_STILL_S = 0.5
_HOUSEKEEPING_S = 2.0


_UNREACHED: JsonObject = {
    "state": "offline",
    "run_id": None,
    "last_run_id": None,
    "table": None,
    "devices": [],
    "database": {"ok": True, "detail": None},
}


class RigFeed:
    """`GET /rig`, and the stream of it; belongs to the web's loop.

    Args:
        config: The rig, its latitude filled in.
        thread: Where it is asked.
    """

    def __init__(self, config: RigConfig, thread: RigThread) -> None:
        self._thread = thread
        self._fixed: JsonObject = {
            "name": config.site.name,
            "site": {**config.site.model_dump(mode="json"), "gravity_g": config.site.gravity_g},
            "simulated": SIMULATED in links(config),
            "speed": config.simulation.speed,
            "software": {"version": version()},
        }
        self._unreadable: str | None = None
        self._latest = ""
        self._ticks = 0
        self._tick = asyncio.Event()
        self._wake = asyncio.Event()
        self._closed = False
        self.listeners = 0

    async def snapshot(self) -> JsonObject:
        """Ask the rig now.

        Raises:
            RigOfflineError: Its thread does not answer.
        """
        seen = await self._thread.call(Worker.snapshot)
        detail = seen.pop("records_trouble") or self._unreadable
        return {**self._fixed, **seen, "database": {"ok": detail is None, "detail": detail}}

    async def follow(self) -> AsyncIterator[str]:
        """Yield the rig's JSON at every tick; whoever is slow misses ticks, not the latest."""
        self.listeners += 1
        self._wake.set()
        seen = self._ticks
        try:
            while not self._closed:
                if self._ticks == seen:
                    await self._tick.wait()
                    continue
                seen = self._ticks
                yield self._latest
        finally:
            self.listeners -= 1

    def wake(self) -> None:
        """Something has changed: do not wait for the next tick of a rig at rest."""
        self._wake.set()

    def close(self) -> None:
        """End every stream."""
        self._closed = True
        self._tick.set()

    async def keep_asking(self) -> None:
        """Ask the rig while somebody listens, for ever."""
        while True:
            if not self.listeners:
                self._wake.clear()
                await self._wake.wait()
            moves = await self._publish()
            await self._pause(moves=moves)

    async def keep_house(self, records: Records) -> None:
        """See whether the records can be read, and whether a run was abandoned, for ever."""
        while True:
            try:
                await run_in_threadpool(records.page, 1)
                self._unreadable = None
                await self._thread.call(Worker.interrupt_abandoned)
            except RecordsError as error:
                self._unreadable = sentence_of(error)
            except RigOfflineError as error:
                _LOG.warning("%s", sentence_of(error))
            await asyncio.sleep(_HOUSEKEEPING_S)

    async def _pause(self, *, moves: bool) -> None:
        if moves:
            await asyncio.sleep(_MOVING_S)
            return
        self._wake.clear()
        try:
            async with asyncio.timeout(_STILL_S):
                await self._wake.wait()
        except TimeoutError:
            return

    async def _publish(self) -> bool:
        """Put the rig's present state before every listener; say whether it is doing something."""
        try:
            rig = await self.snapshot()
        except RigOfflineError as error:
            rig = {**self._fixed, **_UNREACHED, "detail": sentence_of(error)}
        self._latest = json.dumps(rig)
        self._ticks += 1
        self._tick.set()
        self._tick = asyncio.Event()  # whoever waits for the next tick waits for this one
        return rig["state"] == "busy" or bool(rig["table"] and rig["table"]["moving"])
