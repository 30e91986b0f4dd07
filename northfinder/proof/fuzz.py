"""Noise for every codec, ten million bytes each: errors are counted, and that is all.

A seeded generator damages valid traffic in every way that a line or a liar can: noise, flipped
bits, truncated, spliced and repeated pieces. An exception ends the measurement, with a note of
where it came from; what is held is weighed by pickling the codec, whatever its fields are called.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.random import Generator

from northfinder.proof.figure import Figure
from northfinder.proof.fuzz_streams import STREAMS, StreamCodec, StreamDecoder
from northfinder.proof.noise import SEED, flipped, held_bytes

BYTES = 10_000_000
_TAPE_BYTES = 1 << 16
_CUTS = (1, 3, 36, 500, 4096)
_DRAINED_BYTES = 16_384  # a chunk, the longest message, and what pickle says of them
_UNDRAINED_BYTES = (1 << 22) + 2 * _TAPE_BYTES  # the decoders' own capacity, and a tape or two


def fuzz(total_bytes: int = BYTES) -> Iterator[Figure]:
    """Feed every codec noise; then a valid stream must come through whole.

    Args:
        total_bytes: To each.
    """
    for stream in STREAMS:
        yield from fuzz_stream(stream, total_bytes)
    # Not above: python-can and cantools take half a second, and the command line imports this.
    from northfinder.proof.fuzz_frames import Canopen, ProcessData, fuzz_frames  # noqa: PLC0415
    from northfinder.proof.fuzz_requests import (  # noqa: PLC0415
        DbcMessages,
        ServiceAnswers,
        ServiceRequests,
    )

    for codec in (Canopen, ProcessData, ServiceRequests, ServiceAnswers, DbcMessages):
        yield from fuzz_frames(codec(), total_bytes)


def fuzz_stream(codec: StreamCodec, total_bytes: int) -> Iterator[Figure]:
    """Feed a decoder of bytes, drained as it goes and, where it promises to bear that, not."""
    random = np.random.default_rng(SEED)
    decoder, most = codec.decoder(), 0
    for tape in _tapes(codec, random, total_bytes):
        for chunk in _chopped(tape, random):
            decoder.receive_data(chunk)
            _drain(decoder)
        most = max(most, held_bytes(decoder))
    name = f"{codec.name}, {total_bytes:,} bytes, {codec.counted(decoder):,} errors counted"
    yield Figure(f"{name}: held", float(most), "bytes", None, _DRAINED_BYTES)
    yield Figure(f"{name}: then missed", float(_missed(codec, decoder)), "messages", None, 0.0)
    if codec.bounded_undrained:
        yield from _fuzz_undrained(codec, total_bytes)


def _fuzz_undrained(codec: StreamCodec, total_bytes: int) -> Iterator[Figure]:
    decoder, most = codec.decoder(), 0
    for tape in _tapes(codec, np.random.default_rng(SEED + 1), total_bytes):
        decoder.receive_data(tape)
        most = max(most, held_bytes(decoder))
    _drain(decoder)
    name = f"{codec.name}, {total_bytes:,} bytes that nobody reads"
    yield Figure(f"{name}: held", float(most), "bytes", None, _UNDRAINED_BYTES)
    yield Figure(f"{name}: then missed", float(_missed(codec, decoder)), "messages", None, 0.0)


def _missed(codec: StreamCodec, decoder: StreamDecoder) -> int:
    """Return how many of a valid stream's messages do not come, after one as a lead-in."""
    messages = codec.messages(np.random.default_rng(SEED + 2))
    whole, fresh = b"".join(messages), codec.decoder()
    fresh.receive_data(whole)
    expected = list(codec.singly(_drain(fresh)))
    decoder.receive_data(whole + whole)
    came = list(codec.singly(_drain(decoder)))[-len(expected) :]
    together = zip(reversed(came), reversed(expected), strict=False)
    return len(expected) - sum(ours == theirs for ours, theirs in together)


def _drain(decoder: StreamDecoder) -> list[Any]:
    return list(iter(decoder.next_event, None))


def _tapes(codec: StreamCodec, random: Generator, total_bytes: int) -> Iterator[bytes]:
    """Yield damaged traffic in pieces of 64 kB."""
    messages, made = codec.messages(random), 0
    while made < total_bytes:
        tape = bytearray()
        while len(tape) < min(_TAPE_BYTES, total_bytes - made):
            tape += damaged(messages, random)
        made += len(tape)
        yield bytes(tape)


def damaged(messages: Sequence[bytes], random: Generator) -> bytes:  # noqa: PLR0911 (one a kind)
    """Return a piece of valid traffic, damaged in one of seven ways or not at all."""
    start, count = int(random.integers(len(messages))), int(random.integers(1, 30))
    run, one = b"".join(messages[start : start + count]), messages[start]
    cut = int(random.integers(len(one)))
    match int(random.integers(8)):
        case 0:
            return random.bytes(int(random.integers(1, 2000)))
        case 1:
            return flipped(run, random)
        case 2:
            return run[: -1 - cut]
        case 3:
            return run[cut:]
        case 4:
            return one[:cut] + messages[int(random.integers(len(messages)))][cut:]
        case 5:
            return one[: 1 + cut % 5] * int(random.integers(1, 200))
        case 6:
            return bytes(random.integers(32, 127, int(random.integers(1, 5000)), np.uint8))
        case _:
            return run


def _chopped(tape: bytes, random: Generator) -> Iterator[bytes]:
    place = 0
    while place < len(tape):
        size = int(random.integers(1, 1 + _CUTS[int(random.integers(len(_CUTS)))]))
        yield tape[place : place + size]
        place += size
