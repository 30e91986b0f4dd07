"""A CANopen node as its master sees it: objects, silence, restarts and doubles, in virtual time."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence

import pytest

from drivers.canopen.node import CanopenNode
from drivers.codecs.canopen import Emergency, NmtCommand, NmtState, encode_emergency
from drivers.codecs.canopen import encode_heartbeat as beat
from drivers.codecs.sdo import Abort, Entry
from drivers.codecs.sdo_server import AccessError, SdoServer
from drivers.errors import (
    DriverError,
    LinkTimeoutError,
    ProtocolError,
    RefusedError,
    TransportError,
)
from drivers.interfaces import CanFrame
from drivers.links.can_port import CanPort
from drivers.links.memory_can import MemoryBus
from sim.clock import run_virtual

NUMBER = 5
IN_TIME_S = 2.0
TYPE, NAME, OFFSET, CLOSED = Entry(0x1000), Entry(0x1008), Entry(0x607C), Entry(0x1010, 1)
HEARTBEAT_TIME = Entry(0x1017)
PDO = 0x180 + NUMBER


class Dictionary:
    """The objects of a node; one of them may only be read."""

    def __init__(self) -> None:
        self.values = {
            TYPE: (0x0002_0192).to_bytes(4, "little"),
            NAME: b"a drive for tables\0",
            OFFSET: (-5).to_bytes(4, "little", signed=True),
            CLOSED: b"\x01",
            HEARTBEAT_TIME: b"\0\0",
        }

    def read(self, entry: Entry) -> bytes:
        if entry not in self.values:
            raise AccessError(Abort.NO_OBJECT)
        return self.values[entry]

    def write(self, entry: Entry, value: bytes) -> None:
        self.read(entry)
        if entry == CLOSED:
            raise AccessError(Abort.READ_ONLY)
        self.values[entry] = value


class ScriptedNode:
    """A node that answers after a while, beats as it is told, and fails as a test wants.

    Attributes:
        delay_s: From a request to its answer.
        answers: It does.
        beats: It does, where 1017h says so.
        ignores: So many requests more, as if they had been lost.
        heard: Requests and commands.
    """

    def __init__(self, bus: MemoryBus, number: int = NUMBER, delay_s: float = 0.005) -> None:
        self.dictionary = Dictionary()
        self.delay_s, self.answers, self.beats = delay_s, True, True
        self.ignores = 0
        self.heard: list[CanFrame] = []
        self._bus, self._number = bus, number
        self._server = SdoServer(self.dictionary)
        self._beat: asyncio.TimerHandle | None = None
        bus.attach(self._receive)
        self._schedule()

    @property
    def heartbeat_ms(self) -> int:
        return int.from_bytes(self.dictionary.values.get(HEARTBEAT_TIME, b""), "little")

    @heartbeat_ms.setter
    def heartbeat_ms(self, value: int) -> None:
        self.dictionary.values[HEARTBEAT_TIME] = value.to_bytes(2, "little")
        self._schedule()

    def say(self, frame: CanFrame) -> None:
        self._bus.put(frame, self._receive)

    def lose_power(self) -> None:
        self.answers = self.beats = False

    def _receive(self, frame: CanFrame) -> None:
        self.heard.append(frame)
        if frame.can_id != 0x600 + self._number:
            return
        if self.ignores:
            self.ignores -= 1
        elif self.answers:
            loop = asyncio.get_running_loop()
            loop.call_later(self.delay_s, self._answer, frame.data)

    def _answer(self, request: bytes) -> None:
        before, answer = self.heartbeat_ms, self._server.answer(request)
        if answer is not None and self.answers:
            self.say(CanFrame(0x580 + self._number, answer))
        if self.heartbeat_ms != before:
            self._schedule()

    def _schedule(self) -> None:
        if self._beat is not None:
            self._beat.cancel()
        if self.heartbeat_ms:
            loop = asyncio.get_running_loop()
            self._beat = loop.call_later(self.heartbeat_ms / 1000, self._send_beat)

    def _send_beat(self) -> None:
        if self.beats:
            self.say(beat(self._number, NmtState.PRE_OPERATIONAL))
        self._schedule()


Session = Callable[[CanopenNode, ScriptedNode, MemoryBus], Awaitable[None]]


def converse(session: Session, *, opened: bool = True, pdos: Sequence[int] = (PDO,)) -> None:
    """Run a session with a node on a bus, and close it."""

    async def run() -> None:
        bus = MemoryBus("sim:can")
        scripted = ScriptedNode(bus)
        node = CanopenNode(CanPort(bus), NUMBER, pdos)
        if opened:
            await node.open()
        try:
            await session(node, scripted, bus)
        finally:
            await node.close()

    run_virtual(run())


async def failure_of(calls: Awaitable[object]) -> DriverError:
    """Return what it fails with, in time."""
    loop = asyncio.get_running_loop()
    begun_s = loop.time()
    with pytest.raises(DriverError) as raised:
        await calls
    assert loop.time() - begun_s <= IN_TIME_S
    return raised.value


async def ask_for_ever(node: CanopenNode) -> None:
    while True:
        await node.value(TYPE)
        await asyncio.sleep(0.05)


def test_objects_are_read_and_written() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        assert node.name == "node 5 on sim:can"
        assert await node.value(TYPE) == bytes.fromhex("92010200")
        assert await node.number(TYPE) == 0x20192
        assert await node.number(OFFSET, signed=True) == -5
        assert await node.number_if_present(TYPE) == 0x20192
        assert await node.text_if_present(NAME) == "a drive for tables"
        await node.write(OFFSET, -2, 4)
        assert scripted.dictionary.values[OFFSET] == bytes.fromhex("FEFFFFFF")
        assert node.counters.lost == 0
        assert node.counters.frames > 6

    converse(session)


def test_objects_that_a_node_need_not_have_are_none() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        assert await node.number_if_present(Entry(0x6502)) is None
        assert await node.text_if_present(Entry(0x100A)) == ""
        scripted.dictionary.read = refuse  # type: ignore[method-assign]
        with pytest.raises(RefusedError, match="its hardware failed"):
            await node.number_if_present(TYPE)
        with pytest.raises(RefusedError, match="its hardware failed"):
            await node.text_if_present(NAME)

    def refuse(entry: Entry) -> bytes:  # noqa: ARG001 -- a node's
        raise AccessError(Abort.HARDWARE)

    converse(session)


def test_a_refusal_is_told_in_words_and_the_node_lives_on() -> None:
    async def session(node: CanopenNode, _: ScriptedNode, __: MemoryBus) -> None:
        with pytest.raises(RefusedError) as raised:
            await node.value(Entry(0x6099, 2))
        assert raised.value.code == 0x0602_0000
        assert str(raised.value) == (
            "The node 5 on sim:can refuses to read 6099h:2: there is no such object"
            " (abort 06020000h)."
        )
        with pytest.raises(
            RefusedError, match=r"refuses to write 1 to 1010h:1: the object can only"
        ):
            await node.write(CLOSED, 1, 4)
        assert await node.number(TYPE) == 0x20192

    converse(session)


def test_what_shall_not_be_written_any_more_is_not() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        def check() -> None:
            msg = "stopped"
            raise RuntimeError(msg)

        heard = len(scripted.heard)
        with pytest.raises(RuntimeError, match="stopped"):
            await node.write(OFFSET, 1, 4, check=check)
        assert len(scripted.heard) == heard

    converse(session)


def test_commands_and_frames_go_out_and_process_data_comes_in() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        await node.command(NmtCommand.START)
        assert scripted.heard[-1] == CanFrame(0x000, b"\x01\x05")
        await node.send(CanFrame(0x080))
        assert scripted.heard[-1] == CanFrame(0x080)
        scripted.say(CanFrame(0x186, b"of node 6"[:8]))
        scripted.say(CanFrame(PDO, b"\x37\x06"))
        assert (await node.read(1.0)).frames == [CanFrame(PDO, b"\x37\x06")]
        with pytest.raises(LinkTimeoutError, match="node 5 on sim:can was silent"):
            await node.read(0.3)

    converse(session)


def test_an_emergency_is_kept_until_it_is_taken_back() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        emergency = Emergency(0x8611, 0x21, b"maker")
        scripted.say(encode_emergency(NUMBER, emergency))
        await node.value(TYPE)
        assert node.emergency == emergency
        scripted.say(CanFrame(0x080 + NUMBER, b"no emergency"[:7]))
        scripted.say(encode_emergency(NUMBER, Emergency(0, 0)))
        await node.value(TYPE)
        assert node.emergency is None

    converse(session)


@pytest.mark.parametrize(("others", "words"), [((7, 9), "nodes 7, 9"), ((), "none")])
def test_a_wrong_number_names_the_nodes_that_are_there(others: tuple[int, ...], words: str) -> None:
    async def run() -> None:
        bus = MemoryBus("sim:can")
        for number in others:
            ScriptedNode(bus, number).heartbeat_ms = 200
        node = CanopenNode(CanPort(bus), NUMBER)
        error = await failure_of(node.open())
        assert isinstance(error, LinkTimeoutError)
        assert str(error) == (
            "The node 5 on sim:can did not answer within 0.5 s (asked for 1017h:0, 2 times). Check"
            f" its power, its node number and the bit rate. Others heard on this bus: {words}."
        )
        assert node.counters.lost == 2

    run_virtual(run())


def test_a_heartbeat_that_stops_while_answers_go_on_is_told() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        scripted.beats = False
        error = await failure_of(ask_for_ever(node))
        assert "still answers, but sends no heartbeat any more: its firmware hangs" in str(error)

    converse(session)


def test_a_node_that_lost_its_power_fails_who_waits_and_who_asks() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        await asyncio.sleep(1.0)
        scripted.lose_power()
        silent = r"The node 5 on sim:can has been silent for 0\.5 s. Check its power and its cable"
        with pytest.raises(TransportError, match=silent):
            raise await failure_of(node.read(60.0))
        with pytest.raises(LinkTimeoutError, match=silent):
            await node.value(TYPE)
        with pytest.raises(LinkTimeoutError, match=silent):
            await node.command(NmtCommand.STOP)

    converse(session)


def test_power_lost_amid_a_question_is_told_in_time() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        scripted.delay_s = 0.1
        asking = asyncio.create_task(node.value(TYPE))
        await asyncio.sleep(0.05)
        scripted.lose_power()
        error = await failure_of(asking)
        assert isinstance(error, LinkTimeoutError)
        assert "Check its power" in str(error)

    converse(session)


def test_a_restart_is_told_at_once() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        waiting = asyncio.create_task(failure_of(node.read(60.0)))
        await asyncio.sleep(0.5)
        scripted.say(beat(NUMBER, NmtState.BOOT_UP))
        error = await waiting
        assert isinstance(error, TransportError)
        assert "The node 5 on sim:can has restarted: it lost power for a moment" in str(error)

    converse(session)


@pytest.mark.parametrize("second_s", [0.005, 0.007, 0.012])
def test_two_nodes_of_one_number_are_told_by_their_answers(second_s: float) -> None:
    async def session(node: CanopenNode, _: ScriptedNode, bus: MemoryBus) -> None:
        async def open_and_ask() -> None:
            await node.open()  # a second answer to its last question comes a little later
            await ask_for_ever(node)

        ScriptedNode(bus, delay_s=second_s)
        error = await failure_of(open_and_ask())
        assert isinstance(error, ProtocolError)
        assert "Two devices answer as node 5 on sim:can" in str(error)

    converse(session, opened=False)


@pytest.mark.parametrize("second_s", [0.005, 0.007, 0.012])
def test_a_second_node_switched_on_later_is_told(second_s: float) -> None:
    async def session(node: CanopenNode, _: ScriptedNode, bus: MemoryBus) -> None:
        ScriptedNode(bus, delay_s=second_s)
        error = await failure_of(ask_for_ever(node))
        assert "Two devices answer as node 5" in str(error)

    converse(session)


def test_two_nodes_of_one_number_are_told_by_their_heartbeats() -> None:
    async def session(node: CanopenNode, _: ScriptedNode, bus: MemoryBus) -> None:
        second = ScriptedNode(bus)
        second.answers, second.heartbeat_ms = False, 100
        error = await failure_of(node.read(60.0))
        assert "Two devices answer as node 5" in str(error)

    converse(session)


def test_a_bus_that_fails_is_told_to_who_waits_and_who_asks() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, bus: MemoryBus) -> None:
        scripted.delay_s = 0.1
        waiting = [
            asyncio.create_task(failure_of(node.read(60.0))),
            asyncio.create_task(failure_of(node.value(TYPE))),
        ]
        await asyncio.sleep(0.05)
        bus.fail("is bus-off; check termination")
        for error in await asyncio.gather(*waiting):
            assert isinstance(error, TransportError)
            assert str(error) == "sim:can is bus-off; check termination"
        with pytest.raises(TransportError, match="bus-off"):
            await node.write(OFFSET, 0, 4)
        with pytest.raises(TransportError, match="bus-off"):
            await node.open()
        bus.mend()
        await asyncio.sleep(0.1)  # the answer is on its way until then
        await node.open()
        assert await node.number(TYPE) == 0x20192

    converse(session)


@pytest.mark.parametrize("entry", [TYPE, NAME])
def test_a_question_that_was_lost_is_asked_once_more(entry: Entry) -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        scripted.ignores = 1
        assert await node.value(entry) == scripted.dictionary.values[entry]
        assert node.counters.lost == 1

    converse(session)


def test_a_number_that_is_written_is_never_sent_again_by_itself() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        scripted.ignores, heard = 1, len(scripted.heard)
        with pytest.raises(LinkTimeoutError, match=r"within 0\.5 s \(asked for 607Ch:0\)"):
            await node.write(OFFSET, 7, 4)
        assert len(scripted.heard) == heard + 1

    converse(session)


@pytest.mark.parametrize("entry", [TYPE, NAME])
def test_both_answers_to_a_question_asked_twice_are_its_own(entry: Entry) -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        scripted.delay_s = 0.6
        asking = asyncio.create_task(node.value(entry))
        await asyncio.sleep(0.55)  # it is asked a second time by now
        scripted.delay_s = 0.005
        assert await asking == scripted.dictionary.values[entry]
        await asyncio.sleep(1.0)
        assert await node.number(TYPE) == 0x20192
        assert node.counters.lost == 1

    converse(session)


@pytest.mark.parametrize("entry", [TYPE, NAME])
def test_answers_that_come_after_all_are_no_second_device(entry: Entry) -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        scripted.delay_s = 1.1
        asked = rf"within 0\.5 s \(asked for {entry}, 2 times\)"
        with pytest.raises(LinkTimeoutError, match=asked):
            await node.value(entry)
        scripted.delay_s = 0.3  # the first late answer comes while the same is asked again
        assert await node.number(TYPE) == 0x20192
        await asyncio.sleep(1.0)
        assert await node.text_if_present(NAME) == "a drive for tables"
        assert node.counters.lost == 2

    converse(session)


def test_a_question_may_be_given_up() -> None:
    async def session(node: CanopenNode, _: ScriptedNode, __: MemoryBus) -> None:
        asking = asyncio.create_task(node.value(TYPE))
        await asyncio.sleep(0.001)
        asking.cancel()
        await asyncio.wait([asking])
        assert asking.cancelled()
        assert await node.text_if_present(NAME) == "a drive for tables"
        assert await node.number(TYPE) == 0x20192

    converse(session)


def test_questions_wait_for_each_other() -> None:
    async def session(node: CanopenNode, _: ScriptedNode, __: MemoryBus) -> None:
        entries = [TYPE, NAME, OFFSET] * 5
        answers = await asyncio.gather(*map(node.value, entries))
        assert answers == [Dictionary().values[entry] for entry in entries]

    converse(session)


def test_a_server_that_breaks_the_rules_is_sent_our_abort() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        asking = asyncio.create_task(node.value(NAME))
        await asyncio.sleep(0.007)  # the first segment is asked for
        scripted.say(CanFrame(0x580 + NUMBER, bytes.fromhex("10 20 20 20 20 20 20 20")))
        with pytest.raises(RefusedError, match="a segment was lost or repeated"):
            await asking
        assert scripted.heard[-1].data == bytes.fromhex("80 08 10 00 00 00 03 05")

    converse(session)


@pytest.mark.parametrize(("found_ms", "writes"), [(0, [100, 0]), (1000, [100, 1000]), (100, [])])
def test_the_heartbeat_is_left_as_it_was_found(found_ms: int, writes: list[int]) -> None:
    async def run() -> None:
        bus = MemoryBus("sim:can")
        scripted = ScriptedNode(bus)
        scripted.heartbeat_ms = found_ms
        node = CanopenNode(CanPort(bus), NUMBER)
        await node.open()
        await asyncio.sleep(3.0)
        assert scripted.heartbeat_ms == 100
        await node.close()
        await node.close()
        assert scripted.heartbeat_ms == found_ms
        requests = [frame.data for frame in scripted.heard]
        written = [int.from_bytes(data[4:6], "little") for data in requests if data[0] == 0x2B]
        assert written == writes

    run_virtual(run())


def test_a_node_without_a_heartbeat_is_not_missed() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        del scripted.dictionary.values[HEARTBEAT_TIME]
        await node.open()
        scripted.say(beat(NUMBER, NmtState.BOOT_UP))
        await asyncio.sleep(5.0)
        assert await node.number(TYPE) == 0x20192

    converse(session, opened=False)


def test_a_node_that_came_back_is_opened_again() -> None:
    async def session(node: CanopenNode, scripted: ScriptedNode, _: MemoryBus) -> None:
        scripted.lose_power()
        await failure_of(node.read(60.0))
        scripted.answers = scripted.beats = True
        await node.open()
        assert await node.number(TYPE) == 0x20192
        await asyncio.sleep(3.0)
        assert await node.number(TYPE) == 0x20192

    converse(session)
