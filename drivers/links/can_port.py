"""One instrument's part of a CAN bus: filters and an inbox of its own; the bus is shared."""

import asyncio
from collections.abc import Sequence
from typing import Protocol

from drivers.errors import TransportError
from drivers.interfaces import CanArrivals, CanFilter, CanFrame
from drivers.links.inbox import FrameInbox

_REMEMBERED = 1024  # identifiers; a bus has some dozens


class Bus(Protocol):
    """What a port stands on."""

    @property
    def name(self) -> str:
        """Return what messages call the bus."""

    @property
    def error_frames(self) -> int:
        """Return how many errors the controller has reported since the bus was opened."""

    async def join(self, port: "CanPort") -> None:
        """Hand every frame to this port too, from now on; the first opens the bus.

        Raises:
            TransportError: The interface is absent, down or busy.
        """

    async def leave(self, port: "CanPort") -> None:
        """Hand it nothing any more; the last closes the bus."""

    def send(self, frame: CanFrame, sender: "CanPort") -> None:
        """Put a frame on the bus.

        Raises:
            TransportError: The bus is off or gone, or takes nothing.
        """


class CanPort:
    """A driver's ``CanLink``.

    Args:
        bus: The bus.

    Attributes:
        filters: What it lets through; None is everything.
    """

    def __init__(self, bus: Bus) -> None:
        self.filters: Sequence[CanFilter] | None = None
        self._passing: dict[tuple[int, bool], bool] = {}  # what the filters said of an identifier
        self._bus = bus
        self._inbox: FrameInbox | None = None

    @property
    def name(self) -> str:
        """Return the bus's name."""
        return self._bus.name

    @property
    def error_frames(self) -> int:
        """Return how many errors the controller has reported since the bus was opened."""
        return self._bus.error_frames

    async def open(self) -> None:
        """Open; frames sent before are gone."""
        await self.close()
        self._inbox = FrameInbox(self.name)
        try:
            await self._bus.join(self)
        except BaseException:
            self._inbox = None
            raise

    async def close(self) -> None:
        """Leave the bus."""
        if self._inbox is not None:
            self._inbox = None
            await self._bus.leave(self)

    async def write(self, frame: CanFrame) -> None:
        """Send a frame."""
        self.post(frame)

    def post(self, frame: CanFrame) -> None:
        """Send a frame at once: a bus takes it or refuses it, and there is nothing to await.

        Raises:
            TransportError: The bus is off or gone, or takes nothing.
        """
        self._opened().check()
        self._bus.send(frame, self)

    async def read(self, timeout_s: float) -> CanArrivals:
        """Return every frame since the last read."""
        return await self._opened().get(timeout_s)

    def set_filters(self, filters: Sequence[CanFilter]) -> None:
        """Let only these frames through, from the next opening on."""
        self.filters = tuple(filters)
        self._passing.clear()

    def receive(self, frame: CanFrame, arrival_s: float) -> None:
        """Take a frame that the filters let through."""
        if self._inbox is not None and self.wants(frame):
            self._inbox.put(frame, arrival_s)

    def take(self, frame: CanFrame) -> None:
        """Take a frame that is wanted, now."""
        if self._inbox is not None:
            self._inbox.put(frame, asyncio.get_running_loop().time())

    def fail(self, error: TransportError) -> None:
        """Fail the pending read and every later call until the link is opened again."""
        if self._inbox is not None:
            self._inbox.fail(error)

    def wants(self, frame: CanFrame) -> bool:
        """Say whether the filters let frames of this identifier through."""
        if self.filters is None:
            return True
        key = frame.can_id, frame.extended
        wants = self._passing.get(key)
        if wants is None:
            if len(self._passing) >= _REMEMBERED:
                self._passing.clear()
            wants = self._passing[key] = any(one.passes(frame) for one in self.filters)
        return wants

    def _opened(self) -> FrameInbox:
        if self._inbox is None:
            msg = f"{self.name} is not open"
            raise TransportError(msg)
        return self._inbox
