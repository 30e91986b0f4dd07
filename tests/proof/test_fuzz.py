"""The short form of `northfinder bench fuzz`, and that it would find what it looks for."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import pytest

from drivers.codecs.kvh import KvhDecoder
from drivers.codecs.sdo import CAPACITY_BYTES, Abort, Aborted, Entry
from drivers.codecs.sdo_client import Transfer
from drivers.interfaces import CanFrame
from northfinder.proof.fuzz import fuzz_stream
from northfinder.proof.fuzz_frames import Canopen, FrameCodec, ProcessData, fuzz_frames
from northfinder.proof.fuzz_requests import DbcMessages, ServiceAnswers, ServiceRequests
from northfinder.proof.fuzz_streams import STREAMS, StreamCodec
from northfinder.proof.noise import held_bytes

SHORT = 100_000
KVH = STREAMS[0]


@pytest.mark.parametrize("codec", STREAMS, ids=lambda codec: codec.name)
def test_noise_on_a_line_is_counted_and_nothing_else(codec: StreamCodec) -> None:
    figures = list(fuzz_stream(codec, SHORT))
    assert len(figures) == (4 if codec.bounded_undrained else 2)
    for figure in figures:
        assert figure.met, figure


@pytest.mark.parametrize(
    "codec", [Canopen, ProcessData, ServiceRequests, ServiceAnswers, DbcMessages]
)
def test_noise_on_a_bus_is_refused_and_nothing_else(codec: type[FrameCodec]) -> None:
    for figure in fuzz_frames(codec(), SHORT):
        assert figure.met, figure
        assert " 0 frames refused" not in figure.name


class Hoarder(KvhDecoder):
    def receive_data(self, data: bytes) -> None:
        super().receive_data(data)
        self.hoard = getattr(self, "hoard", b"") + data


class Deafened(KvhDecoder):
    def next_event(self) -> Any:  # noqa: ANN401
        return None if self.crc_errors > 20 else super().next_event()


class Touchy(KvhDecoder):
    def next_event(self) -> Any:  # noqa: ANN401
        if self.crc_errors > 20:
            msg = "one error too many"
            raise ValueError(msg)
        return super().next_event()


@pytest.mark.parametrize(("decoder", "what"), [(Hoarder, "held"), (Deafened, "then missed")])
def test_a_decoder_that_hoards_or_goes_deaf_is_found(decoder: type[KvhDecoder], what: str) -> None:
    figures = fuzz_stream(replace(KVH, decoder=decoder, bounded_undrained=False), SHORT)
    assert what in [figure.name.rpartition(": ")[2] for figure in figures if not figure.met]


def test_a_decoder_that_raises_ends_the_measurement() -> None:
    with pytest.raises(ValueError, match="one error too many"):
        list(fuzz_stream(replace(KVH, decoder=Touchy), SHORT))


class Credulous(Canopen):
    def take(self, frames: Sequence[CanFrame]) -> int:
        return super().take([frame._replace(remote=False) for frame in frames]) + 1


def test_frames_that_are_refused_afterwards_are_missed() -> None:
    assert [figure.met for figure in fuzz_frames(Credulous(), SHORT)] == [True, False]


def endless_segments(head: int) -> Iterator[bytes]:
    """Segments of seven bytes that never say that they are the last."""
    while True:
        for toggle in (0x00, 0x10):
            yield bytes((head | toggle,)) + b"endless"


def test_an_object_that_never_ends_is_refused_by_the_server_and_forgotten() -> None:
    codec = ServiceRequests()
    codec.take([CanFrame(0x605, bytes((0x21, 0x08, 0x10, 0)) + b"\xff\xff\xff\xff")])
    segments = endless_segments(0x00)
    taken = 0
    while codec.take([CanFrame(0x605, next(segments))]) == 0:
        taken += 7
        assert taken <= CAPACITY_BYTES + 7
    assert taken > CAPACITY_BYTES - 7
    assert held_bytes(codec) < 1000
    assert codec.missed() == 0


def test_an_object_that_never_ends_is_aborted_by_the_client() -> None:
    name = Entry(0x1008)
    transfer = Transfer(name)
    transfer.begin()
    transfer.answer(bytes((0x41, 0x08, 0x10, 0)) + b"\xff\xff\xff\xff")
    for count, segment in enumerate(endless_segments(0x00), start=1):
        transfer.answer(segment)
        if transfer.result is not None:
            break
        assert 7 * count <= CAPACITY_BYTES + 7
    assert transfer.result == Aborted(name, Abort.OUT_OF_MEMORY)
