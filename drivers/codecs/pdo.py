"""Process data objects: what a frame carries, in which order (CiA 301, 7.2.2 and 7.5.2.35 ff.)."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from drivers.codecs.sdo import Entry

MOST_BITS = 64

#: Bits of the COB-ID at sub-index 1 of 1400h.. and 1800h...
INVALID, NO_REMOTE = 1 << 31, 1 << 30
#: Transmission types at sub-index 2: after every SYNC, and by events or the event timer.
EVERY_SYNC, BY_EVENT = 1, 255


class Mapped(NamedTuple):
    """One object in a PDO, and how many bits it takes."""

    entry: Entry
    bits: int

    @classmethod
    def from_number(cls, number: int) -> "Mapped":
        """Read an entry of 1600h.. or 1A00h...: index, sub-index and bits."""
        return cls(Entry(number >> 16, number >> 8 & 0xFF), number & 0xFF)

    def to_number(self) -> int:
        """Return the same as such an entry holds it."""
        return self.entry.index << 16 | self.entry.sub_index << 8 | self.bits


def encode_pdo(mapping: Sequence[Mapped], values: Mapping[Entry, int]) -> bytes:
    """Pack the objects in the order of the mapping, the first into the lowest bits."""
    packed, place = 0, 0
    for entry, bits in mapping:
        packed |= (values[entry] & (1 << bits) - 1) << place
        place += bits
    return packed.to_bytes((place + 7) // 8, "little")


def decode_pdo(mapping: Sequence[Mapped], data: bytes) -> dict[Entry, int] | None:
    """Unpack the objects, unsigned; None where the frame is shorter than the mapping."""
    if sum(bits for _, bits in mapping) > 8 * len(data):
        return None
    packed, values = int.from_bytes(data, "little"), {}
    for entry, bits in mapping:
        values[entry] = packed & (1 << bits) - 1
        packed >>= bits
    return values


def signed(value: int, bits: int) -> int:
    """Read an unsigned number as two's complement."""
    return value - (1 << bits) if value >> bits - 1 else value
