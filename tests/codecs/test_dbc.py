"""Signals of DBC files, held against cantools, nmea2000 and the standards' own numbers."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import can
import cantools
import numpy as np
import pytest
from cantools.database.can import Message, Signal
from cantools.database.conversion import BaseConversion
from hypothesis import given
from hypothesis import strategies as st
from nmea2000.decoder import NMEA2000Decoder

import drivers
from drivers.codecs.dbc import DbcDecoder, SignalChoice
from drivers.codecs.dbc_field import Field
from drivers.interfaces import CanFilter, CanFrame, CanSettings

SHIPPED = Path(drivers.__file__).parent / "dbc_files"
FOG = (SHIPPED / "northfinder-fog.dbc").read_text()
NMEA = (SHIPPED / "nmea2000-rate-of-turn.dbc").read_text()
BENCH = (Path(__file__).parents[1] / "vectors" / "dbc" / "bench.dbc").read_text()
G_M_S2 = 9.80665
DEG = math.pi / 180


def fog(**others: str) -> DbcDecoder:
    return DbcDecoder(FOG, SignalChoice("FOG_RATE", "rate", **others))


def bench(message: str, signal: str, **others: str) -> DbcDecoder:
    return DbcDecoder(BENCH, SignalChoice(message, signal, **others))


def foreign(text: str, message: str, **values: float) -> CanFrame:
    """A frame as cantools packs it; what is not said is 0."""
    database: Any = cantools.database.load_string(text, "dbc", strict=False)
    found = database.get_message_by_name(message)
    for signal in found.signals:
        selected = values.get(signal.multiplexer_signal) in (signal.multiplexer_ids or [None])
        if selected:
            values.setdefault(signal.name, 0)
    data = found.encode(values, padding=False, strict=False)
    return CanFrame(found.frame_id, bytes(data), found.is_extended_frame)


@st.composite
def signals(draw: st.DrawFn) -> Signal:
    """Any integer signal of an eight-byte frame."""
    big_endian, bits = draw(st.booleans()), draw(st.integers(1, 64))
    first = draw(st.integers(0, 64 - bits))
    start = first // 8 * 8 + 7 - first % 8 if big_endian else first
    scale, offset = draw(st.sampled_from([(1, 0), (0.25, 0), (1e-3, -7.5)]))
    return Signal(
        "any",
        start,
        bits,
        "big_endian" if big_endian else "little_endian",
        is_signed=draw(st.booleans()) and bits > 1,
        conversion=BaseConversion.factory(scale=scale, offset=offset),
    )


@given(signals(), st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=5))
def test_any_signal_is_read_as_cantools_reads_it(signal: Signal, frames: list[bytes]) -> None:
    message = Message(1, "any", 8, [signal])
    data = np.frombuffer(b"".join(frames), np.uint8).reshape(-1, 8)
    expected = [float(message.decode(frame)["any"]) for frame in frames]  # type: ignore[call-overload, arg-type]
    assert Field.of(signal).values(data) == pytest.approx(expected, rel=1e-15, abs=1e-15)


@given(signals(), st.binary(min_size=8, max_size=8))
def test_what_is_put_is_read_again_and_nothing_else_is_touched(
    signal: Signal, frame: bytes
) -> None:
    field = Field.of(signal)
    raw = field.raw(np.frombuffer(frame, np.uint8).reshape(1, 8))
    data = np.zeros((1, 8), np.uint8)
    field.put(data, raw)
    assert field.raw(data) == raw
    assert sum(int(byte).bit_count() for byte in data[0]) == int(raw[0]).bit_count()


def test_the_shipped_fog_is_finer_than_a_degree_an_hour_and_wide_enough_to_turn() -> None:
    decoder = fog()
    assert decoder.resolution / DEG * 3600 == pytest.approx(0.09)
    assert (decoder.name, decoder.period_s) == ("FOG_RATE (120h)", 0.001)
    frames = decoder.encode(np.array([200 * DEG, -200 * DEG]), np.array([0, 1]))
    assert decoder.decode(frames).value == pytest.approx([200 * DEG, -200 * DEG], rel=1e-6)


def test_cantools_reads_what_is_written_and_the_other_way_round() -> None:
    decoder = fog(counter="counter", status="status", checksum="crc")
    (frame,) = decoder.encode(np.array([-1.5 * DEG]), np.array([0x1FE]))
    database: Any = cantools.database.load_string(FOG, "dbc")
    read = database.decode_message(frame.can_id, frame.data)
    assert (read["rate"], read["counter"], read["status"]) == (-1.5, 0xFE, "valid")
    readings = fog(counter="counter").decode([foreign(FOG, "FOG_RATE", rate=12.5, counter=7)])
    assert readings.value == pytest.approx([12.5 * DEG])
    assert readings.counter == [7]


def test_the_checksum_is_sae_j1850s_and_a_wrong_one_is_counted() -> None:
    """The CRC catalogue's check value: 0x4B over the digits 1 to 9; here over seven bytes."""
    decoder = fog(checksum="crc")
    (frame,) = decoder.encode(np.array([0.0]), np.array([0]))
    assert frame.data[7] == _crc8_j1850(frame.data[:7])
    broken = frame._replace(data=b"\x01" + frame.data[1:])
    assert decoder.decode([broken, frame]).index == [1]
    assert decoder.malformed == 1


def _crc8_j1850(data: bytes) -> int:
    """Bit by bit, as SAE J1850 section 5.3 defines it: 1Dh, begun with and inverted by FFh."""
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ (0x1D if crc & 0x80 else 0)) & 0xFF
    return crc ^ 0xFF


def test_the_checksum_may_stand_first_and_be_autosars() -> None:
    decoder = bench("AUTOSAR", "yaw", checksum="crc", checksum_kind="autosar")
    (frame,) = decoder.encode(np.array([1.0 * DEG]), np.array([0]))
    assert len(frame.data) == 3
    assert decoder.decode([frame]).value == pytest.approx([1.0 * DEG], rel=1e-3)
    assert decoder.decode([frame._replace(data=b"\0" + frame.data[1:])]).index.size == 0


def test_a_status_and_a_limit_make_a_value_invalid() -> None:
    decoder = fog(status="status")
    frames = [
        foreign(FOG, "FOG_RATE", rate=1.0),
        foreign(FOG, "FOG_RATE", rate=1.0, status=4),
        CanFrame(0x120, b"\x00\x00\x80" + bytes(5)),  # -209.7152, below the limit
    ]
    assert decoder.decode(frames).valid.tolist() == [True, False, False]


def test_the_nmea_2000_rate_of_turn_is_that_of_the_network() -> None:
    """Golden frame: 7.290625e-5 rad/s from address 23h; LSB 0.0064 deg/h."""
    frame = CanFrame(0x09F11323, bytes.fromhex("111D090000FFFFFF"), extended=True)
    decoder = DbcDecoder(NMEA, SignalChoice("RATE_OF_TURN", "rate"))
    assert decoder.decode([frame]).value == pytest.approx([7.290625e-5], rel=1e-12)
    assert decoder.resolution / DEG * 3600 == pytest.approx(0.0064, abs=1e-4)
    unknown = frame._replace(data=bytes.fromhex("11FFFFFF7FFFFFFF"))
    assert not decoder.decode([unknown]).valid


def test_a_strangers_nmea_2000_decoder_reads_the_same_rate() -> None:
    decoder = DbcDecoder(NMEA, SignalChoice("RATE_OF_TURN", "rate"))
    for rate in (7.290625e-5, -0.5, 12.0):
        (frame,) = decoder.encode(np.array([rate]), np.array([0]), sender=0x23)
        sent = can.Message(arbitration_id=frame.can_id, is_extended_id=True, data=frame.data)
        message = NMEA2000Decoder().decode(sent)
        assert message is not None
        assert (message.PGN, message.source) == (127251, 0x23)
        assert message.get_field_by_id("rate").value == pytest.approx(rate, abs=2e-8)


def test_of_j1939_only_the_sender_that_is_wanted_passes() -> None:
    decoder = DbcDecoder(NMEA, SignalChoice("RATE_OF_TURN", "rate"))
    ours, other = (CanFrame(can_id, bytes(8), True) for can_id in (0x09F11323, 0x0DF11324))
    assert [decoder.filter().passes(frame) for frame in (ours, other)] == [True, True]
    assert [decoder.filter(0x23).passes(frame) for frame in (ours, other)] == [True, False]
    assert not decoder.filter().passes(CanFrame(0x09F11223, bytes(8), True))
    assert not decoder.filter().passes(CanFrame(0x123, bytes(8)))
    assert fog().filter() == CanFilter(0x120, 0x7FF)


@pytest.mark.parametrize(
    ("signal", "value", "expected"),
    [
        ("turn", -15.0, -15.0 * DEG / 3600),
        ("pull_x", 0.25, 0.25),
        ("pull_y", 9.806, 9.806 / G_M_S2),
    ],
)
def test_multiplexed_signals_are_read_where_they_are(
    signal: str, value: float, expected: float
) -> None:
    kinds = {"turn": 0, "pull_x": 1, "pull_y": 2}
    names = ["turn", "pull_x", "pull_y"]
    values = {"turn": 1.0, "pull_x": 0.5, "pull_y": 1.0, signal: value}
    frames = [
        foreign(BENCH, "IMU", kind=kinds[name], number=kinds[name], **{name: values[name]})
        for name in names
    ]
    decoder = bench("IMU", signal, counter="number")
    readings = decoder.decode(frames)
    assert readings.index == [names.index(signal)]
    assert readings.value == pytest.approx([expected], rel=1e-9)
    (again,) = decoder.encode(np.array([expected]), np.array([names.index(signal)]))
    assert again == frames[names.index(signal)]


@pytest.mark.parametrize(
    ("message", "signal", "value", "unit"),
    [
        ("WHOLE", "rate", -0.75, 1.0),
        ("FLOAT", "narrow", 0.125, DEG),
        ("FLOAT", "other", 500.0, 1e-3),
        ("DOUBLE", "wide", -7.25e-5, 1.0),
    ],
)
def test_wide_and_floating_signals_survive_both_ways(
    message: str, signal: str, value: float, unit: float
) -> None:
    decoder = bench(message, signal)
    frame = foreign(BENCH, message, **{signal: value})
    assert decoder.decode([frame]).value == pytest.approx([value * unit], rel=1e-6)
    (ours,) = decoder.encode(np.array([value * unit]), np.array([0]))
    assert decoder.decode([ours]).value == pytest.approx([value * unit], rel=1e-6)


def test_a_value_beyond_the_signal_saturates() -> None:
    frames = fog().encode(np.array([9.0, -9.0]), np.array([0, 1]))
    assert fog().decode(frames).value / DEG == pytest.approx([209.715175, -209.7152])


def test_short_and_remote_frames_are_counted_and_longer_ones_read() -> None:
    """CAN FD pads; a frame that a node asks for carries nothing."""
    decoder = fog()
    whole = foreign(FOG, "FOG_RATE", rate=1.0)
    odd = [whole._replace(data=whole.data[:7]), whole._replace(remote=True)]
    padded = whole._replace(data=whole.data.ljust(64, b"\0"))
    assert decoder.decode([*odd, padded]).index == [2]
    assert decoder.malformed == 2
    assert len(decoder.decode([]).value) == 0


@pytest.mark.parametrize(
    ("text", "choice", "sentence"),
    [
        ("nonsense", SignalChoice("A", "b"), "this is no DBC file"),
        (FOG, SignalChoice("FOG", "rate"), "no message 'FOG'; it has FOG_RATE"),
        (FOG, SignalChoice("FOG_RATE", "gain"), "no signal 'gain'; it has counter, crc, rate"),
        (BENCH, SignalChoice("COARSE", "heat"), "the signal heat is in 'degC', which is none of"),
        (
            BENCH,
            SignalChoice("AUTOSAR", "yaw", checksum="half"),
            "the checksum half is not one whole byte",
        ),
    ],
)
def test_a_file_that_does_not_fit_is_refused_in_words(
    text: str, choice: SignalChoice, sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        DbcDecoder(text, choice)


def test_a_configuration_names_file_and_signals() -> None:
    names = {"message": "FOG_RATE", "signal": "rate", "counter": "counter"}
    decoder = DbcDecoder.configured(CanSettings(dbc=(FOG, names)))
    assert (decoder.counter_modulus, decoder.quantity, decoder.is_j1939) == (256, "rate", False)
    assert fog().counter_modulus is None
    with pytest.raises(ValueError, match="a file, a message and a signal must be given"):
        DbcDecoder.configured(CanSettings())


@given(
    st.lists(
        st.builds(
            CanFrame,
            st.integers(0, 0x1FFFFFFF),
            st.binary(max_size=64),
            st.booleans(),
            st.booleans(),
        ),
        max_size=50,
    )
)
def test_random_frames_are_only_counted(frames: Sequence[CanFrame]) -> None:
    decoder = fog(counter="counter", status="status", checksum="crc")
    readings = decoder.decode(frames)
    assert len(readings.value) + decoder.malformed == len(frames)
    good = foreign(FOG, "FOG_RATE", rate=3.0)
    sealed = decoder.encode(np.array([3.0 * DEG]), np.array([0]))
    assert decoder.decode(sealed).value == pytest.approx([3.0 * DEG])
    assert len(good.data) == 8


def test_multiplexers_that_select_each_other_are_refused() -> None:
    text = """VERSION ""
BU_: X
BO_ 288 FOG_RATE: 8 X
 SG_ a m0M : 32|8@1+ (1,0) [0|255] "" X
 SG_ b m0M : 40|8@1+ (1,0) [0|255] "" X
 SG_ rate m0 : 0|24@1- (2.5E-005,0) [-209.7|209.7] "deg/s" X

SG_MUL_VAL_ 288 rate a 0-0;
SG_MUL_VAL_ 288 a b 0-0;
SG_MUL_VAL_ 288 b a 0-0;
"""
    with pytest.raises(ValueError, match="select each other in a circle"):
        DbcDecoder(text, SignalChoice("FOG_RATE", "rate"))
