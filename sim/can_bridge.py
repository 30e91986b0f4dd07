"""Simulated nodes on a bus where other programs are: what may concern them is passed both ways."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from drivers.errors import LinkTimeoutError, TransportError
from drivers.interfaces import CanFilter, CanFrame
from drivers.links.can_port import CanPort
from drivers.links.memory_can import MemoryBus

_TICK_S = 0.5
_RETRY_S = 1.0
#: No device here takes a frame of 29 bits; what others fill a bus with often has them.
_STANDARD = CanFilter(0, 0)


@asynccontextmanager
async def bridged(bus: MemoryBus, outside: CanPort) -> AsyncIterator[None]:
    """Join a bus in memory to one outside while the context lasts.

    An interface that fails later is opened again until it works: the devices live on meanwhile.

    Raises:
        TransportError: The outside cannot be opened to begin with.
    """
    bridge = _Bridge(bus, outside)
    outside.set_filters([_STANDARD])
    await outside.open()
    bus.attach(bridge.leave)
    task = asyncio.create_task(bridge.enter_for_ever(), name=f"bridge to {outside.name}")
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait([task])
        bus.detach(bridge.leave)
        await outside.close()


class _Bridge:
    """Frames in both directions."""

    def __init__(self, bus: MemoryBus, outside: CanPort) -> None:
        self._bus = bus
        self._outside = outside

    def leave(self, frame: CanFrame) -> None:
        """Pass a device's frame on; a bus that takes nothing loses it, as any bus does."""
        with contextlib.suppress(TransportError):
            self._outside.post(frame)

    async def enter_for_ever(self) -> None:
        """Pass every frame that came in to the devices."""
        while True:
            try:
                arrivals = await self._outside.read(_TICK_S)
            except LinkTimeoutError:
                continue
            except TransportError:
                await self._open_again()
                continue
            for frame in arrivals.frames:
                self._bus.put(frame, self.leave)

    async def _open_again(self) -> None:
        while True:
            await asyncio.sleep(_RETRY_S)
            with contextlib.suppress(TransportError):
                await self._outside.open()
                return
