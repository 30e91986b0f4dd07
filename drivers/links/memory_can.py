"""A CAN bus in memory: drivers and simulated nodes on it, within one event loop."""

from collections import deque
from collections.abc import Callable

from drivers.errors import TransportError
from drivers.interfaces import CanFrame
from drivers.links.can_port import CanPort

Receive = Callable[[CanFrame], None]
Wants = Callable[[CanFrame], bool]


_REMEMBERED = 1024  # identifiers; a bus has some dozens


class MemoryBus:
    """Hands every frame to every other participant, in one order for all, as a bus does.

    Args:
        name: What messages call the bus.

    Attributes:
        error_frames: Errors that a controller would have reported; frames damaged on purpose.
    """

    def __init__(self, name: str) -> None:
        self.error_frames = 0
        self._name = name
        self._participants: dict[Receive, Wants | None] = {}
        self._interested: dict[tuple[int, bool], list[Receive]] = {}
        self._ports: list[CanPort] = []
        self._waiting: deque[tuple[CanFrame, Receive]] = deque()
        self._handing_over = False
        self._failure: TransportError | None = None

    @property
    def name(self) -> str:
        """Return the name."""
        return self._name

    def attach(self, receive: Receive, wants: Wants | None = None) -> None:
        """Add a participant; it is told the frames that it has not sent itself.

        Args:
            receive: Told them.
            wants: Says by identifier which; without it, all.
        """
        self._participants[receive] = wants
        self._interested.clear()

    def detach(self, receive: Receive) -> None:
        """Take a participant off the bus."""
        del self._participants[receive]
        self._interested.clear()

    async def join(self, port: CanPort) -> None:
        """See :meth:`Bus.join`."""
        if self._failure is not None:
            raise self._failure
        self._ports.append(port)
        self.attach(port.take, port.wants)

    async def leave(self, port: CanPort) -> None:
        """See :meth:`Bus.leave`."""
        self._ports.remove(port)
        self.detach(port.take)

    def send(self, frame: CanFrame, sender: CanPort) -> None:
        """See :meth:`Bus.send`."""
        self.put(frame, sender.take)

    def put(self, frame: CanFrame, sender: Receive) -> None:
        """Put a frame on the bus; an answer that it provokes comes after it, for everyone."""
        if self._failure is not None:
            return
        if self._handing_over:
            self._waiting.append((frame, sender))
            return
        self._handing_over = True
        try:
            self._hand_over(frame, sender)
            while self._waiting:
                self._hand_over(*self._waiting.popleft())
        finally:
            self._handing_over = False

    def _hand_over(self, frame: CanFrame, sender: Receive) -> None:
        interested = self._interested.get((frame.can_id, frame.extended))
        for receive in self._interested_in(frame) if interested is None else interested:
            if receive != sender:
                receive(frame)

    def _interested_in(self, frame: CanFrame) -> list[Receive]:
        """Return who wants frames of this identifier; worked out once for each."""
        if len(self._interested) >= _REMEMBERED:
            self._interested.clear()
        interested = [
            receive
            for receive, wants in self._participants.items()
            if wants is None or wants(frame)
        ]
        self._interested[frame.can_id, frame.extended] = interested
        return interested

    def fail(self, reason: str) -> None:
        """Take the bus away from every driver: its pending read and every later call fail."""
        self._failure = TransportError(f"{self._name} {reason}")
        for port in self._ports:
            port.fail(self._failure)

    def mend(self) -> None:
        """Let it work again; each driver has to open its link again."""
        self._failure = None
