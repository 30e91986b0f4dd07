"""Frames that a DBC file describes: one signal of a message; cantools reads the file."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Self

import cantools
import fastcrc
import numpy as np
from cantools.database import Database
from cantools.database.can import Message, Signal
from cantools.database.errors import Error as DatabaseError

from drivers.codecs.dbc_field import Field
from drivers.interfaces import BoolArray, CanFilter, CanFrame, CanSettings, FloatArray, IntArray

Quantity = Literal["rate", "force"]

_DEG_PER_HOUR = math.radians(1.0) / 3600.0
_STANDARD_GRAVITY_M_S2 = 9.80665
#: Units as they are found in files, in lower case and without blanks, as rad/s and as g.
_RATES = {
    "rad/s": 1.0,
    "deg/s": math.radians(1.0),
    "°/s": math.radians(1.0),
    "dps": math.radians(1.0),
    "deg/h": _DEG_PER_HOUR,
    "°/h": _DEG_PER_HOUR,
}
_FORCES = {
    "g": 1.0,
    "mg": 1e-3,
    "m/s^2": 1.0 / _STANDARD_GRAVITY_M_S2,
    "m/s²": 1.0 / _STANDARD_GRAVITY_M_S2,
    "m/s2": 1.0 / _STANDARD_GRAVITY_M_S2,
}

#: SAE J1939-21: of an extended identifier the priority and the sender say nothing of the content.
_PRIORITY, _SENDER, _ALL_29 = 0x1C000000, 0x000000FF, 0x1FFFFFFF

CHECKSUMS = {"sae_j1850": fastcrc.crc8.sae_j1850, "autosar": fastcrc.crc8.autosar}


@dataclass(frozen=True, slots=True)
class SignalChoice:
    """What of a DBC file is read, by the names that it gives.

    Attributes:
        message: The message.
        signal: The signal that is the axis.
        counter: The signal that counts the messages, where there is one.
        status: The signal that is 0 while all is well.
        checksum: The signal that is a CRC-8 over all other bytes of the frame, in their order.
        checksum_kind: Which one: a key of ``CHECKSUMS``.
    """

    message: str
    signal: str
    counter: str | None = None
    status: str | None = None
    checksum: str | None = None
    checksum_kind: str = "sae_j1850"


@dataclass(frozen=True, slots=True)
class Readings:
    """What k frames say, those of other multiplexed content left out.

    ``value`` is in rad/s or g, ``index`` the place of each among the frames given, ``counter``
    None where there is none.
    """

    value: FloatArray
    valid: BoolArray
    counter: IntArray | None
    index: IntArray


class DbcDecoder:
    """Reads one signal; also writes it, for a simulated instrument.

    Args:
        text: The DBC file.
        choice: What to read.

    Attributes:
        quantity: ``rate`` or ``force``, by the signal's unit.
        resolution: Of one count, rad/s or g; 0 for a float.
        malformed: Frames that were too short or had a wrong checksum.

    Raises:
        ValueError: The text is no DBC file, it lacks a name, or the unit is none of a rate or a
            specific force; the message says what there is instead.
    """

    def __init__(self, text: str, choice: SignalChoice) -> None:
        self._message = _message(text, choice.message)
        signal = self._signal(choice.signal)
        self._field = Field.of(signal)
        self.quantity, self._unit = _unit(signal)
        self.resolution = 0.0 if self._field.is_float else abs(self._field.scale) * self._unit
        self.malformed = 0
        self._counter = self._optional(choice.counter)
        self._status = self._optional(choice.status)
        self._checksum = self._optional(choice.checksum)
        if self._checksum is not None and (self._checksum.bits, self._checksum.start % 8) not in {
            (8, 0),
            (8, 7),
        }:
            msg = f"the checksum {choice.checksum} is not one whole byte of {choice.message}"
            raise ValueError(msg)
        self._crc8 = CHECKSUMS[choice.checksum_kind]
        self._selectors = self._selectors_of(signal)

    @classmethod
    def configured(cls, settings: CanSettings) -> Self:
        """Make it as a configuration says.

        Raises:
            ValueError: No DBC file is given, or it is not as it must be.
        """
        if settings.dbc is None:
            msg = "a file, a message and a signal must be given"
            raise ValueError(msg)
        text, names = settings.dbc
        return cls(text, SignalChoice(**names))

    @property
    def name(self) -> str:
        """Return the message's name and identifier: ``FOG_RATE (120h)``."""
        return f"{self._message.name} ({self._message.frame_id:X}h)"

    @property
    def period_s(self) -> float | None:
        """Return the time between messages as the file says, None where it does not."""
        cycle_ms = self._message.cycle_time
        return cycle_ms / 1000 if cycle_ms else None

    @property
    def counter_modulus(self) -> int | None:
        """Return at how much the counter wraps; None where there is none."""
        return None if self._counter is None else 1 << self._counter.bits

    @property
    def is_j1939(self) -> bool:
        """Return whether the identifier is a parameter group number with priority and sender."""
        return self._message.is_extended_frame and self._message.protocol == "j1939"

    def filter(self, sender: int | None = None) -> CanFilter:
        """Return which frames are the message; of J1939 and NMEA 2000 those of one sender."""
        frame_id, extended = self._message.frame_id, self._message.is_extended_frame
        if not self.is_j1939:
            return CanFilter(frame_id, _ALL_29 if extended else 0x7FF, extended)
        mask = _ALL_29 & ~_PRIORITY
        if sender is None:
            return CanFilter(frame_id & ~_SENDER, mask & ~_SENDER, extended=True)
        return CanFilter(frame_id & ~_SENDER | sender, mask, extended=True)

    def decode(self, frames: Sequence[CanFrame]) -> Readings:
        """Read every frame of the message; damaged ones are counted."""
        length = self._message.length
        kept = [
            index
            for index, frame in enumerate(frames)
            if len(frame.data) >= length and not frame.remote and self._intact(frame.data)
        ]
        self.malformed += len(frames) - len(kept)
        index = np.array(kept, np.int64)
        joined = b"".join(frames[place].data[:length] for place in kept)
        data = np.frombuffer(joined, np.uint8).reshape(len(kept), length)
        for selector, ids in self._selectors:
            chosen = np.isin(selector.raw(data), ids)
            index, data = index[chosen], data[chosen]
        value = self._field.values(data)
        valid: BoolArray = (value >= self._field.minimum) & (value <= self._field.maximum)
        if self._status is not None:
            valid &= self._status.raw(data) == 0
        counter = None if self._counter is None else self._counter.raw(data).astype(np.int64)
        return Readings(value * self._unit, valid, counter, index)

    def encode(self, value: FloatArray, counter: IntArray, sender: int = 0) -> list[CanFrame]:
        """Write frames, as an instrument does: rad/s or g, and the number of each message."""
        data = np.zeros((len(value), self._message.length), np.uint8)
        self._field.put(data, self._field.counts(value / self._unit))
        if self._counter is not None:
            wrapped = counter % (1 << self._counter.bits)
            self._counter.put(data, wrapped.astype(np.uint64))
        for selector, ids in self._selectors:
            selector.put(data, np.full(len(value), ids[0], np.uint64))
        can_id = self._message.frame_id
        if self.is_j1939:
            can_id = can_id & ~_SENDER | sender
        extended = self._message.is_extended_frame
        return [CanFrame(can_id, self._sealed(row.tobytes()), extended) for row in data]

    def _sealed(self, data: bytes) -> bytes:
        if self._checksum is None:
            return data
        place = self._checksum.start // 8
        return data[:place] + bytes((self._crc(data, place),)) + data[place + 1 :]

    def _intact(self, data: bytes) -> bool:
        if self._checksum is None:
            return True
        place = self._checksum.start // 8
        return self._crc(data[: self._message.length], place) == data[place]

    def _crc(self, data: bytes, place: int) -> int:
        return int(self._crc8(data[:place] + data[place + 1 :]))

    def _signal(self, name: str) -> Signal:
        found = {signal.name: signal for signal in self._message.signals}
        if name not in found:
            msg = f"{self._message.name} has no signal {name!r}; it has {', '.join(sorted(found))}"
            raise ValueError(msg)
        return found[name]

    def _optional(self, name: str | None) -> Field | None:
        return None if name is None else Field.of(self._signal(name))

    def _selectors_of(self, signal: Signal) -> list[tuple[Field, list[int]]]:
        """Return the multiplexers that must have certain values for the signal to be there."""
        selectors: list[tuple[Field, list[int]]] = []
        while signal.multiplexer_signal is not None and signal.multiplexer_ids:
            if len(selectors) == len(self._message.signals):
                msg = f"the multiplexers of {self._message.name} select each other in a circle"
                raise ValueError(msg)
            ids = list(signal.multiplexer_ids)
            signal = self._signal(signal.multiplexer_signal)
            selectors.append((Field.of(signal), ids))
        return selectors


def _message(text: str, name: str) -> Message:
    try:
        database = cantools.database.load_string(text, "dbc", strict=False)
    except (DatabaseError, ValueError) as error:
        msg = f"this is no DBC file: {error}"
        raise ValueError(msg) from error
    messages = {message.name: message for message in _messages(database)}
    if name not in messages:
        msg = f"the file has no message {name!r}; it has {', '.join(sorted(messages))}"
        raise ValueError(msg)
    return messages[name]


def _messages(database: object) -> list[Message]:
    return database.messages if isinstance(database, Database) else []


def _unit(signal: Signal) -> tuple[Quantity, float]:
    unit = (signal.unit or "").replace(" ", "").lower()
    if unit in _RATES:
        return "rate", _RATES[unit]
    if unit in _FORCES:
        return "force", _FORCES[unit]
    known = ", ".join((*_RATES, *_FORCES))
    msg = f"the signal {signal.name} is in {signal.unit!r}, which is none of {known}"
    raise ValueError(msg)
