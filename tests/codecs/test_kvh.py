"""KVH frames, BIT results and commands decode alike however the link cuts and spoils them."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.codecs.kvh import (
    Event,
    FrameBlock,
    KvhDecoder,
    OutputFormat,
    Reply,
    encode_bit,
    encode_frames,
)
from drivers.codecs.kvh_bit import BitResult, describe
from drivers.codecs.kvh_commands import Command, CommandDecoder, encode_command, encode_reply

# KVH ICD 56-0298 Rev. B section 5.2.1, and frames recorded by the ros_kvh1750 project.
ICD_SAMPLE = "FE81FF55 37A96A6E 38586C1F B75BF862 BF803E78 BB650D28 3B0A37AC 77 3D 0028 4BFA34D8"
STATUS_70 = "FE81FF55 3B041F78 B9B96613 BA234B38 BB7C0410 B8DEF480 3F7F4B7B 70 1F 001D F12FB6EE"
SEQUENCE_104 = "FE81FF55 B3D0BBE7 32193EF4 30AC19A5 BA8F78D6 3A290594 3F7ECBD4 77 68 001D ADC5F651"
BAD_CRC = "FE81FF55 B46B86C6 B44F5B83 B4106D09 BB713CB7 BBABD914 3F7E319A 77 69 001D 95BBDB4F"
MENDED_CRC = BAD_CRC.replace("95BBDB4F", "14DC0D3A")


def decode(*chunks: bytes) -> tuple[list[Event], KvhDecoder]:
    decoder = KvhDecoder()
    events: list[Event] = []
    for chunk in chunks:
        decoder.receive_data(chunk)
        events += iter(decoder.next_event, None)
    return events, decoder


def only_block(raw: str) -> FrameBlock:
    events, _ = decode(bytes.fromhex(raw))
    (block,) = events
    assert isinstance(block, FrameBlock)
    return block


def flatten(events: list[Event]) -> list[object]:
    """Blocks taken apart into frames, for how many make a block depends on the chunks."""
    flat: list[object] = []
    for event in events:
        if isinstance(event, FrameBlock):
            flat += [(event.format, record.tobytes()) for record in event.records]
        else:
            flat.append(event)
    return flat


def frames_of(form: OutputFormat, count: int, seed: int = 1) -> bytes:
    rng = np.random.default_rng(seed)
    records = np.zeros(count, form.dtype)
    records["gyro"] = rng.normal(0.0, 1e-4, (count, 3))
    records["acceleration"] = rng.normal(0.0, 1.0, (count, 3))
    records["status"] = 0x77
    records["sequence"] = np.arange(count) % 128
    return encode_frames(FrameBlock(form, records))


def test_the_manuals_sample_frame_decodes_to_the_printed_values() -> None:
    block = only_block(ICD_SAMPLE)
    assert block.format is OutputFormat.A
    np.testing.assert_allclose(block.gyro, [[2.019593e-5, 5.159911e-5, -1.3111248e-5]], rtol=1e-6)
    np.testing.assert_allclose(block.acceleration, [[-1.0019064, -0.0034950, 0.0021090]], rtol=1e-4)
    assert (block.status[0], block.sequence[0], block.temperature[0]) == (0x77, 61, 40.0)


def test_recorded_frames_decode_to_their_published_values() -> None:
    invalid = only_block(STATUS_70)
    assert (invalid.status[0], invalid.sequence[0], invalid.temperature[0]) == (0x70, 31, 29.0)
    assert invalid.acceleration[0, 2] == pytest.approx(0.9972455, rel=1e-7)
    good = only_block(SEQUENCE_104)
    assert good.sequence[0] == 104
    assert good.gyro[0, 0] == pytest.approx(-9.719934e-8, rel=1e-6)


@pytest.mark.parametrize("raw", [ICD_SAMPLE, STATUS_70, SEQUENCE_104, MENDED_CRC])
def test_frames_encode_to_the_bytes_they_came_from(raw: str) -> None:
    assert encode_frames(only_block(raw)) == bytes.fromhex(raw)


def test_a_frame_with_a_wrong_crc_is_counted_and_its_neighbours_survive() -> None:
    events, decoder = decode(bytes.fromhex(ICD_SAMPLE + BAD_CRC + SEQUENCE_104))
    sequences = [s for event in events if isinstance(event, FrameBlock) for s in event.sequence]
    assert sequences == [61, 104]
    assert (decoder.crc_errors, decoder.discarded_bytes) == (1, 36)


@pytest.mark.parametrize(
    ("raw", "failed", "words"),
    [
        ("FE8100AA 7F7F7F7F7F7F 23", set(), ""),
        (
            "FE8100AA 7F7F7E7B7F7F 1E",
            {16, 26},
            "accelerometer Z, accelerometer Z temperature",
        ),
        ("FE8100AB 7F7F7F7F7F7F377F DA", {51, 54}, "gyro board Y voltage, magnetometer offset"),
        # The manual prints 1E and 23 under these two; the sums are 17 and, with AB, 22.
        ("FE8100AA 777F7B7F7F7F 17", {3, 18}, "gyro X flash, gyro X light source temperature"),
        ("FE8100AB 7F7F7F7F7F7F7F7F 22", set(), ""),
    ],
)
def test_bit_frames_name_what_failed(raw: str, failed: set[int], words: str) -> None:
    (result,), _ = decode(bytes.fromhex(raw))
    assert isinstance(result, BitResult)
    assert result.failed == failed
    assert describe(result.failed) == words
    assert encode_bit(result) == bytes.fromhex(raw)


def test_the_manuals_misprinted_bit_frame_is_a_checksum_error() -> None:
    events, decoder = decode(bytes.fromhex("FE8100AA 777F7B7F7F7F 1E") + b"\r\n")
    assert not [event for event in events if not isinstance(event, Reply)]
    assert decoder.crc_errors == 1


def test_a_test_without_a_name_is_told_by_its_number() -> None:
    assert describe(frozenset({15})) == "test 15"


def test_format_c_has_38_bytes_and_its_temperature_in_every_fourth_frame() -> None:
    records = np.zeros(4, OutputFormat.C.dtype)
    records["sequence"], records["cycling"] = [4, 5, 6, 7], [31.5, 0.1, 0.2, 0.3]
    raw = encode_frames(FrameBlock(OutputFormat.C, records))
    assert len(raw) == 4 * 38
    (block,), _ = decode(raw)
    assert isinstance(block, FrameBlock)
    np.testing.assert_array_equal(block.temperature, [31.5, np.nan, np.nan, np.nan])


def test_nan_and_infinity_in_a_good_frame_come_through() -> None:
    records = np.zeros(1, OutputFormat.A.dtype)
    records["gyro"] = np.array([[0x7F800001, 0x7F800000, 0x7FC00000]], ">u4").view(">f4")
    (block,), _ = decode(encode_frames(FrameBlock(OutputFormat.A, records)))
    assert isinstance(block, FrameBlock)
    np.testing.assert_array_equal(block.gyro, [[np.nan, np.inf, np.nan]])


def test_replies_and_frames_take_turns_without_losing_either() -> None:
    form_a, form_b = frames_of(OutputFormat.A, 2), frames_of(OutputFormat.B, 3)
    stream = form_a + b"CONFIG,1\r\nIS,170042\r" + b"DR,100\n" + form_b
    events, decoder = decode(stream)
    kinds = [e.text if isinstance(e, Reply) else len(flatten([e])) for e in events]
    assert kinds == [2, "CONFIG,1", "IS,170042", "DR,100", 3]
    assert (decoder.crc_errors, decoder.discarded_bytes) == (0, 0)


def test_a_header_within_the_payload_does_not_mislead() -> None:
    records = np.zeros(3, OutputFormat.A.dtype)
    records["gyro"] = np.full((3, 3), 0xFE81FF55, ">u4").view(">f4")
    raw = encode_frames(FrameBlock(OutputFormat.A, records))
    events, decoder = decode(raw[10:])  # begins within a frame: two payload headers come first
    assert len(flatten(events)) == 2
    assert decoder.discarded_bytes == 26


def test_what_nobody_drains_is_bounded() -> None:
    decoder = KvhDecoder()
    for _ in range(5):
        decoder.receive_data(bytes(1 << 20))
    assert decoder.next_event() is None
    assert decoder.discarded_bytes == 5 << 20


streams = st.lists(
    st.one_of(
        st.builds(frames_of, st.sampled_from(OutputFormat), st.integers(1, 5), st.integers(0, 9)),
        st.sampled_from([b"CONFIG,1\r\n", b"INVALID,=FOO\r", bytes.fromhex("FE8100AA" + "7F" * 7)]),
        st.binary(max_size=80),
        st.just(b"x" * 1200),
        st.just(b"\xfe\x81\xff"),
    ),
    max_size=6,
).map(b"".join)


@given(stream=streams, cuts=st.lists(st.integers(0, 500), max_size=8))
def test_chunking_is_invisible(stream: bytes, cuts: list[int]) -> None:
    edges = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    ways = (
        [stream],
        [stream[i : i + 1] for i in range(len(stream))],
        [stream[a:b] for a, b in pairwise(edges)],
    )
    outcomes = []
    for chunks in ways:
        events, decoder = decode(*chunks)
        outcomes.append((flatten(events), decoder.crc_errors, decoder.discarded_bytes))
    assert outcomes[0] == outcomes[1] == outcomes[2]


@given(form=st.sampled_from(OutputFormat), raw=st.binary(min_size=200, max_size=200))
def test_any_frame_comes_back_bit_for_bit(form: OutputFormat, raw: bytes) -> None:
    sent = encode_frames(FrameBlock(form, np.frombuffer(raw, form.dtype, 5)))
    (block,), _ = decode(sent)
    assert isinstance(block, FrameBlock)
    assert block.records.tobytes() == sent


@given(position=st.integers(0, 359), change=st.integers(1, 255))
def test_a_corrupted_byte_costs_its_frame_only(position: int, change: int) -> None:
    raw = bytearray(frames_of(OutputFormat.A, 10))
    raw[position] ^= change
    events, decoder = decode(bytes(raw))
    sequences = [int(s) for e in events if isinstance(e, FrameBlock) for s in e.sequence]
    assert sequences == [n for n in range(10) if n != position // 36]
    assert 0 < decoder.discarded_bytes <= 36


@given(st.binary(max_size=400))
def test_garbage_never_raises(garbage: bytes) -> None:
    decode(garbage)


commands = st.builds(
    Command,
    st.sampled_from("=?"),
    st.from_regex(r"[A-Z]{2,9}(,[A-Z0-9_]{1,6}){0,2}", fullmatch=True),
)


@given(sent=st.lists(commands, max_size=4), size=st.integers(1, 40))
def test_commands_come_back_however_they_are_cut(sent: list[Command], size: int) -> None:
    stream = b"".join(map(encode_command, sent))
    decoder = CommandDecoder()
    received: list[Command] = []
    for start in range(0, len(stream), size):
        decoder.receive_data(stream[start : start + size])
        received += iter(decoder.next_command, None)
    assert received == sent


def test_commands_may_be_in_any_case_and_end_in_cr_or_lf() -> None:
    decoder = CommandDecoder()
    decoder.receive_data(b"=rotfmt,Rate\n\r\n?is\rnonsense\r" + b"x" * 1000)
    assert list(iter(decoder.next_command, None)) == [
        Command("=", "ROTFMT,RATE"),
        Command("?", "IS"),
        Command("", "NONSENSE"),
    ]
    assert Command("=", "ROTFMT,RATE").name == "ROTFMT"


def test_a_reply_reads_as_it_was_written() -> None:
    events, _ = decode(encode_reply("ROTFMT,DELTA"))
    assert events == [Reply("ROTFMT,DELTA")]
