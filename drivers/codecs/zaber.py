"""Zaber ASCII: commands, replies, info, alerts and their checksum (Zaber ASCII Protocol Manual).

``/device axis id text:LRC`` and LF goes to the device; replies ``@``, infos ``#`` and alerts
``!`` come back, ended by CR LF. Continued (multi-packet) messages are left out: nothing here
fills a packet.
"""

import re
from dataclasses import dataclass
from enum import StrEnum

from drivers.codecs.crc import lrc_zaber

SPEED_DATA = 1.6384  # device units per microstep/s
ACCELERATION_DATA = 1.6384e-4  # device units per microstep/s^2
MESSAGE_IDS = 100  # 0 to 99
NO_WARNING = "--"
NO_REFERENCE = "WR"

#: The manual's warning flags, the gravest first: a reply carries only the first that holds.
WARNINGS = {
    "FF": "critical system error",
    "FN": "peripheral not supported",
    "FZ": "peripheral inactive",
    "FH": "driver disabled by the hardware emergency stop",
    "FV": "driver disabled by overvoltage or undervoltage",
    "FO": "driver disabled on start-up or by command",
    "FC": "current inrush error",
    "FM": "motor temperature error",
    "FD": "driver disabled",
    "FQ": "encoder error",
    "FI": "index error",
    "FA": "analog encoder synchronisation error",
    "FR": "overdrive limit exceeded",
    "FS": "stalled and stopped",
    "FB": "stream bounds error",
    "FP": "interpolated path deviation",
    "FE": "limit error",
    "FT": "excessive twist",
    "WL": "unexpected limit trigger",
    "WV": "voltage out of range",
    "WT": "controller temperature high",
    "WS": "stalled with recovery",
    "WM": "displaced when stationary",
    "WP": "invalid calibration type",
    NO_REFERENCE: "no reference position",
    "WH": "not homed",
    "NC": "manual control",
    "NI": "movement interrupted",
    "ND": "stream discontinuity",
    "NR": "value rounded",
    "NT": "value truncated",
    "NU": "setting update pending",
    "NJ": "joystick calibrating",
    "NB": "in firmware update mode",
}


class Rejection(StrEnum):
    """Why a command was rejected (``RJ``)."""

    BADCOMMAND = "BADCOMMAND"
    BADDATA = "BADDATA"
    BADAXIS = "BADAXIS"
    AGAIN = "AGAIN"
    FULL = "FULL"
    STATUSBUSY = "STATUSBUSY"
    PARKED = "PARKED"
    DEVICEONLY = "DEVICEONLY"
    BADMESSAGEID = "BADMESSAGEID"
    LOCKSTEP = "LOCKSTEP"
    DRIVERDISABLED = "DRIVERDISABLED"
    INACTIVE = "INACTIVE"
    NOTSUPPORTED = "NOTSUPPORTED"


REJECTIONS: dict[str, str] = {
    Rejection.BADCOMMAND: "the command or setting is unknown to this device",
    Rejection.BADDATA: "the data is malformed or out of range",
    Rejection.BADAXIS: "the device has no such axis",
    Rejection.AGAIN: "the command cannot be processed right now",
    Rejection.FULL: "the device has no room left for it",
    Rejection.STATUSBUSY: "the device is busy",
    Rejection.PARKED: "the axis is parked",
    Rejection.DEVICEONLY: "the command is for the whole device, not for an axis",
    Rejection.BADMESSAGEID: "the message id is not a number from 0 to 99",
    Rejection.LOCKSTEP: "the axis belongs to a lockstep group",
    Rejection.DRIVERDISABLED: "the driver of the axis is disabled",
    Rejection.INACTIVE: "the axis has no active peripheral",
    Rejection.NOTSUPPORTED: "the axis does not support it",
}


@dataclass(frozen=True, slots=True)
class Command:
    """To the device; device 0 is every device, axis 0 every axis, an empty text asks the status."""

    text: str = ""
    device: int = 0
    axis: int = 0
    message_id: int | None = None


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to one command; a rejected one carries the reason as its data."""

    device: int
    axis: int
    accepted: bool
    busy: bool
    warning: str
    data: str = "0"
    message_id: int | None = None


@dataclass(frozen=True, slots=True)
class Info:
    """A line of text after a reply; begins with the message id if the command had one."""

    device: int
    axis: int
    data: str


@dataclass(frozen=True, slots=True)
class Alert:
    """Sent unasked when a movement ends, where ``comm.alert`` is on."""

    device: int
    axis: int
    busy: bool
    warning: str


Message = Command | Reply | Info | Alert


def encode(message: Message, *, checksum: bool = True) -> bytes:
    """Encode a message as it stands on the wire.

    Raises:
        ValueError: The message holds what the protocol cannot carry: a colon, or anything but
            printable ASCII.
    """
    lead, body = _layout(message)
    if not re.fullmatch(r"[ -9;-~]*", body):
        msg = f"a Zaber message is printable ASCII without a colon, not {body!r}"
        raise ValueError(msg)
    trailer = f":{lrc_zaber(body.encode()):02X}" if checksum else ""
    end = "\n" if isinstance(message, Command) else "\r\n"
    return f"{lead}{body}{trailer}{end}".encode()


def _layout(message: Message) -> tuple[str, str]:
    match message:
        case Command(text, device, axis, message_id):
            return "/", f"{device} {axis}{_id(message_id)} {text}".rstrip()
        case Reply(device, axis, accepted, busy, warning, data, message_id):
            verdict = "OK" if accepted else "RJ"
            head = f"{device:02} {axis}{_id(message_id)} {verdict} {_status(busy)}"
            return "@", f"{head} {warning} {data}"
        case Info(device, axis, data):
            return "#", f"{device:02} {axis} {data}"
        case _:
            status = f"{_status(message.busy)} {message.warning}"
            return "!", f"{message.device:02} {message.axis} {status}"


def _id(message_id: int | None) -> str:
    return "" if message_id is None else f" {message_id:02}"


def _status(busy: bool) -> str:
    return "BUSY" if busy else "IDLE"


_LINE_BYTES = 256  # three times a packet of 80; what is longer is no message
_CAPACITY_BYTES = 1 << 16  # six seconds of the line
_START = re.compile(rb"[/@#!]")
_MESSAGE = re.compile(rb"(.)([ -9;-~]*)(?::([0-9A-Fa-f]{2}))?")
_COMMAND = re.compile(r" *(?:(\d+)\b(?: +(\d+)\b(?: +(\d+)\b)?)?)? *(.*?) *")
_REPLY = re.compile(r"(\d+) (\d+) (?:(\d+) )?(OK|RJ) (IDLE|BUSY) (\S\S) (.*)")
_INFO = re.compile(r"(\d+) (\d+) (.*)")
_ALERT = re.compile(r"(\d+) (\d+) (IDLE|BUSY) (\S\S)")


class ZaberDecoder:
    """Turn bytes, cut anywhere, into messages of either direction.

    A message whose checksum is wrong is dropped and counted. The checksum is optional, but a
    device that sends it does so always (``comm.checksum``): once one was seen, a message to the
    host without it is damaged too. Everything else is garbage, counted and never raised.

    Attributes:
        frames: Messages decoded.
        crc_errors: Messages dropped for their checksum.
        garbage_bytes: Bytes that belong to no message.
    """

    def __init__(self) -> None:
        self.frames = 0
        self.crc_errors = 0
        self.garbage_bytes = 0
        self._buffer = bytearray()
        self._overlong = False
        self._checksum_expected = False

    def receive_data(self, data: bytes) -> None:
        """Append bytes as they came; of what nobody drains, the oldest are thrown away."""
        self._buffer += data
        overrun = max(0, len(self._buffer) - _CAPACITY_BYTES)
        self.garbage_bytes += overrun
        del self._buffer[:overrun]

    def next_event(self) -> Message | None:
        """Return the next message, or ``None`` when more bytes are needed."""
        while (line := self._next_line()) is not None:
            message = self._decode(line)
            if message is not None:
                self.frames += 1
                return message
        return None

    def _next_line(self) -> bytes | None:
        """Cut off the next line; one that grows too long is thrown away up to its end."""
        while (end := re.search(rb"[\r\n]", self._buffer)) is not None:
            line = bytes(self._buffer[: end.start()])
            del self._buffer[: end.end()]
            overlong, self._overlong = self._overlong or len(line) > _LINE_BYTES, False
            if not overlong:
                return line
            self.garbage_bytes += len(line)
        if self._overlong or len(self._buffer) > _LINE_BYTES:
            self.garbage_bytes += len(self._buffer)
            self._overlong = True
            self._buffer.clear()
        return None

    def _decode(self, line: bytes) -> Message | None:
        """Decode a line; noise in front may hold start characters, so each is tried."""
        damaged = False
        for start in _START.finditer(line):
            matched = _MESSAGE.fullmatch(line, start.start())
            message = _parse(matched[1], matched[2].decode()) if matched else None
            if matched is None or message is None:
                continue
            if self._checksum_holds(message, matched[2], matched[3]):
                self.garbage_bytes += start.start()
                return message
            damaged = True
        if damaged:
            self.crc_errors += 1
        else:
            self.garbage_bytes += len(line)
        return None

    def _checksum_holds(self, message: Message, body: bytes, checksum: bytes | None) -> bool:
        from_device = not isinstance(message, Command)
        if checksum is None:
            return not (from_device and self._checksum_expected)
        holds = int(checksum, 16) == lrc_zaber(body)
        self._checksum_expected |= holds and from_device
        return holds


def _parse(lead: bytes, body: str) -> Message | None:
    if lead == b"/":
        matched = _COMMAND.fullmatch(body)
        return _command(matched) if matched else None
    if lead == b"@":
        matched = _REPLY.fullmatch(body)
        return _reply(matched) if matched else None
    if lead == b"!":
        matched = _ALERT.fullmatch(body)
        return _alert(matched) if matched else None
    matched = _INFO.fullmatch(body)
    return Info(int(matched[1]), int(matched[2]), matched[3]) if matched else None


def _command(matched: re.Match[str]) -> Command:
    device, axis, message_id, text = matched.groups()
    return Command(text, int(device or 0), int(axis or 0), _optional(message_id))


def _reply(matched: re.Match[str]) -> Reply:
    device, axis, message_id, verdict, status, warning, data = matched.groups()
    accepted, busy = verdict == "OK", status == "BUSY"
    return Reply(int(device), int(axis), accepted, busy, warning, data, _optional(message_id))


def _alert(matched: re.Match[str]) -> Alert:
    return Alert(int(matched[1]), int(matched[2]), matched[3] == "BUSY", matched[4])


def _optional(number: str | None) -> int | None:
    return None if number is None else int(number)
