"""Zaber ASCII decodes alike however the line cuts it, and noise is only counted."""

import string
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.codecs.zaber import (
    REJECTIONS,
    WARNINGS,
    Alert,
    Command,
    Info,
    Message,
    Rejection,
    Reply,
    ZaberDecoder,
    encode,
)

# Recorded from Zaber's own library, or printed in the Zaber ASCII Protocol Manual.
GOLDEN = [
    (b"/0 0 00:00\n", Command(message_id=0)),
    (b"/1 1 04 home:31\n", Command("home", 1, 1, 4)),
    (b"/1 1 13 move abs 10000:BC\n", Command("move abs 10000", 1, 1, 13)),
    (b"/1 0 01 get comm.packet.size.max:CF\n", Command("get comm.packet.size.max", 1, 0, 1)),
    (b"/1 1 05:F9\n", Command("", 1, 1, 5)),
    (b"/1 1 12 warnings:72\n", Command("warnings", 1, 1, 12)),
    (b"/0 0 set comm.alert 1:B1\n", Command("set comm.alert 1")),
    (b"@01 0 OK IDLE -- 0:8D\r\n", Reply(1, 0, True, False, "--")),
]
UNPROTECTED = [
    (b"/\n", Command()),
    (b"/home\n", Command("home")),
    (b"/1 home\r", Command("home", 1)),
    (b"/ 1  2  move rel -5 \r\n", Command("move rel -5", 1, 2)),
    (b"@02 1 07 RJ BUSY WR BADDATA\r\n", Reply(2, 1, False, True, "WR", "BADDATA", 7)),
    (b"@01 1 OK IDLE FS 02 FS WR\r\n", Reply(1, 1, True, False, "FS", "02 FS WR")),
    (b"#01 0 05 limit.cycle.dist\r\n", Info(1, 0, "05 limit.cycle.dist")),
    (b"!01 1 IDLE --\r\n", Alert(1, 1, False, "--")),
]

words = st.text(string.ascii_lowercase + string.digits + "._-", min_size=1, max_size=8)
texts = st.builds(
    lambda first, rest: " ".join([first, *rest]),
    st.text(string.ascii_lowercase, min_size=1, max_size=6),
    st.lists(words, max_size=3),
)
message_ids = st.none() | st.integers(0, 99)
flags = st.sampled_from(["--", *WARNINGS])
devices, axes = st.integers(1, 99), st.integers(0, 9)
messages: st.SearchStrategy[Message] = st.one_of(
    st.builds(Command, st.just("") | texts, st.integers(0, 99), axes, message_ids),
    st.builds(Reply, devices, axes, st.booleans(), st.booleans(), flags, texts, message_ids),
    st.builds(Info, devices, axes, texts),
    st.builds(Alert, devices, axes, st.booleans(), flags),
)


def decode(*chunks: bytes) -> tuple[ZaberDecoder, list[Message]]:
    decoder = ZaberDecoder()
    events: list[Message] = []
    for chunk in chunks:
        decoder.receive_data(chunk)
        events += list(iter(decoder.next_event, None))
    return decoder, events


@pytest.mark.parametrize(("line", "message"), GOLDEN)
def test_golden_vectors_encode_and_decode(line: bytes, message: Message) -> None:
    assert encode(message) == line
    assert decode(line)[1] == [message]


@pytest.mark.parametrize(("line", "message"), UNPROTECTED)
def test_messages_without_a_checksum_decode_in_every_spelling(
    line: bytes, message: Message
) -> None:
    assert decode(line)[1] == [message]


@given(messages, st.booleans())
def test_every_message_survives_the_round_trip(message: Message, checksum: bool) -> None:
    decoder, events = decode(encode(message, checksum=checksum))
    assert events == [message]
    assert (decoder.frames, decoder.crc_errors, decoder.garbage_bytes) == (1, 0, 0)


@given(st.lists(messages | st.binary(max_size=400), max_size=6), st.data())
def test_chunking_is_invisible(sent: list[Message | bytes], data: st.DataObject) -> None:
    stream = b"".join(item if isinstance(item, bytes) else encode(item) for item in sent)
    cuts = sorted(data.draw(st.sets(st.integers(0, len(stream)), max_size=6)))
    edges = [0, *cuts, len(stream)]
    chunks = [stream[a:b] for a, b in pairwise(edges)]
    whole, pieces = decode(stream + b"\n"), decode(*chunks, b"\n")
    assert pieces[1] == whole[1]
    assert pieces[0].crc_errors == whole[0].crc_errors
    assert pieces[0].garbage_bytes == whole[0].garbage_bytes


@given(st.binary(max_size=600), messages)
def test_garbage_never_raises_and_a_message_after_it_is_found(
    garbage: bytes, message: Message
) -> None:
    assert decode(garbage + b"\n" + encode(message))[1][-1:] == [message]


@given(messages, st.data())
def test_a_changed_byte_before_the_checksum_loses_the_message(
    message: Message, data: st.DataObject
) -> None:
    line = bytearray(encode(message))
    line[data.draw(st.integers(1, len(line) - 6))] ^= 1 << data.draw(st.integers(0, 3))
    assert decode(bytes(line))[1] == []


def test_a_wrong_checksum_is_dropped_and_counted() -> None:
    decoder, events = decode(b"@01 0 OK IDLE -- 0:8E\r\n@01 0 OK IDLE -- 0:8D\r\n")
    assert len(events) == decoder.crc_errors == decoder.frames == 1


def test_once_a_device_sent_checksums_a_reply_without_one_is_damaged() -> None:
    decoder, events = decode(b"@01 0 OK IDLE -- 0:8D\r\n@01 0 OK IDLE -- 0;8D\r\n")
    assert (len(events), decoder.crc_errors) == (1, 1)


def test_noise_in_front_of_a_message_hides_nothing_although_it_holds_start_characters() -> None:
    decoder, events = decode(b"\xfe@!#01@01 0 OK IDLE -- 0:8D\r\n")
    assert events == [Reply(1, 0, True, False, "--")]
    assert decoder.garbage_bytes == 6


def test_a_line_that_never_ends_is_thrown_away_and_keeps_no_memory() -> None:
    decoder, events = decode(b"@" * 100_000, b"\r\n", b"!01 1 IDLE --\r\n")
    assert events == [Alert(1, 1, False, "--")]
    assert decoder.garbage_bytes == 100_000
    assert len(decoder._buffer) == 0


@pytest.mark.parametrize("text", ["a:b", "caf\u00e9", "move\nabs"])
def test_what_the_protocol_cannot_carry_is_the_callers_bug(text: str) -> None:
    with pytest.raises(ValueError, match="printable ASCII"):
        encode(Command(text))


def test_flags_and_reasons_have_words() -> None:
    listed = "FF FN FZ FH FV FO FC FM FD FQ FI FA FR FS FB FP FE FT WL WV WT WS WM WP WR WH NC"
    assert " ".join(WARNINGS).startswith(listed)  # the manual's order: the gravest first
    assert set(REJECTIONS) == set(Rejection)


def test_what_nobody_drains_is_bounded() -> None:
    decoder, reply = ZaberDecoder(), b"@01 0 OK IDLE -- 0\r\n"
    for _ in range(10_000):
        decoder.receive_data(reply)
    messages = list(iter(decoder.next_event, None))
    assert len(messages) == (1 << 16) // len(reply)
