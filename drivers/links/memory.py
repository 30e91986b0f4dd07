"""A link in memory; its far end is whatever plays the device."""

import asyncio
from collections.abc import Callable

from drivers.errors import TransportError
from drivers.interfaces import Chunk
from drivers.links.inbox import Inbox


class MemoryLink:
    """Both ends of a byte stream within one event loop.

    The driver holds it as its ``Link``; the device side calls :meth:`deliver` and is called
    back with what the driver writes.

    Args:
        name: What messages call the link.
        on_write: Receives every write of the driver.
    """

    def __init__(self, name: str, on_write: Callable[[bytes], None]) -> None:
        self._name = name
        self._on_write = on_write
        self._inbox: Inbox | None = None
        self._plugged_in = True

    @property
    def name(self) -> str:
        """Return the name."""
        return self._name

    async def open(self) -> None:
        """Open; bytes sent before are gone, as on a port."""
        if not self._plugged_in:
            raise self._gone()
        self._inbox = Inbox(self._name)

    async def close(self) -> None:
        """Close; what the device sends from now on is lost."""
        self._inbox = None

    async def write(self, data: bytes) -> None:
        """Hand the bytes to the device at once."""
        self._opened().check()
        self._on_write(data)

    async def read(self, timeout_s: float) -> Chunk:
        """Return everything delivered since the last read."""
        return await self._opened().get(timeout_s)

    def set_baudrate(self, baudrate: int) -> None:
        """Memory has no line speed."""

    def deliver(self, data: bytes) -> None:
        """Send bytes from the device to the driver."""
        if self._inbox is not None and data:
            self._inbox.put(data, asyncio.get_running_loop().time())

    def unplug(self) -> None:
        """Pull the cable: the pending read and every later call fail until plugged in again."""
        self._plugged_in = False
        if self._inbox is not None:
            self._inbox.fail(self._gone())

    def plug_in(self) -> None:
        """Push the cable back in; the driver has to open the link again."""
        self._plugged_in = True

    def _opened(self) -> Inbox:
        if self._inbox is None:
            msg = f"{self._name} is not open"
            raise TransportError(msg)
        return self._inbox

    def _gone(self) -> TransportError:
        return TransportError(f"{self._name} is gone; check its cable")
