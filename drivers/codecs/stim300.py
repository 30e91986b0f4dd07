"""STIM300 datagrams from any chopping of the byte stream (Safran Sensing, TS1524 rev 31).

The IDs are single bytes that occur in payloads all the time, so a datagram is recognised by its
CRC and by nothing less.
"""

from drivers.codecs.stim300_data import (
    CRC_SIZE,
    LAYOUTS,
    TERMINATION,
    DataBlock,
    Layout,
    crc_of,
    decode_data,
)
from drivers.codecs.stim300_special import SPECIAL_SIZES, Special, decode_special
from drivers.codecs.stim300_utility import UtilityReply, decode_reply, measure_reply

Event = DataBlock | Special | UtilityReply

_SIZES = SPECIAL_SIZES | {identifier: layout.size for identifier, layout in LAYOUTS.items()}
_REPLY = ord("#")
_CAPACITY_BYTES = 1 << 22  # half a minute at the highest rate

#: Normal-mode commands (section 8): not echoed, answered by a datagram in place of the next one.
ASK_PART_NUMBER = b"N\r"
ASK_SERIAL_NUMBER = b"I\r"
ASK_CONFIGURATION = b"C\r"
ASK_BIAS_TRIM = b"T\r"
ASK_EXTENDED_ERROR = b"E\r"
RESET = b"R\r"
ENTER_UTILITY_MODE = b"UTILITYMODE\r"


class Stim300Decoder:
    """Turn bytes into events: blocks of normal-mode datagrams, single ones, utility replies.

    Feed with :meth:`receive_data`, drain with :meth:`next_event`; drained, it holds less than
    one datagram or utility line, and what nobody drains is bounded. The datagrams are the same
    for every way of cutting the stream, only the blocks that bundle them follow the cuts.

    Attributes:
        crc_errors: How often the stream was in step and the next bytes were no good datagram.
            What is found wrong while searching the next good one is not counted again.
        discarded_bytes: Bytes that belonged to no good datagram.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._in_step = False
        self._termination_due = False
        self.crc_errors = 0
        self.discarded_bytes = 0

    def receive_data(self, data: bytes) -> None:
        """Append raw bytes; nothing is decoded yet."""
        self._buffer += data
        overrun = max(0, len(self._buffer) - _CAPACITY_BYTES)
        if overrun:
            del self._buffer[:overrun]
            self.discarded_bytes += overrun
            self._in_step = False

    def next_event(self) -> Event | None:
        """Return the next event, or ``None`` when more bytes are needed."""
        while self._buffer and not self._awaits_termination():
            size = self._measure(0)
            if size is None:
                return None
            if size:
                self._in_step = True
                return self._take(size)
            self._discard_byte()
        return None

    def _awaits_termination(self) -> bool:
        """Swallow the CR LF that may follow a datagram; true where its LF is yet to come."""
        if self._termination_due:
            if self._buffer == TERMINATION[:1]:
                return True
            self._termination_due = False
            if self._buffer.startswith(TERMINATION):
                del self._buffer[: len(TERMINATION)]
        return not self._buffer

    def _measure(self, start: int) -> int | None:
        """Return the size of the good datagram or reply at ``start``, 0 for none, None: wait."""
        if self._buffer[start] == _REPLY:
            return measure_reply(self._buffer)
        size = _SIZES.get(self._buffer[start], 0)
        end = start + size
        if end > len(self._buffer):
            return None
        crc = self._buffer[end - CRC_SIZE : end]
        return size if size and crc_of(bytes(self._buffer[start : end - CRC_SIZE])) == crc else 0

    def _take(self, size: int) -> Event | None:
        layout = LAYOUTS.get(self._buffer[0])
        if layout is not None:
            return self._take_block(layout)
        raw = bytes(self._buffer[:size])
        del self._buffer[:size]
        if raw[0] == _REPLY:
            return decode_reply(raw[:-1])
        self._termination_due = True
        return decode_special(raw)

    def _take_block(self, layout: Layout) -> DataBlock:
        """Take the good datagram at the head and those of its kind that follow without a gap."""
        datagrams, position = [], 0
        while True:
            end = position + layout.size
            datagrams.append(bytes(self._buffer[position:end]))
            terminated = self._buffer.startswith(TERMINATION, end)
            position = end + len(TERMINATION) * terminated
            if not (
                self._buffer.startswith(datagrams[0][:1], position) and self._measure(position)
            ):
                break
        del self._buffer[:position]
        self._termination_due = not terminated
        return decode_data(layout, b"".join(datagrams))

    def _discard_byte(self) -> None:
        self.crc_errors += self._in_step
        self._in_step = False
        del self._buffer[0]
        self.discarded_bytes += 1
