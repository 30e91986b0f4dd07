"""Service data objects, both ends of the transfer: expedited and segmented (CiA 301, 7.2.4).

Block transfers are not asked for; a server that is asked for one refuses, as it may.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

_MULTIPLEXER = struct.Struct("<BHB4s")
_CAPACITY_BYTES = 1 << 16  # an object of a bench's instruments is a name or a number

_DOWNLOAD_SEGMENT, _DOWNLOAD, _UPLOAD, _UPLOAD_SEGMENT, _ABORT = 0, 1, 2, 3, 4  # client's
_UPLOAD_SEGMENT_ANSWER, _DOWNLOAD_SEGMENT_ANSWER, _UPLOAD_ANSWER, _DOWNLOAD_ANSWER = 0, 1, 2, 3


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


class Transfer:
    """A client's transfer: :meth:`begin` makes the first request, :meth:`answer` all others.

    Args:
        entry: What is read or written.
        value: What is written; None to read.

    Attributes:
        result: Once it is over: the bytes read, empty after writing, or why it was aborted.
    """

    def __init__(self, entry: Entry, value: bytes | None = None) -> None:
        self.entry = entry
        self.result: bytes | Aborted | None = None
        self._value = value
        self._read = bytearray()
        self._sent = 0
        self._toggle = 0
        self._segmented = False

    def begin(self) -> bytes:
        """Return the first request, 8 bytes."""
        if self._value is None:
            return self._initiate(_UPLOAD << 5, bytes(4))
        if 1 <= len(self._value) <= 4:
            unused = 4 - len(self._value)
            return self._initiate(_DOWNLOAD << 5 | unused << 2 | 0b11, self._value.ljust(4, b"\0"))
        return self._initiate(_DOWNLOAD << 5 | 0b01, len(self._value).to_bytes(4, "little"))

    def belongs(self, data: bytes) -> bool:
        """Say whether an answer can be this transfer's: one to another entry is not."""
        if len(data) != 8:
            return False
        specifier = data[0] >> 5
        if specifier == _ABORT:
            return _entry_of(data) == self.entry
        if specifier == (_UPLOAD_ANSWER if self._value is None else _DOWNLOAD_ANSWER):
            return _entry_of(data) == self.entry and not self._segmented
        return self._segmented and specifier in {_UPLOAD_SEGMENT_ANSWER, _DOWNLOAD_SEGMENT_ANSWER}

    def answer(self, data: bytes) -> bytes | None:
        """Take the server's answer and return the next request; None where it is over."""
        specifier = data[0] >> 5
        if specifier == _ABORT:
            self.result = Aborted(self.entry, int.from_bytes(data[4:], "little"))
            return None
        expected = {
            (False, False): _UPLOAD_ANSWER,
            (False, True): _UPLOAD_SEGMENT_ANSWER,
            (True, False): _DOWNLOAD_ANSWER,
            (True, True): _DOWNLOAD_SEGMENT_ANSWER,
        }[self._value is not None, self._segmented]
        if specifier != expected:
            return self._abort(Abort.COMMAND)
        if self._segmented and (data[0] >> 4 & 1) != self._toggle:
            return self._abort(Abort.TOGGLE)
        return self._go_on(data)

    def _go_on(self, data: bytes) -> bytes | None:
        if self._value is not None:
            return self._next_segment()
        if not self._segmented and data[0] & 0b10:  # expedited
            unused = data[0] >> 2 & 0b11 if data[0] & 1 else 0
            self.result = data[4 : 8 - unused]
            return None
        if self._segmented:
            self._read += data[1 : 8 - (data[0] >> 1 & 0b111)]
            self._toggle ^= 1
            if data[0] & 1:
                self.result = bytes(self._read)
                return None
            if len(self._read) > _CAPACITY_BYTES:
                return self._abort(Abort.OUT_OF_MEMORY)
        self._segmented = True
        return bytes((_UPLOAD_SEGMENT << 5 | self._toggle << 4,)).ljust(8, b"\0")

    def _next_segment(self) -> bytes | None:
        value = self._value or b""
        expedited = 1 <= len(value) <= 4
        if self._segmented:
            self._toggle ^= 1
        if expedited or (self._segmented and self._sent == len(value)):
            self.result = b""
            return None
        part = value[self._sent : self._sent + 7]
        self._sent += len(part)
        self._segmented = True
        last = self._sent == len(value)
        head = _DOWNLOAD_SEGMENT << 5 | self._toggle << 4 | (7 - len(part)) << 1 | last
        return bytes((head,)) + part.ljust(7, b"\0")

    def _initiate(self, head: int, tail: bytes) -> bytes:
        return _multiplexed(head, self.entry, tail)

    def _abort(self, code: Abort) -> bytes:
        self.result = Aborted(self.entry, code)
        return encode_abort(self.entry, code)


class AccessError(Exception):
    """An object dictionary refuses an access.

    Args:
        code: Why.
    """

    def __init__(self, code: Abort) -> None:
        super().__init__(describe_abort(code))
        self.code = code


class Objects(Protocol):
    """What a server gives access to."""

    def read(self, entry: Entry) -> bytes:
        """Return a value.

        Raises:
            AccessError: There is none, or it cannot be read.
        """

    def write(self, entry: Entry, value: bytes) -> None:
        """Set a value.

        Raises:
            AccessError: There is none, or it cannot be this.
        """


class SdoServer:
    """A node's end of the transfers; one at a time, as with any default SDO server.

    Args:
        objects: Its object dictionary.
    """

    def __init__(self, objects: Objects) -> None:
        self._objects = objects
        self._entry = Entry(0)
        self._upload: bytes | None = None
        self._download: bytearray | None = None
        self._toggle = 0

    def answer(self, request: bytes) -> bytes | None:
        """Return the answer to a client's request; None to what is none."""
        if len(request) != 8:
            return None
        try:
            return self._answer(request)
        except AccessError as refused:
            self._upload = self._download = None
            return encode_abort(self._entry, refused.code)

    def _answer(self, request: bytes) -> bytes | None:
        match request[0] >> 5:
            case 2:
                return self._begin_upload(request)
            case 1:
                return self._begin_download(request)
            case 3:
                return self._upload_segment(request)
            case 0:
                return self._download_segment(request)
            case 4:
                self._upload = self._download = None
                return None
            case _:
                self._entry = _entry_of(request)
                raise AccessError(Abort.COMMAND)

    def _begin_upload(self, request: bytes) -> bytes:
        self._entry, self._toggle, self._download = _entry_of(request), 0, None
        value = self._objects.read(self._entry)
        if 1 <= len(value) <= 4:
            head = _UPLOAD_ANSWER << 5 | (4 - len(value)) << 2 | 0b11
            return _multiplexed(head, self._entry, value.ljust(4, b"\0"))
        self._upload = value
        size = len(value).to_bytes(4, "little")
        return _multiplexed(_UPLOAD_ANSWER << 5 | 0b01, self._entry, size)

    def _begin_download(self, request: bytes) -> bytes:
        self._entry, self._toggle, self._upload = _entry_of(request), 0, None
        if request[0] & 0b10:  # expedited
            unused = request[0] >> 2 & 0b11 if request[0] & 1 else 0
            self._objects.write(self._entry, request[4 : 8 - unused])
        else:
            self._download = bytearray()
        return _multiplexed(_DOWNLOAD_ANSWER << 5, self._entry, bytes(4))

    def _upload_segment(self, request: bytes) -> bytes:
        if self._upload is None:
            raise AccessError(Abort.COMMAND)
        toggle = self._checked_toggle(request)
        part, self._upload = self._upload[:7], self._upload[7:]
        last = not self._upload
        if last:
            self._upload = None
        head = _UPLOAD_SEGMENT_ANSWER << 5 | toggle << 4 | (7 - len(part)) << 1 | last
        return bytes((head,)) + part.ljust(7, b"\0")

    def _download_segment(self, request: bytes) -> bytes:
        if self._download is None:
            raise AccessError(Abort.COMMAND)
        toggle = self._checked_toggle(request)
        self._download += request[1 : 8 - (request[0] >> 1 & 0b111)]
        if len(self._download) > _CAPACITY_BYTES:
            raise AccessError(Abort.OUT_OF_MEMORY)
        if request[0] & 1:
            value, self._download = bytes(self._download), None
            self._objects.write(self._entry, value)
        return bytes((_DOWNLOAD_SEGMENT_ANSWER << 5 | toggle << 4,)).ljust(8, b"\0")

    def _checked_toggle(self, request: bytes) -> int:
        toggle = request[0] >> 4 & 1
        if toggle != self._toggle:
            raise AccessError(Abort.TOGGLE)
        self._toggle ^= 1
        return toggle


def encode_abort(entry: Entry, code: int) -> bytes:
    """Return the frame that ends a transfer, from either end."""
    return _multiplexed(_ABORT << 5, entry, code.to_bytes(4, "little"))


def _multiplexed(head: int, entry: Entry, tail: bytes) -> bytes:
    return _MULTIPLEXER.pack(head, entry.index, entry.sub_index, tail)


def _entry_of(data: bytes) -> Entry:
    _, index, sub_index, _ = _MULTIPLEXER.unpack(data)
    return Entry(index, sub_index)
