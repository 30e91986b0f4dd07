"""CANopen's small services: bytes as CiA 301 lays them out, and the `canopen` library's own."""

import random

import canopen
import pytest
from canopen.emcy import EmcyError
from canopen.nmt import NMT_COMMANDS, NMT_STATES
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.codecs.canopen import (
    NODES,
    Emergency,
    NmtCommand,
    NmtState,
    decode_emergency,
    decode_heartbeat,
    decode_nmt,
    describe_error,
    encode_emergency,
    encode_heartbeat,
    encode_nmt,
    is_sync,
)
from drivers.interfaces import CanFrame
from tests.evidence import Record

nodes = st.integers(NODES.start, NODES.stop - 1)
services = st.sampled_from([0x000, 0x080, 0x700])
frames = st.builds(
    CanFrame,
    st.integers(0, (1 << 29) - 1) | st.builds(int.__add__, services, st.integers(0, 127)),
    st.binary(max_size=64) | st.binary(min_size=1, max_size=2) | st.binary(min_size=8, max_size=8),
    st.booleans(),
    st.booleans(),
)


def no_objects() -> canopen.ObjectDictionary:
    return canopen.ObjectDictionary()  # type: ignore[no-untyped-call]


class Wire(canopen.Network):
    """Theirs, without a bus: what it sends is ours to read, what we send it is told."""

    def __init__(self) -> None:
        super().__init__()
        self.sent: list[CanFrame] = []

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self.sent.append(CanFrame(can_id, bytes(data), remote=remote))

    def hear(self, frame: CanFrame) -> None:
        self.notify(frame.can_id, bytearray(frame.data), 0.0)


@pytest.mark.parametrize(
    ("frame", "command", "node"),
    [  # CiA 301, 7.2.8.3.1: identifier 0; command, node
        (CanFrame(0, b"\x01\x05"), NmtCommand.START, 5),
        (CanFrame(0, b"\x02\x05"), NmtCommand.STOP, 5),
        (CanFrame(0, b"\x80\x00"), NmtCommand.ENTER_PRE_OPERATIONAL, 0),
        (CanFrame(0, b"\x81\x7f"), NmtCommand.RESET_NODE, 127),
        (CanFrame(0, b"\x82\x01"), NmtCommand.RESET_COMMUNICATION, 1),
    ],
)
def test_commands_are_two_bytes_on_the_first_identifier(
    frame: CanFrame, command: NmtCommand, node: int
) -> None:
    assert encode_nmt(command, node) == frame
    assert decode_nmt(frame) == (command, node)


@pytest.mark.parametrize(
    "frame",
    [
        CanFrame(0, b"\x03\x05"),
        CanFrame(0, b"\x01"),
        CanFrame(1, b"\x01\x05"),
        CanFrame(0, b"\x01\x05", extended=True),
        CanFrame(0, b"\x01\x05", remote=True),
    ],
)
def test_what_is_no_command_is_none(frame: CanFrame) -> None:
    assert decode_nmt(frame) is None


def test_a_node_of_the_library_takes_our_commands_and_we_take_its_masters() -> None:
    wire = Wire()
    local = wire.add_node(canopen.LocalNode(5, no_objects()))
    wire.hear(encode_nmt(NmtCommand.START, 5))
    assert local.nmt.state == "OPERATIONAL"
    wire.hear(encode_nmt(NmtCommand.STOP, 0))
    assert local.nmt.state == "STOPPED"
    known = {int(command) for command in NmtCommand}
    for name, code in NMT_COMMANDS.items():  # sleep and stand-by are not of CiA 301
        wire.nmt.send_command(code)
        expected = (NmtCommand(code), 0) if code in known else None
        assert decode_nmt(wire.sent[-1]) == expected, name


@pytest.mark.parametrize(
    ("frame", "state"),
    [  # CiA 301, 7.2.8.3.2.2: identifier 700h + node; the state
        (CanFrame(0x705, b"\x00"), NmtState.BOOT_UP),
        (CanFrame(0x705, b"\x04"), NmtState.STOPPED),
        (CanFrame(0x705, b"\x05"), NmtState.OPERATIONAL),
        (CanFrame(0x705, b"\x7f"), NmtState.PRE_OPERATIONAL),
    ],
)
def test_a_heartbeat_is_the_state_at_700h_and_the_node(frame: CanFrame, state: NmtState) -> None:
    assert encode_heartbeat(5, state) == frame
    assert decode_heartbeat(frame) == (5, state)


@pytest.mark.parametrize(
    "frame",
    [
        CanFrame(0x700, b"\x05"),
        CanFrame(0x780, b"\x05"),
        CanFrame(0x685, b"\x05"),
        CanFrame(0x705, b""),
        CanFrame(0x705, b"\x05\x00"),
        CanFrame(0x705, b"\x06"),
        CanFrame(0x705, b"\x05", extended=True),
        CanFrame(0x705, b"\x05", remote=True),
    ],
)
def test_what_is_no_heartbeat_is_none(frame: CanFrame) -> None:
    assert decode_heartbeat(frame) is None


def test_a_guarded_node_toggles_the_highest_bit_of_its_state() -> None:
    assert decode_heartbeat(CanFrame(0x705, b"\x85")) == (5, NmtState.OPERATIONAL)


@pytest.mark.parametrize("state", [state for state in NmtState if state != NmtState.BOOT_UP])
def test_the_library_reads_the_same_state_from_our_heartbeat(state: NmtState) -> None:
    wire = Wire()
    remote = wire.add_node(canopen.RemoteNode(5, no_objects()))
    wire.hear(encode_heartbeat(5, state))
    assert remote.nmt.state == NMT_STATES[state]


def test_an_emergency_is_code_register_and_five_bytes_of_the_makers() -> None:
    """CiA 301, 7.2.7.3: 8130h (heartbeat lost), communication bit of 1001h."""
    frame = CanFrame(0x085, bytes.fromhex("30 81 11 01 02 03 04 05"))
    emergency = Emergency(0x8130, 0x11, b"\x01\x02\x03\x04\x05")
    assert encode_emergency(5, emergency) == frame
    assert decode_emergency(frame, 5) == emergency
    assert decode_emergency(frame, 6) is None
    assert decode_emergency(frame._replace(data=frame.data[:7]), 5) is None
    assert decode_emergency(frame._replace(extended=True), 5) is None
    assert encode_emergency(5, Emergency(0, 0)).data == bytes(8)


@given(st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.binary(min_size=5, max_size=5))
@settings(max_examples=50)
def test_emergencies_pass_between_us_and_the_library(
    code: int, register: int, detail: bytes
) -> None:
    emergency, node = Emergency(code, register, detail), 127
    producer = canopen.emcy.EmcyProducer(0x80 + node)
    producer.network = wire = Wire()
    producer.send(code, register, detail)
    assert decode_emergency(wire.sent[-1], node) == emergency
    consumer = canopen.emcy.EmcyConsumer()  # type: ignore[no-untyped-call]
    wire.subscribe(0x80 + node, consumer.on_emcy)
    wire.hear(encode_emergency(node, emergency))
    heard = consumer.log[-1]
    assert (heard.code, heard.register, heard.data) == emergency


@pytest.mark.parametrize(
    ("code", "words"),
    [  # CiA 301, table 26; CiA 402-2, table 6; else the next coarser of their kinds
        (0x8611, "8611h (following error)"),
        (0x7121, "7121h (motor blocked)"),
        (0x3212, "3212h (DC link over-voltage)"),
        (0x4377, "4377h (drive temperature)"),
        (0x5FFF, "5FFFh (device hardware)"),
        (0xFF01, "FF01h (an error of the maker's own)"),
        (0xA000, "A000h (an unknown error)"),
        (0x0000, "0000h (no error)"),
    ],
)
def test_an_error_is_told_in_words(code: int, words: str) -> None:
    assert describe_error(code) == words


def test_whatever_the_library_can_name_we_can() -> None:
    for code, _, _ in EmcyError.DESCRIPTIONS:
        assert "unknown" not in describe_error(code)


@pytest.mark.parametrize(
    ("frame", "says"),
    [
        (CanFrame(0x080), True),
        (CanFrame(0x080, b"\x07"), True),  # its counter
        (CanFrame(0x080, bytes(8)), False),
        (CanFrame(0x081), False),
        (CanFrame(0x080, remote=True), False),
    ],
)
def test_sync_is_known_with_and_without_its_counter(frame: CanFrame, says: bool) -> None:
    assert is_sync(frame) is says


def test_the_librarys_sync_is_one() -> None:
    wire = Wire()
    wire.sync.transmit()
    assert is_sync(wire.sent[-1])


@given(nodes, st.sampled_from(NmtCommand), st.sampled_from(NmtState))
@settings(max_examples=50)
def test_commands_and_heartbeats_of_every_node_survive(
    node: int, command: NmtCommand, state: NmtState
) -> None:
    assert decode_nmt(encode_nmt(command, node)) == (command, node)
    assert decode_heartbeat(encode_heartbeat(node, state)) == (node, state)


def look(frame: CanFrame, node: int) -> None:
    """A frame is what it says only in its own shape."""
    plain = not (frame.extended or frame.remote)
    command, beat = decode_nmt(frame), decode_heartbeat(frame)
    emergency = decode_emergency(frame, node)
    assert command is None or (plain and encode_nmt(*command) == frame)
    assert beat is None or (plain and encode_heartbeat(*beat).can_id == frame.can_id)
    assert emergency is None or (plain and encode_emergency(node, emergency) == frame)
    assert not is_sync(frame) or (plain and frame.can_id == 0x80)


@given(frames, nodes)
@settings(max_examples=300)
def test_any_frame_is_decoded_or_none(frame: CanFrame, node: int) -> None:
    look(frame, node)


@pytest.mark.parametrize(
    "count", [30_000, pytest.param(3_000_000, marks=[pytest.mark.proof, pytest.mark.timeout(600)])]
)
def test_many_frames_are_decoded_or_none(count: int, record_property: Record) -> None:
    record_property("measured", f"{count:,} frames")
    noise = random.Random(301)
    for _ in range(count):
        service = noise.choice([0x000, 0x080, 0x700, noise.getrandbits(29)])
        data = noise.randbytes(noise.choice([0, 1, 2, 8, noise.randrange(65)]))
        flags = noise.random() < 0.1, noise.random() < 0.1
        look(CanFrame(service + noise.randrange(128), data, *flags), noise.choice(NODES))
