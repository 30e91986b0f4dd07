"""STIM300's utility mode: one line each way, ``$name,parameters,CRC`` and ``#name,status,...,CRC``.

The CRC-8 is written in decimal and covers all before it, the comma included (TS1524 section 10).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from drivers.codecs.crc import crc8_stim300

_LONGEST = 128  # no command or reply of section 10 comes near it


class UtilityStatus(IntEnum):
    """How a command went (table 10-2)."""

    OK = 0
    INVALID_COMMAND = 1
    WRONG_CRC = 2
    UNKNOWN_COMMAND = 3
    PARAMETER_COUNT = 4
    INVALID_PARAMETER = 5
    SAVES_EXHAUSTED = 6
    SAVE_FAILED = 7
    CHANGE_REDUCED = 8


@dataclass(frozen=True, slots=True)
class UtilityCommand:
    """A request: ``isn`` asks for the serial number, ``sm`` with a code sets the data rate."""

    name: str
    parameters: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class UtilityReply:
    """An answer; the one that acknowledges the mode itself has no status."""

    name: str
    status: int | None = None
    values: tuple[str, ...] = ()


def encode_utility(line: UtilityCommand | UtilityReply) -> bytes:
    """Encode a line, its CR included."""
    if isinstance(line, UtilityCommand):
        return _seal("$", [line.name, *line.parameters])
    status = [] if line.status is None else [str(int(line.status))]
    return _seal("#", [line.name, *status, *line.values])


def decode_command(line: bytes) -> UtilityCommand | UtilityStatus:
    """Decode a command without its CR; a line that is none gives the status to answer with."""
    if not line.startswith(b"$") or not _is_text(line):
        return UtilityStatus.INVALID_COMMAND
    fields = _unseal(line)
    if fields is None:
        return UtilityStatus.WRONG_CRC
    return UtilityCommand(fields[0], tuple(fields[1:]))


def decode_reply(line: bytes) -> UtilityReply | None:
    """Decode a reply without its CR; ``None`` where it is none or damaged."""
    fields = _unseal(line) if _is_text(line) else None
    if fields is None or not all(field.isdecimal() for field in fields[1:2]):
        return None
    status = int(fields[1]) if len(fields) > 1 else None
    return UtilityReply(fields[0], status, tuple(fields[2:]))


def measure_reply(buffer: bytearray) -> int | None:
    """Return how many bytes a good reply at the buffer's head takes, its CR included.

    Returns:
        Zero where there is none, ``None`` where more bytes are needed to say.
    """
    end = buffer.find(b"\r", 0, _LONGEST)
    line = bytes(buffer[: _LONGEST if end < 0 else end])
    if not _is_text(line):
        return 0
    if end < 0:
        return None if len(line) < _LONGEST else 0
    return 0 if decode_reply(line) is None else end + 1


def _is_text(line: bytes) -> bool:
    return line.isascii() and line.decode("ascii").isprintable()


def _seal(prefix: str, fields: Iterable[str]) -> bytes:
    text = f"{prefix}{','.join(fields)},".encode("ascii")
    return text + str(crc8_stim300(text)).encode("ascii") + b"\r"


def _unseal(line: bytes) -> list[str] | None:
    text, comma, crc = line.rpartition(b",")
    if not comma or crc != str(crc8_stim300(text + comma)).encode("ascii"):
        return None
    return text[1:].decode("ascii").split(",")
