"""A CAN adapter on a serial line, by the Lawicel CANUSB manual's ASCII commands: ``slcan``.

With it simulated nodes can be reached where the kernel has no CAN: any program that speaks slcan
opens the pseudo-terminal as it would open ``/dev/ttyACM0``.
"""

import re
from collections.abc import Callable
from typing import ClassVar

from drivers.interfaces import CanFrame, Transport
from drivers.links.memory_can import MemoryBus

_OK, _BELL = b"\r", b"\a"
_LONGEST = 64  # characters; a frame with an extended identifier and eight bytes has 26
_OPEN_OR_CLOSE = ("O", "L", "C")
_FIXED = {"V": b"V1013\r", "v": b"v1013\r", "N": b"N0001\r", "F": b"F00\r"}
#: Manual, chapter 2: bit rate, bit timing, acceptance, time stamps, polling: taken and ignored.
_SETTINGS = re.compile(r"S[0-8]|s[0-9A-Fa-f]{4,6}|[Mm][0-9A-Fa-f]{8}|Z[01]|X[01]|W[0-2]|U[0-6]|")
_FRAME = re.compile(
    r"(?P<kind>[tr])(?P<id>[0-7][0-9A-Fa-f]{2})(?P<count>[0-8])(?P<data>(?:[0-9A-Fa-f]{2})*)"
    r"|(?P<KIND>[TR])(?P<ID>[01][0-9A-Fa-f]{7})(?P<COUNT>[0-8])(?P<DATA>(?:[0-9A-Fa-f]{2})*)"
)


class SlcanAdapter:
    """The adapter between a serial line and a bus in memory.

    Args:
        bus: The bus that the nodes are on.
    """

    transport: ClassVar[Transport] = "serial"

    def __init__(self, bus: MemoryBus) -> None:
        self._bus = bus
        self._send: Callable[[bytes], None] = lambda _: None
        self._buffer = bytearray()
        self._is_open = False
        bus.attach(self._to_line)

    def connect(self, send: Callable[[bytes], None]) -> None:
        """Send every answer and frame through ``send`` from now on."""
        self._send = send

    def receive_data(self, data: bytes) -> None:
        """Take bytes from the client, cut anywhere."""
        self._buffer += data
        while (end := self._buffer.find(b"\r")) >= 0:
            line = self._buffer[:end].decode("latin-1")
            del self._buffer[: end + 1]
            self._send(self._answer(line.strip("\n")))
        del self._buffer[:-_LONGEST]

    def _answer(self, line: str) -> bytes:
        if line in _OPEN_OR_CLOSE:
            self._is_open = line != "C"
            return _OK
        if line in _FIXED:
            return _FIXED[line]
        return _OK if _SETTINGS.fullmatch(line) else self._transmit(line)

    def _transmit(self, line: str) -> bytes:
        """Put a frame on the bus; `z` and `Z` confirm it, the bell refuses it."""
        found = _FRAME.fullmatch(line)
        if found is None or not self._is_open:
            return _BELL
        extended = found["KIND"] is not None
        kind, can_id, count, data = (
            found.group("KIND", "ID", "COUNT", "DATA")
            if extended
            else found.group("kind", "id", "count", "data")
        )
        remote = kind in "rR"
        if not remote and len(data) != 2 * int(count):
            return _BELL
        frame = CanFrame(int(can_id, 16), bytes.fromhex(data), extended, remote)
        self._bus.put(frame, self._to_line)
        return b"Z\r" if extended else b"z\r"

    def _to_line(self, frame: CanFrame) -> None:
        if not self._is_open or len(frame.data) > 8:
            return
        letter = "r" if frame.remote else "t"
        can_id = f"{frame.can_id:03X}"
        if frame.extended:
            letter, can_id = letter.upper(), f"{frame.can_id:08X}"
        self._send(f"{letter}{can_id}{len(frame.data)}{frame.data.hex().upper()}\r".encode())
