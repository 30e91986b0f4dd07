"""What has arrived on a link and was not read yet."""

import asyncio
from abc import ABC, abstractmethod
from collections import deque
from typing import Generic, TypeVar

from drivers.errors import LinkTimeoutError, TransportError
from drivers.interfaces import CanArrivals, CanFrame, Chunk

_CAPACITY_BYTES = 1 << 22  # a minute of KVH; a driver that far behind has stopped reading
_CAPACITY_FRAMES = 1 << 17  # a quarter of a minute of a full bus

T = TypeVar("T", Chunk, CanArrivals)


class _Box(ABC, Generic[T]):
    """Hands over in one piece what has arrived; bounded, and never waited on for ever.

    Args:
        name: The link's name, for messages.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._failure: TransportError | None = None
        self._changed = asyncio.Event()

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

    async def get(self, timeout_s: float, gather_s: float = 0.0) -> T:
        """Return everything that has arrived.

        Args:
            timeout_s: To wait for the first of it.
            gather_s: To wait then for more: one large piece costs less than many small ones.

        Raises:
            LinkTimeoutError: Nothing within ``timeout_s``.
            TransportError: The link has failed.
        """
        if self._empty() and self._failure is None:
            await self._wait(timeout_s)
        if gather_s and self._failure is None:
            await asyncio.sleep(gather_s)
        if self._empty():
            self.check()
        return self._take()

    @abstractmethod
    def _empty(self) -> bool: ...

    @abstractmethod
    def _take(self) -> T: ...

    async def _wait(self, timeout_s: float) -> None:
        self._changed.clear()
        try:
            async with asyncio.timeout(timeout_s):
                await self._changed.wait()
        except TimeoutError:
            msg = f"{self._name} was silent for {timeout_s:g} s"
            raise LinkTimeoutError(msg) from None


class Inbox(_Box[Chunk]):
    """Bytes with their arrival."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._buffer = bytearray()
        self._arrival_s = 0.0

    def put(self, data: bytes, arrival_s: float) -> None:
        """Add bytes; where nobody reads, the oldest are overrun, as on any port."""
        if self._failure is not None:
            return  # a port that came back has to be opened again
        self._buffer += data
        del self._buffer[:-_CAPACITY_BYTES]
        self._arrival_s = arrival_s
        self._changed.set()

    def _empty(self) -> bool:
        return not self._buffer

    def _take(self) -> Chunk:
        chunk = Chunk(bytes(self._buffer), self._arrival_s)
        self._buffer.clear()
        return chunk


class FrameInbox(_Box[CanArrivals]):
    """CAN frames with their arrivals."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._arrived: deque[tuple[CanFrame, float]] = deque(maxlen=_CAPACITY_FRAMES)

    def put(self, frame: CanFrame, arrival_s: float) -> None:
        """Add a frame; where nobody reads, the oldest are overrun, as in any controller."""
        if self._failure is None:  # a bus that came back has to be opened again
            self._arrived.append((frame, arrival_s))
            self._changed.set()

    def _empty(self) -> bool:
        return not self._arrived

    def _take(self) -> CanArrivals:
        frames, times_s = (list(part) for part in zip(*self._arrived, strict=True))
        self._arrived.clear()
        return CanArrivals(frames, times_s)
