"""A link in memory; its far end is whatever plays the device."""

import asyncio
from collections.abc import Callable

from drivers.errors import LinkTimeoutError, TransportError
from drivers.interfaces import Chunk

_CAPACITY_BYTES = 1 << 22  # what a driver that stopped reading may pile up before it is told


class MemoryLink:
    """Both ends of a byte stream within one event loop.

    The driver holds it as its ``Link``; the device side calls :meth:`deliver` and is called
    back with what the driver writes. ``connected`` unplugs the cable, for tests of that.

    Args:
        name: What messages call the link.
        on_write: Receives every write of the driver.
    """

    def __init__(self, name: str, on_write: Callable[[bytes], None]) -> None:
        self._name = name
        self._on_write = on_write
        self._buffer = bytearray()
        self._arrival_s = 0.0
        self._arrived = asyncio.Event()
        self._open = False
        self.connected = True

    @property
    def name(self) -> str:
        """Return the name."""
        return self._name

    async def open(self) -> None:
        """Open; bytes sent before are gone, as on a port."""
        self._check_cable()
        self._buffer.clear()
        self._arrived.clear()
        self._open = True

    async def close(self) -> None:
        """Close; what the device sends from now on is lost."""
        self._open = False

    async def write(self, data: bytes) -> None:
        """Hand the bytes to the device at once."""
        self._check_open()
        self._on_write(data)

    async def read(self, timeout_s: float) -> Chunk:
        """Return everything delivered since the last read."""
        self._check_open()
        if not self._buffer:
            await self._wait(timeout_s)
            self._check_open()
        data = bytes(self._buffer)
        self._buffer.clear()
        self._arrived.clear()
        return Chunk(data, self._arrival_s)

    def set_baudrate(self, baudrate: int) -> None:
        """Memory has no line speed."""

    def deliver(self, data: bytes) -> None:
        """Send bytes from the device to the driver."""
        if not (self._open and self.connected):
            return
        if len(self._buffer) + len(data) > _CAPACITY_BYTES:
            self._buffer.clear()  # as a serial port does: the oldest are overrun
        self._buffer += data
        self._arrival_s = asyncio.get_running_loop().time()
        self._arrived.set()

    def unplug(self) -> None:
        """Pull the cable: the pending read and every later call fail until plugged in."""
        self.connected = False
        self._arrived.set()

    async def _wait(self, timeout_s: float) -> None:
        try:
            async with asyncio.timeout(timeout_s):
                await self._arrived.wait()
        except TimeoutError:
            msg = f"{self._name} was silent for {timeout_s:g} s"
            raise LinkTimeoutError(msg) from None

    def _check_open(self) -> None:
        self._check_cable()
        if not self._open:
            msg = f"{self._name} is not open"
            raise TransportError(msg)

    def _check_cable(self) -> None:
        if not self.connected:
            msg = f"{self._name} is gone; check its cable"
            raise TransportError(msg)
