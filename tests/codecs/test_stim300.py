"""STIM300's bytes: recorded ones, the data sheet's examples, and every cut and damage of them."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.codecs import stim300_service as service
from drivers.codecs.stim300 import Event, Stim300Decoder
from drivers.codecs.stim300_configuration import (
    STANDARD_GRAVITY_M_S2,
    Configuration,
    configure,
)
from drivers.codecs.stim300_data import (
    AUX_IDS,
    LAYOUTS,
    DataBlock,
    axes_valid,
    concatenate,
    encode_data,
)
from drivers.codecs.stim300_special import (
    BiasTrim,
    ExtendedError,
    PartNumber,
    SerialNumber,
    Special,
    encode_special,
)
from drivers.codecs.stim300_utility import (
    UtilityCommand,
    UtilityReply,
    UtilityStatus,
    decode_command,
    encode_utility,
)
from tests.evidence import Record

VECTORS = Path(__file__).parents[1] / "vectors" / "stim300"
START_UP = bytes.fromhex(
    "9378000078000088 0000ff00b5d8ff87 1700367eef7fffff 4f1ff6800000ff01 01fa2f7d41270d0a"
)
RUNNING = bytes.fromhex(
    "93fffbdb00007cff fcc4000005ce0001 f6040e540000539d ffb2b7402d990041 01fb6073e3de0d0a"
)
GARBAGE_IDS = bytes([*LAYOUTS, 0xB1, 0xB5, 0xBC, 0xBE, 0xD1, *b"#\r\n,0"])


def drain(chunks: Iterable[bytes], decoder: Stim300Decoder | None = None) -> list[Event]:
    decoder = decoder or Stim300Decoder()
    events: list[Event] = []
    for chunk in chunks:
        decoder.receive_data(chunk)
        events += list(iter(decoder.next_event, None))
    return events


def singly(events: Iterable[Event]) -> list[object]:
    """Unbundle the blocks: each datagram as its bytes."""
    flat: list[object] = []
    for event in events:
        if isinstance(event, DataBlock):
            flat += encode_data(event, terminated=False)
        else:
            flat.append(event)
    return flat


def only_block(data: bytes) -> DataBlock:
    (block,) = drain([data])
    assert isinstance(block, DataBlock)
    return block


def random_block(identifier: int, size: int, seed: int) -> DataBlock:
    random = np.random.default_rng(seed)
    layout = LAYOUTS[identifier]
    c, a = len(layout.clusters), int(layout.auxiliary)
    t = c if layout.temperatures else 0
    return DataBlock(
        layout,
        values=random.integers(-(2**23), 2**23, (size, c, 3)),
        status=random.integers(0, 256, (size, c)),
        temperatures=random.integers(-(2**15), 2**15, (size, t, 3)),
        temperature_status=random.integers(0, 256, (size, t)),
        auxiliary=random.integers(0, 2**24, (size, a)),
        auxiliary_status=random.integers(0, 256, (size, a)),
        counter=random.integers(0, 256, size),
        latency_us=random.integers(0, 2**16, size),
    )


blocks = st.builds(
    random_block, st.sampled_from(sorted(LAYOUTS)), st.integers(1, 4), st.integers(0, 2**32)
)
hexadecimal = st.sampled_from("0123456789ABCDEF")
alphanumeric = st.sampled_from("0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ")
part_numbers = st.builds(
    lambda a, b, c, d, e, f: PartNumber(f"{a}-{b}-{c}{d}{e}{f}", "-"),
    st.text(hexadecimal, min_size=5, max_size=5),
    st.text(hexadecimal, min_size=6, max_size=6),
    hexadecimal,
    alphanumeric,
    hexadecimal,
    alphanumeric,
)
specials: st.SearchStrategy[Special] = st.one_of(
    part_numbers,
    st.builds(SerialNumber, st.text(hexadecimal, min_size=14, max_size=14)),
    st.builds(Configuration, st.binary(min_size=21, max_size=21)),
    st.builds(
        BiasTrim,
        st.tuples(*[st.integers(-(2**23), 2**23 - 1)] * 9),
        st.integers(0, 2**32 - 1),
        st.integers(0, 2**16 - 1),
    ),
    st.builds(ExtendedError, st.integers(0, 2**128 - 1)),
)
words = st.text(st.sampled_from("abcxyzUTILYMODEN0123456789.-"), max_size=8)
replies = st.builds(UtilityReply, words, st.integers(0, 8), st.lists(words, max_size=3).map(tuple))


@st.composite
def streams(draw: st.DrawFn) -> list[bytes]:
    """Draw whole datagrams and lines of all kinds, each as its bytes."""
    pieces: list[bytes] = []
    for event in draw(st.lists(st.one_of(blocks, specials, replies), min_size=1, max_size=6)):
        terminated = draw(st.booleans())
        match event:
            case DataBlock():
                pieces += encode_data(event, terminated=terminated)
            case UtilityReply():
                pieces.append(encode_utility(event))
            case _:
                pieces.append(encode_special(event, terminated=terminated))
    return pieces


def test_a_recorded_start_up_datagram_is_decoded() -> None:
    block = only_block(START_UP)
    assert block.layout.clusters == ("gyro", "accelerometer", "inclinometer")
    assert block.status.tolist() == [[0xFF, 0xEF, 0xFF]]
    assert (block.counter[0], block.latency_us[0]) == (1, 506)
    assert not axes_valid(block.status[:, 0]).any()


def test_a_recorded_datagram_is_decoded_and_scaled() -> None:
    block = only_block(RUNNING)
    setup = configure(accelerometer_range_g=30)
    rate_deg_s = np.degrees(block.values[0, 0] * setup.rate_lsb_rad_s())
    force_g = block.values[0, 1] * setup.force_lsb_g()
    inclination_g = block.values[0, 2] * setup.inclination_lsb_g()
    assert rate_deg_s == pytest.approx([-0.0647583, 0.0075684, -0.0505371], abs=5e-8)
    assert force_g == pytest.approx([0.0056686, 0.0019150, 1.0139923], abs=5e-8)
    assert inclination_g == pytest.approx([0.0051033, -0.0047171, 1.0027831], abs=5e-8)
    assert (block.counter[0], block.latency_us[0]) == (65, 507)
    assert axes_valid(block.status[:, 0]).all()


@pytest.mark.parametrize(
    ("name", "datagrams", "step"),
    [("imu_uart_data_2.bin", 8392, 1), ("imu_uart_data_3.bin", 524, 16)],
)
def test_every_recorded_datagram_is_good_and_encoded_to_the_same_bytes(
    name: str, datagrams: int, step: int, record_property: Record
) -> None:
    data = (VECTORS / name).read_bytes()
    decoder = Stim300Decoder()
    events = drain([data[i : i + 1000] for i in range(0, len(data), 1000)], decoder)
    blocks = [event for event in events if isinstance(event, DataBlock)]
    recorded = concatenate(blocks)
    assert concatenate([recorded]) is recorded
    record_property("measured", f"{len(recorded)} datagrams of {name}")
    assert len(recorded) == datagrams
    assert (decoder.crc_errors, decoder.discarded_bytes) == (0, 0)
    assert set(np.diff(recorded.counter) % 256) == {step}
    assert b"".join(encode_data(recorded, terminated=True)) == data[: 40 * datagrams]


def test_what_nobody_drains_is_bounded() -> None:
    data = (VECTORS / "imu_uart_data_3.bin").read_bytes()
    decoder = Stim300Decoder()
    for _ in range((5 << 20) // len(data)):
        decoder.receive_data(data)
    blocks = [block for block in iter(decoder.next_event, None) if isinstance(block, DataBlock)]
    kept = sum(map(len, blocks)) * 40
    assert (4 << 20) - 80 < kept <= 4 << 20
    assert decoder.discarded_bytes + kept == (5 << 20) // len(data) * len(data)


def test_the_recorded_start_up_ends_after_562_samples() -> None:
    block = only_block((VECTORS / "imu_uart_data_2.bin").read_bytes())
    valid = axes_valid(block.status[:, 0])
    assert not valid[:562].any()
    assert valid[562:].all()


def test_a_status_spoils_the_axes_that_it_names_or_the_whole_cluster() -> None:
    status = np.array([0x00, 0x12, 0x0C, 0x20, 0x40, 0x80])
    expected = [[1, 1, 1], [1, 0, 1], [1, 1, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert axes_valid(status).tolist() == np.array(expected, bool).tolist()


@pytest.mark.parametrize(
    ("identifier", "size"),
    list(
        zip(
            bytes.fromhex("90 91 92 93 94 A5 A6 A7 F0 F7 98 AF"),
            [18, 28, 28, 38, 25, 42, 42, 59, 22, 63, 22, 63],
            strict=True,
        )
    ),
)
def test_datagrams_have_the_data_sheet_length(identifier: int, size: int) -> None:
    assert LAYOUTS[identifier].size == size
    assert len(encode_data(random_block(identifier, 1, 0), terminated=False)[0]) == size


@given(blocks, st.booleans())
def test_every_kind_of_data_datagram_survives_the_round_trip(
    block: DataBlock, terminated: bool
) -> None:
    raw = encode_data(block, terminated=terminated)
    decoded = only_block(b"".join(raw))
    assert decoded.layout == block.layout
    for name in ("values", "status", "temperatures", "temperature_status", "auxiliary"):
        assert np.array_equal(getattr(decoded, name), getattr(block, name)), name
    assert np.array_equal(decoded.counter, block.counter)
    assert np.array_equal(decoded.latency_us, block.latency_us)
    assert encode_data(decoded, terminated=terminated) == raw


@given(specials, st.booleans())
def test_every_single_datagram_survives_the_round_trip(event: Special, terminated: bool) -> None:
    raw = encode_special(event, terminated=terminated)
    assert raw.endswith(b"\r\n") or not terminated
    assert drain([raw]) == [event]


@given(streams(), st.data())
def test_chunking_is_invisible(pieces: list[bytes], data: st.DataObject) -> None:
    stream = b"".join(pieces)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    chunks = [stream[i:j] for i, j in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    whole = singly(drain([stream]))
    assert len(whole) == len(pieces)
    assert singly(drain(chunks)) == whole
    assert singly(drain(stream[i : i + 1] for i in range(len(stream)))) == whole


@given(
    st.lists(st.one_of(st.binary(max_size=80), st.sampled_from([bytes([b]) for b in GARBAGE_IDS])))
)
def test_garbage_is_only_counted_and_never_piles_up(chunks: list[bytes]) -> None:
    decoder = Stim300Decoder()
    decoder.receive_data(RUNNING)
    drain(chunks, decoder)
    assert len(decoder._buffer) < 128
    assert decoder.discarded_bytes <= sum(map(len, chunks))


@given(st.lists(blocks, min_size=2, max_size=5), st.booleans(), st.data())
def test_a_corrupted_byte_loses_only_the_datagram_it_touches(
    sent: list[DataBlock], terminated: bool, data: st.DataObject
) -> None:
    pieces = [raw for block in sent for raw in encode_data(block, terminated=terminated)]
    hit = data.draw(st.integers(0, len(pieces) - 1))
    damaged = bytearray(pieces[hit])
    damaged[data.draw(st.integers(0, len(damaged) - 1))] ^= data.draw(st.integers(1, 255))
    stream = b"".join([*pieces[:hit], damaged, *pieces[hit + 1 :]])
    flush = RUNNING * 4  # completes whatever a false ID takes for a longer datagram
    survivors = singly(drain([stream, flush]))[: -len(flush) // len(RUNNING)]
    intact = singly(drain(pieces))
    assert survivors in (intact, intact[:hit] + intact[hit + 1 :])


def test_falling_out_of_step_counts_once_however_long_the_search() -> None:
    decoder = Stim300Decoder()
    hole = b"\x93\x90\xa7" * 30
    drain([b"\x93\x90", RUNNING, hole, RUNNING, RUNNING[:-1], b"\x00", RUNNING], decoder)
    assert decoder.crc_errors == 2
    assert decoder.discarded_bytes == 2 + len(hole) + 2


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        (b"#UTILITYMODE,234\r", UtilityReply("UTILITYMODE")),
        (b"#isn,0,N2558184602002,32\r", UtilityReply("isn", 0, ("N2558184602002",))),
        (b"#,1,180\r", UtilityReply("", UtilityStatus.INVALID_COMMAND)),
        (b"#,2,139\r", UtilityReply("", UtilityStatus.WRONG_CRC)),
        (b"#,3,158\r", UtilityReply("", UtilityStatus.UNKNOWN_COMMAND)),
    ],
)
def test_the_data_sheets_utility_replies(line: bytes, reply: UtilityReply) -> None:
    assert drain([RUNNING, line])[1:] == [reply]
    assert encode_utility(reply) == line


def test_the_data_sheets_utility_command() -> None:
    assert encode_utility(UtilityCommand("isn")) == b"$isn,28\r"
    assert decode_command(b"$isn,28") == UtilityCommand("isn")


@given(st.builds(UtilityCommand, words, st.lists(words, max_size=3).map(tuple)))
def test_utility_commands_survive_the_round_trip(command: UtilityCommand) -> None:
    assert decode_command(encode_utility(command).removesuffix(b"\r")) == command


@pytest.mark.parametrize(
    ("line", "status"),
    [
        (b"isn,28", UtilityStatus.INVALID_COMMAND),
        (b"$is\xff,28", UtilityStatus.INVALID_COMMAND),
        (b"$isn,29", UtilityStatus.WRONG_CRC),
        (b"$isn", UtilityStatus.WRONG_CRC),
    ],
)
def test_a_line_that_is_no_utility_command_has_its_status(
    line: bytes, status: UtilityStatus
) -> None:
    assert decode_command(line) is status


@pytest.mark.parametrize("line", [b"#isn,0,N1,33\r", b"#isn,ok,23\r", b"#" + b"9" * 128, b"#\x00"])
def test_what_only_begins_like_a_utility_reply_is_discarded(line: bytes) -> None:
    decoder = Stim300Decoder()
    assert len(singly(drain([line, RUNNING], decoder))) == 1
    assert decoder.discarded_bytes == len(line)


@pytest.mark.parametrize(("range_g", "bits"), [(5, 20), (10, 19), (30, 18), (80, 16)])
def test_a_count_of_force_follows_the_range(range_g: int, bits: int) -> None:
    setup = configure(accelerometer_range_g=range_g)
    assert setup.accelerometer_ranges_g == (range_g,) * 3
    assert setup.force_lsb_g() == pytest.approx(2.0**-bits)
    assert setup.firmware == "E31"


def test_increments_are_spread_over_their_sample() -> None:
    setup = configure(rate_hz=250, incremental=True)
    assert np.degrees(setup.rate_lsb_rad_s()) == pytest.approx(2.0**-21 * 250)
    assert setup.force_lsb_g() == pytest.approx(2.0**-22 * 250 / STANDARD_GRAVITY_M_S2)
    assert setup.inclination_lsb_g() == pytest.approx(2.0**-25 * 250 / STANDARD_GRAVITY_M_S2)


@pytest.mark.parametrize("identifier", sorted(LAYOUTS))
def test_a_configuration_names_its_datagram(identifier: int) -> None:
    setup = configure(identifier=identifier, rate_hz=2000, terminated=False)
    assert setup.layout is LAYOUTS[identifier]
    assert (setup.rate_hz, setup.terminated) == (2000, False)
    assert setup.with_rate_code(5).rate_hz is None
    assert setup.with_rate_code(0).layout is LAYOUTS[identifier]


@pytest.mark.parametrize(
    ("position", "value", "message"),
    [
        (4, 0x73, "gyro output unit 3"),
        (7, 0x74, "accelerometer output unit 4"),
        (10, 0x73, "inclinometer output unit 3"),
        (16, 0x01, "range codes"),
    ],
)
def test_what_is_neither_rate_nor_increment_is_refused(
    position: int, value: int, message: str
) -> None:
    payload = bytearray(configure().payload)
    payload[position] = value
    setup = Configuration(bytes(payload))
    with pytest.raises(ValueError, match=message):
        (setup.rate_lsb_rad_s(), setup.force_lsb_g(), setup.inclination_lsb_g())


def test_a_service_answer_tells_its_error() -> None:
    assert service.error_of(service.encode_answer(b"m 9", "E003 nonsense")) == "E003 nonsense"
    assert service.error_of(service.encode_answer(b"m 2", "EVERYTHING 100 FINE")) is None
    assert service.encode_set_rate(2) == b"m 2\r"


def test_aux_and_pps_are_told_apart_by_the_input_that_the_configuration_names() -> None:
    assert configure(identifier=AUX_IDS[3]).layout.identifier == 0x9B
    assert configure(identifier=0xF3).layout.identifier == 0xF3
