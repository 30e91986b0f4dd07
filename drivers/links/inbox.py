"""What has arrived on a link and was not read yet."""

import asyncio

from drivers.errors import LinkTimeoutError, TransportError
from drivers.interfaces import Chunk

_CAPACITY_BYTES = 1 << 22  # a minute of KVH; a driver that far behind has stopped reading


class Inbox:
    """Bytes with their arrival, handed over in one piece; bounded, and never waited on for ever.

    Args:
        name: The link's name, for messages.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._buffer = bytearray()
        self._arrival_s = 0.0
        self._failure: TransportError | None = None
        self._changed = asyncio.Event()

    def put(self, data: bytes, arrival_s: float) -> None:
        """Add bytes; where nobody reads, the oldest are overrun, as on any port."""
        if self._failure is not None:
            return  # a port that came back has to be opened again
        self._buffer += data
        del self._buffer[:-_CAPACITY_BYTES]
        self._arrival_s = arrival_s
        self._changed.set()

    def fail(self, error: TransportError) -> None:
        """End it: once what arrived before is read, every ``get`` raises this."""
        self._failure = error
        self._changed.set()

    def check(self) -> None:
        """Raise what the link failed with, if it has.

        Raises:
            TransportError: The link has failed.
        """
        if self._failure is not None:
            raise self._failure

    async def get(self, timeout_s: float) -> Chunk:
        """Return everything that has arrived.

        Raises:
            LinkTimeoutError: Nothing within ``timeout_s``.
            TransportError: The link has failed.
        """
        if not self._buffer and self._failure is None:
            await self._wait(timeout_s)
        if not self._buffer:
            self.check()
        chunk = Chunk(bytes(self._buffer), self._arrival_s)
        self._buffer.clear()
        return chunk

    async def _wait(self, timeout_s: float) -> None:
        self._changed.clear()
        try:
            async with asyncio.timeout(timeout_s):
                await self._changed.wait()
        except TimeoutError:
            msg = f"{self._name} was silent for {timeout_s:g} s"
            raise LinkTimeoutError(msg) from None
