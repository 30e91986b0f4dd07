"""Where a DBC file's signal is in a frame: taken out of many frames at a time, and put in.

The bits are taken apart here and not by cantools, for a gyro sends a thousand frames a second
and a recording holds millions.
"""

import math
from dataclasses import dataclass

import numpy as np
from cantools.database.can import Signal
from numpy.typing import NDArray

from drivers.interfaces import FloatArray

ByteArray = NDArray[np.uint8]
Words = NDArray[np.uint64]


@dataclass(frozen=True, slots=True)
class Field:
    """Where a signal's bits are in a frame, and what they mean.

    Attributes:
        name: Of the signal.
        start: The first bit as DBC files count: of the least significant one, or of the most
            significant one where the order is big-endian.
        bits: How many.
        big_endian: Their order.
        signed: Two's complement.
        is_float: IEEE 754, of 32 or 64 bits.
        scale: Physical value of one count.
        offset: Physical value of zero counts.
        minimum: The least value that means anything; minus infinity where the file gives no limit.
        maximum: The greatest.
    """

    name: str
    start: int
    bits: int
    big_endian: bool
    signed: bool
    is_float: bool
    scale: float
    offset: float
    minimum: float
    maximum: float

    @classmethod
    def of(cls, signal: Signal) -> "Field":
        """Take over what the file says; limits that are equal are none."""
        low, high = signal.minimum, signal.maximum
        limited = low is not None and high is not None and low < high
        return cls(
            name=signal.name,
            start=signal.start,
            bits=signal.length,
            big_endian=signal.byte_order == "big_endian",
            signed=signal.is_signed,
            is_float=signal.is_float,
            scale=float(signal.scale),
            offset=float(signal.offset),
            minimum=float(low) if limited and low is not None else -math.inf,
            maximum=float(high) if limited and high is not None else math.inf,
        )

    def raw(self, data: ByteArray) -> Words:
        """Return the bits as unsigned numbers; data has shape (frames, bytes)."""
        first, last, shift = self._place()
        count = last - first + 1
        words = np.zeros(len(data), np.uint64)
        for place in range(count):
            byte = data[:, last - place if self.big_endian else first + place].astype(np.uint64)
            move = 8 * place - shift
            words |= byte << np.uint64(move) if move >= 0 else byte >> np.uint64(-move)
        if self.bits < 64:
            words &= np.uint64((1 << self.bits) - 1)
        return words

    def put(self, data: ByteArray, raw: Words) -> None:
        """Set the bits of every frame; they must have been zero."""
        first, last, shift = self._place()
        for place in range(last - first + 1):
            column = last - place if self.big_endian else first + place
            move = 8 * place - shift
            part = raw >> np.uint64(move) if move >= 0 else raw << np.uint64(-move)
            data[:, column] |= (part & np.uint64(0xFF)).astype(np.uint8)

    def values(self, data: ByteArray) -> FloatArray:
        """Return physical values."""
        raw = self.raw(data)
        if self.is_float:
            narrow = raw.astype(np.uint32).view(np.float32) if self.bits == 32 else raw
            counts = narrow.astype(np.float64) if self.bits == 32 else raw.view(np.float64)
        elif self.signed:
            unused = np.uint64(64 - self.bits)
            counts = ((raw << unused).view(np.int64) >> unused.astype(np.int64)).astype(np.float64)
        else:
            counts = raw.astype(np.float64)
        physical: FloatArray = counts * self.scale + self.offset
        return physical

    def counts(self, values: FloatArray) -> Words:
        """Return the bits that stand for physical values, saturated: the way back."""
        counts = (values - self.offset) / self.scale
        if self.is_float:
            narrow = counts.astype(np.float32).view(np.uint32) if self.bits == 32 else None
            return counts.view(np.uint64) if narrow is None else narrow.astype(np.uint64)
        half = 1 << self.bits - 1
        low, high = (-half, half - 1) if self.signed else (0, 2 * half - 1)
        whole = np.clip(np.rint(counts), low, high).astype(np.int64).view(np.uint64)
        return whole & np.uint64(2 * half - 1)

    def _place(self) -> tuple[int, int, int]:
        """Return the first byte, the last, and how far from its byte's end the lowest bit is."""
        if not self.big_endian:
            return self.start // 8, (self.start + self.bits - 1) // 8, self.start % 8
        highest = self.start // 8 * 8 + 7 - self.start % 8  # counted from the frame's first bit
        lowest = highest + self.bits - 1
        return highest // 8, lowest // 8, 7 - lowest % 8
