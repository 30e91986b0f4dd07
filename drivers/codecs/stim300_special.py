"""STIM300's single datagrams: part and serial number, configuration, bias trim, errors.

Sent once at power-up or in answer to a normal-mode command, in place of the next normal-mode
datagram (TS1524 sections 5.5.1 to 5.5.5 and 8). Each has two IDs, the second with CR LF.
"""

from collections.abc import Callable
from dataclasses import dataclass
from struct import Struct
from typing import NamedTuple

from drivers.codecs.stim300_configuration import Configuration
from drivers.codecs.stim300_data import CRC_SIZE, TERMINATION, crc_of

_TRIM = Struct(">27sIH2x")


@dataclass(frozen=True, slots=True)
class PartNumber:
    """Which variant it is: ``84167-400000-0A1B``, and the revision of that."""

    number: str
    revision: str


@dataclass(frozen=True, slots=True)
class SerialNumber:
    """Which instrument it is, fourteen digits after an N."""

    digits: str


@dataclass(frozen=True, slots=True)
class BiasTrim:
    """Offsets that the user trimmed, in counts of x, y, z of gyros, accelerometers, inclinometers.

    Attributes:
        offsets: Nine counts.
        reference: The user's own note, 32 bits.
        saves_left: How often the offsets can still be saved.
    """

    offsets: tuple[int, ...]
    reference: int
    saves_left: int


@dataclass(frozen=True, slots=True)
class ExtendedError:
    """The 128 error flags of table 5-19; bit i is E<i>."""

    flags: int


Special = PartNumber | SerialNumber | Configuration | BiasTrim | ExtendedError


class _Form(NamedTuple):
    plain: int
    terminated: int
    size: int
    decode: Callable[[bytes], Special]


def encode_special(event: Special, *, terminated: bool) -> bytes:
    """Encode a single datagram as the instrument sends it."""
    form = _FORMS[type(event)]
    body = bytes([form.terminated if terminated else form.plain]) + _payload(event)
    return body + crc_of(body) + (TERMINATION if terminated else b"")


def decode_special(datagram: bytes) -> Special:
    """Decode a single datagram whose ID and CRC the caller has checked."""
    return _BY_ID[datagram[0]].decode(datagram[1:-CRC_SIZE])


def _payload(event: Special) -> bytes:
    if isinstance(event, PartNumber):
        return _encode_part_number(event)
    if isinstance(event, SerialNumber):
        return b"N" + bytes.fromhex(event.digits) + bytes(7)
    if isinstance(event, Configuration):
        return event.payload
    if isinstance(event, BiasTrim):
        counts = b"".join(n.to_bytes(3, "big", signed=True) for n in event.offsets)
        return _TRIM.pack(counts, event.reference, event.saves_left)
    return event.flags.to_bytes(16, "big")


def _decode_part_number(payload: bytes) -> PartNumber:
    """Decode table 5-14: a nibble per character, two for the 13th and the 15th (0-9, A-Z)."""
    nibbles = [int(digit, 16) for digit in payload[:11].hex()]
    p12, p13, p14, p15, p16, p17 = nibbles[16:]
    last = [p17, p12 + 16 * p16, p13, p14 + 16 * p15]
    text = "".join(map(_character, nibbles[1:6] + nibbles[8:14] + last))
    return PartNumber(f"{text[:5]}-{text[5:11]}-{text[11:]}", chr(payload[14]))


def _encode_part_number(part: PartNumber) -> bytes:
    first, second, third = part.number.split("-")
    n12, n13, n14, n15 = map(_value, third)
    nibbles = [n13 % 16, n14, n15 % 16, n15 // 16, n13 // 16, n12]
    last = bytes(high << 4 | low for high, low in zip(nibbles[::2], nibbles[1::2], strict=True))
    digits = bytes.fromhex(f"0{first}") + b"-" + bytes.fromhex(second) + b"-"
    return digits + last + bytes(3) + part.revision.encode("latin-1")


def _character(value: int) -> str:
    return chr(value + 48) if value < 10 else chr(value + 55)


def _value(character: str) -> int:
    return ord(character) - (48 if character <= "9" else 55)


def _decode_serial_number(payload: bytes) -> SerialNumber:
    return SerialNumber(payload[1:8].hex().upper())


def _decode_bias_trim(payload: bytes) -> BiasTrim:
    counts, reference, saves_left = _TRIM.unpack(payload)
    offsets = (int.from_bytes(counts[i : i + 3], "big", signed=True) for i in range(0, 27, 3))
    return BiasTrim(tuple(offsets), reference, saves_left)


def _decode_extended_error(payload: bytes) -> ExtendedError:
    return ExtendedError(int.from_bytes(payload, "big"))


_FORMS: dict[type[Special], _Form] = {
    PartNumber: _Form(0xB1, 0xB3, 20, _decode_part_number),
    SerialNumber: _Form(0xB5, 0xB7, 20, _decode_serial_number),
    Configuration: _Form(0xBC, 0xBD, 26, Configuration),
    BiasTrim: _Form(0xD1, 0xD2, 40, _decode_bias_trim),
    ExtendedError: _Form(0xBE, 0xBF, 21, _decode_extended_error),
}
_BY_ID = {identifier: form for form in _FORMS.values() for identifier in form[:2]}

#: Lengths by ID, CRC included, CR LF not.
SPECIAL_SIZES = {identifier: form.size for identifier, form in _BY_ID.items()}
