"""Both ends of CANopen's service data, and a DBC message, under noise."""

from collections.abc import Sequence
from importlib.resources import files

import numpy as np

from drivers.codecs.dbc import DbcDecoder, SignalChoice
from drivers.codecs.sdo import Abort, Entry
from drivers.codecs.sdo_client import Transfer
from drivers.codecs.sdo_server import AccessError, SdoServer
from drivers.interfaces import CanFrame

_NODE = 5
_NAME = Entry(0x1008)
_NUMBER = Entry(0x6060)
_SIZE = 8
_ABORT = 4  # the command specifier of both ends
_CHOICE = SignalChoice("FOG_RATE", "rate", counter="counter", status="status", checksum="crc")


class _Objects:
    """A dictionary of two objects, neither longer than the longest that is written here."""

    def __init__(self) -> None:
        self.values = {_NAME: b"northfinder", _NUMBER: b"\x01"}

    def read(self, entry: Entry) -> bytes:
        if entry not in self.values:
            raise AccessError(Abort.NO_OBJECT)
        return self.values[entry]

    def write(self, entry: Entry, value: bytes) -> None:
        if entry not in self.values:
            raise AccessError(Abort.NO_OBJECT)
        self.values[entry] = value


class ServiceRequests:
    """A server: every request of eight bytes is answered in eight, or is an abort."""

    name = "SDO server"

    def __init__(self) -> None:
        self._objects = _Objects()
        self._server = SdoServer(self._objects)

    def valid(self) -> list[CanFrame]:
        """Return the requests of reading and writing both objects."""
        transfers = [
            Transfer(entry, value)
            for entry in (_NAME, _NUMBER)
            for value in (None, b"\x02", b"a longer name")
        ]
        return [frame for each in transfers for frame in _requests(each, SdoServer(_Objects()))]

    def take(self, frames: Sequence[CanFrame]) -> int:
        """Answer each; return how many were refused."""
        refused = 0
        for frame in frames:
            answer = self._server.answer(frame.data)
            is_request = len(frame.data) == _SIZE and frame.data[0] >> 5 != _ABORT
            if is_request != (answer is not None) or len(answer or bytes(_SIZE)) != _SIZE:
                msg = f"the request {frame.data.hex()} was answered with {answer!r}"
                raise AssertionError(msg)
            refused += answer is None or answer[0] >> 5 == _ABORT
        return refused

    def missed(self) -> int:
        """Return whether a name that is written then is not read back."""
        for transfer in (writing := Transfer(_NAME, b"northfinder"), reading := Transfer(_NAME)):
            _requests(transfer, self._server)
        return int((writing.result, reading.result) != (b"", b"northfinder"))


class ServiceAnswers:
    """A client: an answer that belongs brings its transfer on or ends it, any other is left out."""

    name = "SDO client"

    def __init__(self) -> None:
        self._begun = 0
        self._transfer = self._next()

    def valid(self) -> list[CanFrame]:
        """Return the answers to reading and writing."""
        server, answers = SdoServer(_Objects()), []
        for transfer in (Transfer(_NAME), Transfer(_NAME, b"another name"), Transfer(_NUMBER)):
            answers += [server.answer(frame.data) for frame in _requests(transfer, server)]
        return [CanFrame(0x580 + _NODE, answer) for answer in answers if answer is not None]

    def take(self, frames: Sequence[CanFrame]) -> int:
        """Take what belongs; return how many did not."""
        refused = 0
        for frame in frames:
            if not self._transfer.belongs(frame.data):
                refused += 1
                continue
            request = self._transfer.answer(frame.data)
            over = self._transfer.result is not None
            if not (over or request) or len(request or bytes(_SIZE)) != _SIZE:
                msg = f"after {frame.data.hex()} the client asks {request!r}"
                raise AssertionError(msg)
            if over:
                self._transfer = self._next()
        return refused

    def missed(self) -> int:
        """Return whether a transfer begun afterwards does not read the name."""
        reading = Transfer(_NAME)
        _requests(reading, SdoServer(_Objects()))
        return int(reading.result != b"northfinder")

    def _next(self) -> Transfer:
        """Begin the next: reading and writing, short and long, in turn."""
        self._begun += 1
        entry = (_NAME, _NUMBER)[self._begun % 2]
        transfer = Transfer(entry, (None, b"\x02", b"a longer name")[self._begun % 3])
        transfer.begin()
        return transfer


class DbcMessages:
    """A DBC gyro with a checksum: only frames that hold it are read."""

    name = "DBC"

    def __init__(self) -> None:
        text = (files("drivers") / "dbc_files" / "northfinder-fog.dbc").read_text("utf-8")
        self._decoder = DbcDecoder(text, _CHOICE)
        self._rates = np.linspace(-1.0, 1.0, 256)

    def valid(self) -> list[CanFrame]:
        """Return 256 rates, counted."""
        return self._decoder.encode(self._rates, np.arange(256))

    def take(self, frames: Sequence[CanFrame]) -> int:
        """Read them; return how many are malformed."""
        before = self._decoder.malformed
        read = self._decoder.decode(frames)
        malformed = self._decoder.malformed - before
        if len(read.value) + malformed != len(frames) or not np.isfinite(read.value).all():
            msg = f"of {len(frames)} frames {len(read.value)} were read and {malformed} refused"
            raise AssertionError(msg)
        return malformed

    def missed(self) -> int:
        """Return how many of the rates are not read back to half a count."""
        read = self._decoder.decode(self.valid())
        if len(read.value) != len(self._rates):
            return len(self._rates)
        apart = np.abs(read.value - self._rates) > 0.51 * self._decoder.resolution
        return int(apart.sum() + (~read.valid).sum())


def _requests(transfer: Transfer, server: SdoServer) -> list[CanFrame]:
    """Carry a transfer out and return its requests."""
    requests: list[CanFrame] = []
    request: bytes | None = transfer.begin()
    while request is not None and len(requests) < 100:
        requests.append(CanFrame(0x600 + _NODE, request))
        answer = server.answer(request)
        request = transfer.answer(answer) if answer is not None else None
    return requests
