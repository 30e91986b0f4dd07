"""The server's end of service data objects: expedited and segmented (CiA 301, 7.2.4).

Block transfers are refused, as they may be.
"""

from typing import Protocol

from drivers.codecs.sdo import (
    CAPACITY_BYTES,
    Abort,
    Answer,
    Entry,
    Request,
    describe_abort,
    encode_abort,
    entry_of,
    multiplexed,
)


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
            case Request.UPLOAD:
                return self._begin_upload(request)
            case Request.DOWNLOAD:
                return self._begin_download(request)
            case Request.UPLOAD_SEGMENT:
                return self._upload_segment(request)
            case Request.DOWNLOAD_SEGMENT:
                return self._download_segment(request)
            case Request.ABORT:
                self._upload = self._download = None
                return None
            case _:
                self._entry = entry_of(request)
                raise AccessError(Abort.COMMAND)

    def _begin_upload(self, request: bytes) -> bytes:
        self._entry, self._toggle, self._download = entry_of(request), 0, None
        value = self._objects.read(self._entry)
        if 1 <= len(value) <= 4:
            head = Answer.UPLOAD << 5 | (4 - len(value)) << 2 | 0b11
            return multiplexed(head, self._entry, value.ljust(4, b"\0"))
        self._upload = value
        size = len(value).to_bytes(4, "little")
        return multiplexed(Answer.UPLOAD << 5 | 0b01, self._entry, size)

    def _begin_download(self, request: bytes) -> bytes:
        self._entry, self._toggle, self._upload = entry_of(request), 0, None
        if request[0] & 0b10:  # expedited
            unused = request[0] >> 2 & 0b11 if request[0] & 1 else 0
            self._objects.write(self._entry, request[4 : 8 - unused])
        else:
            self._download = bytearray()
        return multiplexed(Answer.DOWNLOAD << 5, self._entry, bytes(4))

    def _upload_segment(self, request: bytes) -> bytes:
        if self._upload is None:
            raise AccessError(Abort.COMMAND)
        toggle = self._checked_toggle(request)
        part, self._upload = self._upload[:7], self._upload[7:]
        last = not self._upload
        if last:
            self._upload = None
        head = Answer.UPLOAD_SEGMENT << 5 | toggle << 4 | (7 - len(part)) << 1 | last
        return bytes((head,)) + part.ljust(7, b"\0")

    def _download_segment(self, request: bytes) -> bytes:
        if self._download is None:
            raise AccessError(Abort.COMMAND)
        toggle = self._checked_toggle(request)
        self._download += request[1 : 8 - (request[0] >> 1 & 0b111)]
        if len(self._download) > CAPACITY_BYTES:
            raise AccessError(Abort.OUT_OF_MEMORY)
        if request[0] & 1:
            value, self._download = bytes(self._download), None
            self._objects.write(self._entry, value)
        return bytes((Answer.DOWNLOAD_SEGMENT << 5 | toggle << 4,)).ljust(8, b"\0")

    def _checked_toggle(self, request: bytes) -> int:
        toggle = request[0] >> 4 & 1
        if toggle != self._toggle:
            raise AccessError(Abort.TOGGLE)
        self._toggle ^= 1
        return toggle
