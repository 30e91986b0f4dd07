"""SDO transfers: frames as CiA 301 lays them out, and the `canopen` library at the other end."""

import random
from collections.abc import Callable

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes
from hypothesis import given
from hypothesis import strategies as st

from drivers.codecs.sdo import Abort, Aborted, Entry, describe_abort, encode_abort
from drivers.codecs.sdo_client import Transfer
from drivers.codecs.sdo_server import AccessError, SdoServer
from tests.evidence import Record

NODE = 5
DEVICE_TYPE, NAME, HEARTBEAT_TIME = Entry(0x1000), Entry(0x1008), Entry(0x1017)
DRIVE_402 = bytes.fromhex("92 01 02 00")  # CiA 402: servo drive
STEPS = 20_000  # of a dialogue: the longest object is some 10 000 segments

entries = st.builds(Entry, st.integers(0, 0xFFFF), st.integers(0, 0xFF))
values = st.binary(max_size=200)
garbage = st.binary(max_size=64) | st.binary(min_size=8, max_size=8)


class Dictionary:
    """Objects that may be read and written, unless they are said to be closed."""

    def __init__(self, objects: dict[Entry, bytes]) -> None:
        self.objects = dict(objects)
        self.closed: dict[Entry, Abort] = {}

    def read(self, entry: Entry) -> bytes:
        if entry in self.closed:
            raise AccessError(self.closed[entry])
        if entry not in self.objects:
            raise AccessError(Abort.NO_OBJECT)
        return self.objects[entry]

    def write(self, entry: Entry, value: bytes) -> None:
        self.read(entry)
        self.objects[entry] = value


def carry_out(transfer: Transfer, answer: Callable[[bytes], bytes | None]) -> bytes | Aborted:
    """Let client and server talk until the transfer is over."""
    request: bytes | None = transfer.begin()
    for _ in range(STEPS):
        if request is None or transfer.result is not None:
            break
        reply = answer(request)
        assert reply is not None
        assert len(request) == len(reply) == 8
        assert transfer.belongs(reply)
        request = transfer.answer(reply)
    assert transfer.result is not None
    return transfer.result


class Wire(canopen.Network):
    """Theirs, without a bus: what its ends send is answered by ours, or kept for ours."""

    def __init__(self, server: SdoServer | None = None) -> None:
        super().__init__()
        self.server = server
        self.answers: list[bytes] = []

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:  # noqa: ARG002 -- theirs
        if self.server is None:
            self.answers.append(bytes(data))
            return
        answer = self.server.answer(bytes(data))
        if answer is not None:
            self.notify(can_id - 0x80, bytearray(answer), 0.0)

    def ask(self, request: bytes) -> bytes:
        """Hand our client's request to their server."""
        self.notify(0x600 + NODE, bytearray(request), 0.0)
        return self.answers.pop()


def their_server(objects: dict[Entry, bytes], access: str = "rw") -> tuple[Wire, canopen.LocalNode]:
    dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
    wire = Wire()
    for entry in objects:
        variable = ODVariable(str(entry), entry.index, entry.sub_index)
        variable.data_type, variable.access_type = datatypes.DOMAIN, access
        dictionary.add_object(variable)
    local = canopen.LocalNode(NODE, dictionary)
    wire.add_node(local)
    for entry, value in objects.items():
        local.set_data(entry.index, entry.sub_index, value)
    return wire, local


def their_client(server: SdoServer) -> canopen.RemoteNode:
    dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
    remote = canopen.RemoteNode(NODE, dictionary)
    Wire(server).add_node(remote)
    return remote


def script(*dialogue: tuple[str, str]) -> Callable[[bytes], bytes]:
    """Play an end whose every frame is written down; any other request is a failure."""
    left = list(dialogue)

    def answer(request: bytes) -> bytes:
        expected, reply = left.pop(0)
        assert request == bytes.fromhex(expected)
        return bytes.fromhex(reply)

    return answer


READ_TYPE = ("40 00 10 00 00 00 00 00", "43 00 10 00 92 01 02 00")
READ_NAME = (  # "Tiny Node - Mega Domains !", the example that many manuals print
    ("40 08 10 00 00 00 00 00", "41 08 10 00 1A 00 00 00"),
    ("60 00 00 00 00 00 00 00", "00 54 69 6E 79 20 4E 6F"),
    ("70 00 00 00 00 00 00 00", "10 64 65 20 2D 20 4D 65"),
    ("60 00 00 00 00 00 00 00", "00 67 61 20 44 6F 6D 61"),
    ("70 00 00 00 00 00 00 00", "15 69 6E 73 20 21 00 00"),
)
WRITE_HEARTBEAT = ("2B 17 10 00 E8 03 00 00", "60 17 10 00 00 00 00 00")
WRITE_NAME = (
    ("21 08 10 00 09 00 00 00", "60 08 10 00 00 00 00 00"),
    ("00 6E 6F 72 74 68 66 69", "20 00 00 00 00 00 00 00"),
    ("1B 6E 64 00 00 00 00 00", "30 00 00 00 00 00 00 00"),
)


@pytest.mark.parametrize(
    ("transfer", "dialogue", "result"),
    [
        (Transfer(DEVICE_TYPE), [READ_TYPE], DRIVE_402),
        (Transfer(NAME), READ_NAME, b"Tiny Node - Mega Domains !"),
        (Transfer(HEARTBEAT_TIME, b"\xe8\x03"), [WRITE_HEARTBEAT], b""),
        (Transfer(NAME, b"northfind"), WRITE_NAME, b""),
    ],
)
def test_both_ends_speak_the_dialogues_of_the_standard(
    transfer: Transfer, dialogue: list[tuple[str, str]], result: bytes
) -> None:
    before = {DEVICE_TYPE: DRIVE_402, NAME: b"Tiny Node - Mega Domains !", HEARTBEAT_TIME: b"\0\0"}
    server = SdoServer(Dictionary(before))
    for request, reply in dialogue:
        assert server.answer(bytes.fromhex(request)) == bytes.fromhex(reply)
    assert carry_out(transfer, script(*dialogue)) == result


@pytest.mark.parametrize(
    ("head", "value"),
    [("4F", b"\x92"), ("4B", b"\x92\x01"), ("47", b"\x92\x01\x02"), ("43", DRIVE_402)],
)
def test_an_expedited_answer_says_how_many_of_its_bytes_count(head: str, value: bytes) -> None:
    """CiA 301, 7.2.4.3.5: n bytes are unused; the heads that every manual's table has."""
    reply = head + " 00 10 00 " + value.ljust(4, b"\0").hex()
    assert carry_out(Transfer(DEVICE_TYPE), script((READ_TYPE[0], reply))) == value
    server = SdoServer(Dictionary({DEVICE_TYPE: value}))
    assert server.answer(bytes.fromhex(READ_TYPE[0])) == bytes.fromhex(reply)


def test_an_expedited_value_without_a_size_is_four_bytes() -> None:
    answer = "42 00 10 00 92 01 02 00"
    assert carry_out(Transfer(DEVICE_TYPE), script((READ_TYPE[0], answer))) == DRIVE_402
    objects = Dictionary({HEARTBEAT_TIME: b""})
    assert SdoServer(objects).answer(bytes.fromhex("22 17 10 00 01 02 03 04")) is not None
    assert objects.objects[HEARTBEAT_TIME] == b"\x01\x02\x03\x04"


def test_an_abort_names_the_entry_and_ends_the_transfer() -> None:
    """06020000h, no such object, at 1234h:05h."""
    frame = bytes.fromhex("80 34 12 05 00 00 02 06")
    transfer = Transfer(Entry(0x1234, 5))
    assert SdoServer(Dictionary({})).answer(transfer.begin()) == frame
    assert transfer.belongs(frame)
    assert transfer.answer(frame) is None
    assert transfer.result == Aborted(Entry(0x1234, 5), Abort.NO_OBJECT)
    assert encode_abort(Entry(0x1234, 5), Abort.NO_OBJECT) == frame


def test_an_answer_to_another_question_does_not_belong() -> None:
    transfer = Transfer(DEVICE_TYPE)
    transfer.begin()
    assert transfer.belongs(bytes.fromhex(READ_TYPE[1]))
    assert not transfer.belongs(bytes.fromhex("43 18 10 01 00 00 00 00"))
    assert not transfer.belongs(bytes.fromhex("80 18 10 01 00 00 02 06"))
    assert not transfer.belongs(bytes.fromhex("00 54 69 6E 79 20 4E 6F"))  # no segment was asked
    assert not transfer.belongs(bytes.fromhex("43 00 10 00"))
    # Of a second node with the same number, or to another program:
    assert not transfer.belongs(bytes.fromhex("60 00 10 00 00 00 00 00"))
    assert not Transfer(DEVICE_TYPE, DRIVE_402).belongs(bytes.fromhex(READ_TYPE[1]))
    name = Transfer(NAME)
    name.begin()
    name.answer(bytes.fromhex(READ_NAME[0][1]))
    assert name.belongs(bytes.fromhex(READ_NAME[1][1]))
    assert not name.belongs(bytes.fromhex(READ_NAME[0][1]))


def test_only_the_first_question_of_a_reading_may_be_put_twice() -> None:
    """A segment asked for twice is a toggle error, a value written twice may be a command."""
    reading = Transfer(NAME)
    reading.begin()
    assert reading.repeatable
    reading.answer(bytes.fromhex(READ_NAME[0][1]))
    assert not reading.repeatable
    assert not Transfer(NAME, b"northfind").repeatable


@pytest.mark.parametrize(
    ("transfer", "dialogue", "code"),
    [
        (Transfer(NAME), [READ_NAME[0], ("60" + 14 * "0", "10" + 14 * "0")], Abort.TOGGLE),
        (Transfer(NAME), [READ_NAME[0], ("60" + 14 * "0", "20" + 14 * "0")], Abort.COMMAND),
        (Transfer(NAME, b"northfind"), [WRITE_NAME[0], (WRITE_NAME[1][0], "30" + 14 * "0")],
         Abort.TOGGLE),
    ],
)  # fmt: skip
def test_a_server_that_breaks_the_rules_is_told_so(
    transfer: Transfer, dialogue: list[tuple[str, str]], code: Abort
) -> None:
    answer, request = script(*dialogue), transfer.begin()
    for _ in dialogue:
        reply = transfer.answer(answer(request))
        assert reply is not None
        request = reply
    assert transfer.result == Aborted(NAME, code)
    assert request == encode_abort(NAME, code)


def test_a_server_that_never_ends_is_stopped() -> None:
    toggles = [0x10, 0x00]

    def endless(request: bytes) -> bytes:
        if request[0] == 0x40:
            return bytes.fromhex("41 08 10 00 FF FF FF FF")
        toggles.reverse()
        return bytes((toggles[0],)) + b"endless"

    assert carry_out(Transfer(NAME), endless) == Aborted(NAME, Abort.OUT_OF_MEMORY)


def test_a_client_that_never_ends_is_refused() -> None:
    server = SdoServer(Dictionary({NAME: b""}))
    answer = server.answer(bytes.fromhex(WRITE_NAME[0][0]))
    for step in range(STEPS):
        answer = server.answer(bytes((step % 2 << 4,)) + b"endless")
        assert answer is not None
        if answer[0] == 0x80:
            break
    assert answer == encode_abort(NAME, Abort.OUT_OF_MEMORY)


@pytest.mark.parametrize(
    ("requests", "code"),
    [
        (["60" + 14 * "0"], Abort.COMMAND),  # a segment of nothing
        (["00" + 14 * "0"], Abort.COMMAND),
        (["A0 08 10 00 7F 00 00 00"], Abort.COMMAND),  # block upload
        (["C0 08 10 00 00 00 00 00"], Abort.COMMAND),  # block download
        (["40 08 10 00 00 00 00 00", "70" + 14 * "0"], Abort.TOGGLE),
        (["21 08 10 00 09 00 00 00", "10 6E 6F 72 74 68 66 69"], Abort.TOGGLE),
        (["40 08 10 00 00 00 00 00", "80 08 10 00 00 00 04 05", "60" + 14 * "0"], Abort.COMMAND),
    ],
)
def test_a_client_that_breaks_the_rules_is_told_so(requests: list[str], code: Abort) -> None:
    server = SdoServer(Dictionary({NAME: b"northfinder"}))
    answers = [server.answer(bytes.fromhex(request)) for request in requests]
    answer = answers[-1]
    assert answer is not None
    assert answer[0] == 0x80
    assert int.from_bytes(answer[4:], "little") == code
    assert carry_out(Transfer(NAME), server.answer) == b"northfinder"


def test_a_frame_of_another_length_is_no_request() -> None:
    server = SdoServer(Dictionary({NAME: b"northfinder"}))
    assert server.answer(b"") is None
    assert server.answer(bytes(7)) is None
    assert server.answer(bytes(64)) is None


@given(entries, values, values)
def test_any_value_survives_both_ways(entry: Entry, before: bytes, after: bytes) -> None:
    objects = Dictionary({entry: before})
    server = SdoServer(objects)
    assert carry_out(Transfer(entry), server.answer) == before
    assert carry_out(Transfer(entry, after), server.answer) == b""
    assert objects.objects == {entry: after}
    assert carry_out(Transfer(entry), server.answer) == after


@given(st.builds(Entry, st.integers(0x2000, 0x5FFF)), values.filter(bool), values)
def test_our_client_reads_and_writes_the_librarys_server(
    entry: Entry, before: bytes, after: bytes
) -> None:
    wire, local = their_server({entry: before})
    assert carry_out(Transfer(entry), wire.ask) == before
    assert carry_out(Transfer(entry, after), wire.ask) == b""
    assert bytes(local.get_data(entry.index, entry.sub_index)) == after


@given(entries, values.filter(bool), values)
def test_the_librarys_client_reads_and_writes_our_server(
    entry: Entry, before: bytes, after: bytes
) -> None:
    objects = Dictionary({entry: before})
    remote = their_client(SdoServer(objects))
    assert bytes(remote.sdo.upload(entry.index, entry.sub_index)) == before
    remote.sdo.download(entry.index, entry.sub_index, after)
    assert objects.objects[entry] == after


def test_we_understand_the_refusals_of_the_librarys_server() -> None:
    wire, _ = their_server({NAME: b"northfinder"}, access="ro")
    absent = Entry(0x2000)
    assert carry_out(Transfer(absent), wire.ask) == Aborted(absent, Abort.NO_OBJECT)
    assert carry_out(Transfer(NAME, b"xy"), wire.ask) == Aborted(NAME, Abort.READ_ONLY)
    assert carry_out(Transfer(NAME, b"x" * 9), wire.ask) == Aborted(NAME, Abort.READ_ONLY)
    wire, _ = their_server({NAME: b"northfinder"}, access="wo")
    assert carry_out(Transfer(NAME), wire.ask) == Aborted(NAME, Abort.WRITE_ONLY)


@pytest.mark.parametrize("code", list(Abort))
@pytest.mark.parametrize("value", [b"x", b"northfinder"])
def test_the_librarys_client_understands_our_refusals(code: Abort, value: bytes) -> None:
    objects = Dictionary({NAME: value})
    objects.closed[NAME] = code
    remote = their_client(SdoServer(objects))
    with pytest.raises(canopen.SdoAbortedError) as read:
        remote.sdo.upload(NAME.index, NAME.sub_index)
    assert read.value.code == code
    with pytest.raises(canopen.SdoAbortedError) as written:
        remote.sdo.download(NAME.index, NAME.sub_index, value)
    assert written.value.code == code
    assert objects.objects == {NAME: value}


def test_every_reason_for_an_abort_is_told_in_words() -> None:
    assert describe_abort(0x0602_0000) == "there is no such object (abort 06020000h)"
    assert describe_abort(0x0503_0000) == "a segment was lost or repeated (abort 05030000h)"
    assert (
        describe_abort(0xDEAD_BEEF) == "for a reason that CiA 301 does not list (abort DEADBEEFh)"
    )
    theirs = canopen.SdoAbortedError.CODES
    for code in Abort:
        assert code in theirs, f"{code:08X}h"
        assert "not list" not in describe_abort(code)
        assert str(AccessError(code)) == describe_abort(code)


def test_an_entry_reads_as_manuals_print_it() -> None:
    assert str(Entry(0x6099, 2)) == "6099h:2"
    assert str(Entry(0x1003, 254)) == "1003h:FE"


def talk(requests: list[bytes], value: bytes) -> None:
    """Each request is answered in eight bytes or not at all; afterwards all is well."""
    objects = Dictionary({NAME: value, Entry(0): value})
    server = SdoServer(objects)
    for request in requests:
        answer = server.answer(request)
        assert answer is None or len(answer) == len(request) == 8
        assert answer is not None or len(request) != 8 or request[0] >> 5 == 4
    assert carry_out(Transfer(NAME), server.answer) == objects.objects[NAME]
    assert carry_out(Transfer(NAME, b"northfinder"), server.answer) == b""
    assert carry_out(Transfer(NAME), server.answer) == b"northfinder"


def listen(transfer: Transfer, answers: list[bytes]) -> None:
    """What belongs brings the transfer on or ends it; nothing else is let in."""
    place = transfer.begin()[1:4]
    for data in answers:
        for answer in (data, data[:1] + place + data[4:]):
            if transfer.result is not None or not transfer.belongs(answer):
                continue
            request = transfer.answer(answer)
            assert request is None or len(request) == 8
            assert transfer.result is not None or request is not None


@given(st.lists(garbage, min_size=20, max_size=20), values)
def test_any_request_is_answered_or_none(requests: list[bytes], value: bytes) -> None:
    talk(requests, value)


@given(entries, st.none() | values, st.lists(garbage, min_size=20, max_size=20))
def test_any_answer_is_taken_or_ends_the_transfer(
    entry: Entry, value: bytes | None, answers: list[bytes]
) -> None:
    listen(Transfer(entry, value), answers)


@pytest.mark.parametrize(
    "count", [1_750, pytest.param(150_000, marks=[pytest.mark.proof, pytest.mark.timeout(600)])]
)
def test_many_frames_of_noise_leave_both_ends_in_order(count: int, record_property: Record) -> None:
    record_property("measured", f"{40 * count:,} frames")
    noise = random.Random(301)
    for _ in range(count):
        frames = [noise.randbytes(noise.choice([8, 8, noise.randrange(65)])) for _ in range(40)]
        value = noise.randbytes(noise.randrange(201))
        talk(frames[:20], value)
        entry = Entry(noise.getrandbits(16), noise.getrandbits(8))
        listen(Transfer(entry, noise.choice([None, value])), frames[20:])
