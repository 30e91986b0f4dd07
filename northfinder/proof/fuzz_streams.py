"""The codecs of byte streams, each with valid traffic for the fuzz to damage."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.random import Generator

from drivers.codecs import zaber
from drivers.codecs.kvh import FrameBlock, KvhDecoder, OutputFormat, encode_bit, encode_frames
from drivers.codecs.kvh_bit import BitResult
from drivers.codecs.kvh_commands import Command, CommandDecoder, encode_command, encode_reply
from drivers.codecs.stim300 import Stim300Decoder
from drivers.codecs.stim300_data import LAYOUTS, DataBlock, decode_data, encode_data
from drivers.codecs.stim300_special import (
    ExtendedError,
    PartNumber,
    SerialNumber,
    Special,
    encode_special,
)
from drivers.codecs.stim300_utility import UtilityReply, encode_utility


class StreamDecoder(Protocol):
    """Bytes in, events out."""

    def receive_data(self, data: bytes) -> None:
        """Append raw bytes."""

    def next_event(self) -> Any | None:  # noqa: ANN401 (each codec has events of its own)
        """Return the next event, or None when more bytes are needed."""


@dataclass(frozen=True, slots=True)
class StreamCodec:
    """A decoder and what is said to it.

    Attributes:
        name: Of the codec.
        decoder: Makes one.
        messages: Makes valid traffic, one message an entry.
        singly: Unbundles events, so that they compare.
        counted: What a decoder has counted of damage.
        bounded_undrained: Whether it promises to bear that nobody reads its events.
    """

    name: str
    decoder: Callable[[], StreamDecoder]
    messages: Callable[[Generator], list[bytes]]
    singly: Callable[[Iterable[Any]], Iterator[object]]
    counted: Callable[[Any], int]
    bounded_undrained: bool = True


class _Ear(CommandDecoder):
    """The KVH's own end, which has commands for events."""

    next_event = CommandDecoder.next_command


def _kvh_messages(random: Generator) -> list[bytes]:
    messages = [encode_reply("KVH INDUSTRIES, INC. 1750 IMU"), encode_reply("BAUD,460800")]
    messages += [encode_bit(BitResult(bytes([0x7F] * count))) for count in (6, 8)]
    for form in OutputFormat:
        records = np.frombuffer(random.bytes(40 * form.dtype.itemsize), form.dtype)
        stream, size = encode_frames(FrameBlock(form, records)), form.dtype.itemsize
        messages += [stream[start : start + size] for start in range(0, len(stream), size)]
    return messages


def _kvh_singly(events: Iterable[Any]) -> Iterator[object]:
    for event in events:
        if isinstance(event, FrameBlock):
            yield from ((event.format, record.tobytes()) for record in event.records)
        else:
            yield event


def _command_messages(random: Generator) -> list[bytes]:
    names = ("CONFIG", "OUTPUTFMT", "DR", "BIT", "TEMPUNITS", "ROTFMT")
    texts = [f"{random.choice(names)},{random.integers(10)}" for _ in range(60)]
    return [encode_command(Command(str(random.choice(["=", "?"])), text)) for text in texts]


def _stim300_messages(random: Generator) -> list[bytes]:
    specials: tuple[Special, ...] = (
        PartNumber("84167-400000-0A1B", "1"),
        SerialNumber("25581846020020"),
        ExtendedError(1 << 77),
    )
    messages = [encode_special(each, terminated=bool(i % 2)) for i, each in enumerate(specials)]
    messages += [encode_utility(UtilityReply("iu", 0, ("3",))) for _ in range(3)]
    for i, layout in enumerate(LAYOUTS.values()):
        block = decode_data(layout, random.bytes(8 * layout.size))
        messages += encode_data(block, terminated=bool(i % 2))
    return messages


def _stim300_singly(events: Iterable[Any]) -> Iterator[object]:
    for event in events:
        if isinstance(event, DataBlock):
            yield from encode_data(event, terminated=False)
        else:
            yield event


def _zaber_messages(random: Generator) -> list[bytes]:
    messages: list[zaber.Message] = []
    for message_id in range(60):
        position = int(random.integers(-(1 << 31), 1 << 31))
        messages += [
            zaber.Command(f"move abs {position}", 1, 1, message_id),
            zaber.Reply(1, 1, accepted=True, busy=True, warning="--", data=str(position)),
            zaber.Reply(1, 1, accepted=False, busy=False, warning="WR", data="BADDATA"),
            zaber.Info(1, 0, "a line of help"),
            zaber.Alert(1, 1, busy=False, warning="FS"),
        ]
    return [zaber.encode(message) for message in messages]


STREAMS = (
    StreamCodec(
        "KVH",
        KvhDecoder,
        _kvh_messages,
        _kvh_singly,
        lambda decoder: decoder.crc_errors + decoder.discarded_bytes,
    ),
    StreamCodec(
        "KVH commands",
        _Ear,
        _command_messages,
        iter,
        lambda _: 0,  # the instrument answers what it does not know; it counts nothing
        bounded_undrained=False,
    ),
    StreamCodec(
        "STIM300",
        Stim300Decoder,
        _stim300_messages,
        _stim300_singly,
        lambda decoder: decoder.crc_errors + decoder.discarded_bytes,
    ),
    StreamCodec(
        "Zaber",
        zaber.ZaberDecoder,
        _zaber_messages,
        iter,
        lambda decoder: decoder.crc_errors + decoder.garbage_bytes,
    ),
)
