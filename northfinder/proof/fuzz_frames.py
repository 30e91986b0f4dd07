"""The codecs of CAN frames under noise: each says what must hold whatever a frame carries."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Protocol

import numpy as np
from numpy.random import Generator

from drivers.codecs.canopen import (
    Emergency,
    NmtCommand,
    NmtState,
    decode_emergency,
    decode_heartbeat,
    decode_nmt,
    encode_emergency,
    encode_heartbeat,
    encode_nmt,
    is_sync,
)
from drivers.codecs.cia402 import State
from drivers.codecs.cia410 import specific_force, unit_rad
from drivers.codecs.pdo import Mapped, decode_pdo, encode_pdo, signed
from drivers.codecs.sdo import Entry
from drivers.interfaces import CanFrame
from northfinder.proof.figure import Figure
from northfinder.proof.noise import SEED, flipped, held_bytes

_BATCH = 1000
_HELD_BYTES = 1 << 18  # an SDO transfer holds at most 64 kB each way
_NODE = 5


class FrameCodec(Protocol):
    """Frames in; what is no good frame is told apart from what is."""

    name: str

    def valid(self) -> list[CanFrame]:
        """Return good frames, for the fuzz to damage."""

    def take(self, frames: Sequence[CanFrame]) -> int:
        """Take frames as they come; return how many were refused.

        Raises:
            AssertionError: A frame was taken for what it is not.
        """

    def missed(self) -> int:
        """Return how many of the good frames are not understood afterwards."""


def fuzz_frames(codec: FrameCodec, total_bytes: int) -> Iterator[Figure]:
    """Feed a codec damaged frames until they have carried so many bytes."""
    random = np.random.default_rng(SEED)
    noise, carried, refused, most = damaged_frames(codec.valid(), random), 0, 0, 0
    while carried < total_bytes:
        batch = list(islice(noise, _BATCH))
        carried += sum(len(frame.data) for frame in batch)
        refused += codec.take(batch)
        most = max(most, held_bytes(codec))
    name = f"{codec.name}, {total_bytes:,} bytes, {refused:,} frames refused"
    yield Figure(f"{name}: held", float(most), "bytes", None, _HELD_BYTES)
    yield Figure(f"{name}: then missed", float(codec.missed()), "frames", None, 0.0)


def damaged_frames(valid: Sequence[CanFrame], random: Generator) -> Iterator[CanFrame]:
    """Yield good frames, damaged in one of six ways or not at all."""
    while True:
        kinds, picks = random.integers(0, 7, _BATCH), random.integers(0, len(valid), (_BATCH, 2))
        for kind, (pick, other) in zip(kinds.tolist(), picks.tolist(), strict=True):
            yield _damaged(kind, valid[pick], valid[other], random)


def _damaged(  # noqa: PLR0911 (one a kind)
    kind: int, frame: CanFrame, other: CanFrame, random: Generator
) -> CanFrame:
    match kind:
        case 0:
            return frame._replace(data=random.bytes(int(random.integers(65))))
        case 1:
            return frame._replace(data=flipped(frame.data, random))
        case 2:
            return frame._replace(data=frame.data[: int(random.integers(len(frame.data) + 1))])
        case 3:
            return frame._replace(data=frame.data[:3] + other.data[3:])
        case 4:
            return CanFrame(int(random.integers(1 << 29)), frame.data, extended=True)
        case 5:
            return frame._replace(can_id=other.can_id, remote=bool(random.integers(2)))
        case _:
            return frame


class Canopen:
    """NMT, heartbeat, emergency and SYNC: what is decoded encodes to the frame that came."""

    name = "CANopen"

    def valid(self) -> list[CanFrame]:
        """Return one of each kind and state."""
        commands = [encode_nmt(command, _NODE) for command in NmtCommand]
        beats = [encode_heartbeat(_NODE, state) for state in NmtState]
        return [*commands, *beats, encode_emergency(_NODE, Emergency(0x8130, 0x11)), CanFrame(0x80)]

    def take(self, frames: Sequence[CanFrame]) -> int:
        """Hold that no frame says what its bytes do not."""
        return sum(not _is_canopen(frame) for frame in frames)

    def missed(self) -> int:
        """Return how many of the good ones are not understood."""
        return self.take(self.valid())


def _is_canopen(frame: CanFrame) -> bool:
    command, beat = decode_nmt(frame), decode_heartbeat(frame)
    emergency, sync = decode_emergency(frame, _NODE), is_sync(frame)
    _require(command is None or encode_nmt(*command) == frame, frame)
    _require(emergency is None or encode_emergency(_NODE, emergency) == frame, frame)
    # Of a heartbeat, bit 7 is a toggle that says nothing.
    _require(beat is None or encode_heartbeat(*beat).data[0] == frame.data[0] & 0x7F, frame)
    return any((command, beat, emergency, sync))


class ProcessData:
    """A CiA 402 drive's and a CiA 410 inclinometer's process data."""

    name = "PDO, CiA 402, CiA 410"
    _DRIVE = (Mapped(Entry(0x6041), 16), Mapped(Entry(0x6064), 32))
    _SLOPES = (Mapped(Entry(0x6110), 32), Mapped(Entry(0x6120), 32))

    def valid(self) -> list[CanFrame]:
        """Return a statusword and position of every state, and slopes."""
        drives = [
            {self._DRIVE[0].entry: state.bits, self._DRIVE[1].entry: -12345} for state in State
        ]
        slopes = {self._SLOPES[0].entry: 1500, self._SLOPES[1].entry: -700}
        sent = [CanFrame(0x185, encode_pdo(self._DRIVE, values)) for values in drives]
        return [*sent, CanFrame(0x186, encode_pdo(self._SLOPES, slopes))]

    def take(self, frames: Sequence[CanFrame]) -> int:
        """Read each frame both ways; what is long enough has a state, and slopes a force."""
        counts = [counts for frame in frames if (counts := self._slopes(frame)) is not None]
        slopes_rad = unit_rad(1) * np.array(counts, float).reshape(-1, 2)
        force_g = specific_force(slopes_rad[:, 0], slopes_rad[:, 1])
        steep = (np.sin(slopes_rad) ** 2).sum(-1) > 1.0
        _require(bool((np.isnan(force_g[:, 2]) <= steep + 1e-9).all()), "a force of no slope")
        return sum(self._state(frame) is None for frame in frames)

    def missed(self) -> int:
        """Return how many states, and slopes, are not read back."""
        *drives, slopes = self.valid()
        read = [self._state(frame) for frame in drives]
        wrong = sum(ours is not state for ours, state in zip(read, State, strict=True))
        return wrong + (self._slopes(slopes) != (1500, -700))

    def _state(self, frame: CanFrame) -> State | None:
        values = decode_pdo(self._DRIVE, frame.data)
        if values is None:
            return None
        _require(encode_pdo(self._DRIVE, values) == frame.data[:6], frame)
        return State.of(values[self._DRIVE[0].entry])

    def _slopes(self, frame: CanFrame) -> tuple[int, int] | None:
        values = decode_pdo(self._SLOPES, frame.data)
        if values is None:
            return None
        longitudinal, lateral = (signed(values[each.entry], 32) for each in self._SLOPES)
        return longitudinal, lateral


def _require(holds: bool, what: object) -> None:
    if not holds:
        msg = f"taken for what it is not: {what}"
        raise AssertionError(msg)
