"""Service data objects: what both ends of a transfer have in common (CiA 301, 7.2.4)."""

import struct
from dataclasses import dataclass
from enum import IntEnum

_MULTIPLEXER = struct.Struct("<BHB4s")
CAPACITY_BYTES = 1 << 16  # an object of a bench's instruments is a name or a number


class Request(IntEnum):
    """What a client's frame asks for: the upper three bits of its first byte."""

    DOWNLOAD_SEGMENT = 0
    DOWNLOAD = 1
    UPLOAD = 2
    UPLOAD_SEGMENT = 3
    ABORT = 4


class Answer(IntEnum):
    """The same of a server's frame."""

    UPLOAD_SEGMENT = 0
    DOWNLOAD_SEGMENT = 1
    UPLOAD = 2
    DOWNLOAD = 3
    ABORT = 4


class Abort(IntEnum):
    """Why a transfer ended without success (7.2.4.3.17, table 22)."""

    TOGGLE = 0x0503_0000
    TIMEOUT = 0x0504_0000
    COMMAND = 0x0504_0001
    OUT_OF_MEMORY = 0x0504_0005
    UNSUPPORTED_ACCESS = 0x0601_0000
    WRITE_ONLY = 0x0601_0001
    READ_ONLY = 0x0601_0002
    NO_OBJECT = 0x0602_0000
    NOT_MAPPABLE = 0x0604_0041
    PDO_LENGTH = 0x0604_0042
    PARAMETERS = 0x0604_0043
    HARDWARE = 0x0606_0000
    LENGTH = 0x0607_0010
    TOO_LONG = 0x0607_0012
    TOO_SHORT = 0x0607_0013
    NO_SUB_INDEX = 0x0609_0011
    VALUE = 0x0609_0030
    TOO_HIGH = 0x0609_0031
    TOO_LOW = 0x0609_0032
    GENERAL = 0x0800_0000
    STORE = 0x0800_0020
    LOCAL_CONTROL = 0x0800_0021
    DEVICE_STATE = 0x0800_0022


_WORDS = {
    Abort.TOGGLE: "a segment was lost or repeated",
    Abort.TIMEOUT: "the transfer took too long",
    Abort.COMMAND: "it does not know this kind of transfer",
    Abort.OUT_OF_MEMORY: "it is out of memory",
    Abort.UNSUPPORTED_ACCESS: "the object cannot be accessed so",
    Abort.WRITE_ONLY: "the object can only be written",
    Abort.READ_ONLY: "the object can only be read",
    Abort.NO_OBJECT: "there is no such object",
    Abort.NOT_MAPPABLE: "the object cannot be mapped to a PDO",
    Abort.PDO_LENGTH: "the mapped objects are too long for a PDO",
    Abort.PARAMETERS: "the parameters do not fit together",
    Abort.HARDWARE: "its hardware failed",
    Abort.LENGTH: "the value has the wrong length",
    Abort.TOO_LONG: "the value is too long",
    Abort.TOO_SHORT: "the value is too short",
    Abort.NO_SUB_INDEX: "there is no such sub-index",
    Abort.VALUE: "the value is not permitted",
    Abort.TOO_HIGH: "the value is too high",
    Abort.TOO_LOW: "the value is too low",
    Abort.GENERAL: "a general error",
    Abort.STORE: "the value cannot be stored",
    Abort.LOCAL_CONTROL: "it is under local control",
    Abort.DEVICE_STATE: "not in its present state",
}


def describe_abort(code: int) -> str:
    """Return an abort code in words."""
    try:
        words = _WORDS[Abort(code)]
    except ValueError:
        words = "for a reason that CiA 301 does not list"
    return f"{words} (abort {code:08X}h)"


@dataclass(frozen=True, slots=True, order=True)
class Entry:
    """Where a value stands in the object dictionary."""

    index: int
    sub_index: int = 0

    def __str__(self) -> str:
        return f"{self.index:04X}h:{self.sub_index:X}"


@dataclass(frozen=True, slots=True)
class Aborted:
    """A transfer that the other end refused; ``code`` is one of :class:`Abort`, or the maker's."""

    entry: Entry
    code: int


def encode_abort(entry: Entry, code: int) -> bytes:
    """Return the frame that ends a transfer, from either end."""
    return multiplexed(Request.ABORT << 5, entry, code.to_bytes(4, "little"))


def multiplexed(head: int, entry: Entry, tail: bytes) -> bytes:
    """Return a frame of head, entry and four more bytes."""
    return _MULTIPLEXER.pack(head, entry.index, entry.sub_index, tail)


def entry_of(data: bytes) -> Entry:
    """Return the entry that such a frame names."""
    _, index, sub_index, _ = _MULTIPLEXER.unpack(data)
    return Entry(index, sub_index)
