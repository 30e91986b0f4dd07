"""The client's end of service data objects: expedited and segmented (CiA 301, 7.2.4)."""

from drivers.codecs.sdo import (
    CAPACITY_BYTES,
    Abort,
    Aborted,
    Answer,
    Entry,
    Request,
    encode_abort,
    entry_of,
    multiplexed,
)


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

    @property
    def repeatable(self) -> bool:
        """Whether the node may hear what is asked now twice: the first question of a reading."""
        return self._value is None and not self._segmented

    def begin(self) -> bytes:
        """Return the first request, 8 bytes."""
        if self._value is None:
            return self._initiate(Request.UPLOAD << 5, bytes(4))
        if 1 <= len(self._value) <= 4:
            unused = 4 - len(self._value)
            return self._initiate(
                Request.DOWNLOAD << 5 | unused << 2 | 0b11, self._value.ljust(4, b"\0")
            )
        return self._initiate(Request.DOWNLOAD << 5 | 0b01, len(self._value).to_bytes(4, "little"))

    def belongs(self, data: bytes) -> bool:
        """Say whether an answer can be this transfer's: one to another entry is not."""
        if len(data) != 8:
            return False
        specifier = data[0] >> 5
        if specifier == Answer.ABORT:
            return entry_of(data) == self.entry
        if specifier == (Answer.UPLOAD if self._value is None else Answer.DOWNLOAD):
            return entry_of(data) == self.entry and not self._segmented
        return self._segmented and specifier in {Answer.UPLOAD_SEGMENT, Answer.DOWNLOAD_SEGMENT}

    def answer(self, data: bytes) -> bytes | None:
        """Take the server's answer and return the next request; None where it is over."""
        specifier = data[0] >> 5
        if specifier == Answer.ABORT:
            self.result = Aborted(self.entry, int.from_bytes(data[4:], "little"))
            return None
        expected = {
            (False, False): Answer.UPLOAD,
            (False, True): Answer.UPLOAD_SEGMENT,
            (True, False): Answer.DOWNLOAD,
            (True, True): Answer.DOWNLOAD_SEGMENT,
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
            if len(self._read) > CAPACITY_BYTES:
                return self._abort(Abort.OUT_OF_MEMORY)
        self._segmented = True
        return bytes((Request.UPLOAD_SEGMENT << 5 | self._toggle << 4,)).ljust(8, b"\0")

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
        head = Request.DOWNLOAD_SEGMENT << 5 | self._toggle << 4 | (7 - len(part)) << 1 | last
        return bytes((head,)) + part.ljust(7, b"\0")

    def _initiate(self, head: int, tail: bytes) -> bytes:
        return multiplexed(head, self.entry, tail)

    def _abort(self, code: Abort) -> bytes:
        self.result = Aborted(self.entry, code)
        return encode_abort(self.entry, code)
