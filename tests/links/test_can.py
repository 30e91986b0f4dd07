"""A bus that python-can opens: its `virtual` one, in real time, with its own ends as the others."""

import asyncio
import errno
import select
import sys
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from itertools import count
from types import SimpleNamespace
from typing import Any

import can
import pytest
from can.interfaces.virtual import VirtualBus
from serial import serialposix

from drivers.errors import LinkTimeoutError, TransportError
from drivers.interfaces import CanFilter, CanFrame
from drivers.links.can import CanBus
from drivers.links.can_port import CanPort
from sim.pty import serve_on_pty

SOON_S = 2.0
BUS_OFF = 0x40  # linux/can/error.h
_numbers = count()


@pytest.fixture
def channel() -> str:
    return f"northfinder-test-{next(_numbers)}"


@pytest.fixture
def other(channel: str) -> Iterator[can.BusABC]:
    """Another participant, of which we know nothing."""
    with can.Bus(interface="virtual", channel=channel) as bus:
        yield bus


def on_bus(channel: str, session: Callable[[CanBus, CanPort], Awaitable[None]]) -> None:
    """Run a session with an opened port; afterwards its thread is gone."""
    before = threading.active_count()

    async def run() -> None:
        bus = CanBus("virtual", channel, {})
        port = CanPort(bus)
        await port.open()
        try:
            await session(bus, port)
        finally:
            await port.close()
            assert not [one for one in threading.enumerate() if channel in one.name]

    asyncio.run(run())
    assert threading.active_count() == before


async def read(port: CanPort, number: int) -> list[CanFrame]:
    """Return so many frames."""
    frames: list[CanFrame] = []
    while len(frames) < number:
        frames += (await port.read(SOON_S)).frames
    return frames


async def failure_of(pending: Awaitable[object]) -> str:
    """Return what it fails with, in time."""
    begun_s = time.monotonic()
    with pytest.raises(TransportError) as raised:
        await pending
    assert not isinstance(raised.value, LinkTimeoutError)
    assert time.monotonic() - begun_s < SOON_S
    return str(raised.value)


@pytest.mark.parametrize(
    "frame",
    [
        CanFrame(0x123, b"\xde\xad"),
        CanFrame(0x705),
        CanFrame(0x09F11323, bytes(range(8)), extended=True),
        CanFrame(0x123, remote=True),
        CanFrame(0x123, bytes(range(64))),  # CAN FD
        CanFrame(0x123, bytes(range(12))),
    ],
)
def test_frames_pass_both_ways(channel: str, other: can.BusABC, frame: CanFrame) -> None:
    async def session(bus: CanBus, port: CanPort) -> None:
        assert port.name == bus.name == f"virtual {channel}"
        await port.write(frame)
        message = other.recv(SOON_S)
        assert message is not None
        seen = message.arbitration_id, bytes(message.data)
        assert (*seen, message.is_extended_id, message.is_remote_frame) == frame
        assert message.is_fd == (len(frame.data) > 8)
        before_s = asyncio.get_running_loop().time()
        other.send(message)
        (got,), (arrival_s,) = await port.read(SOON_S)
        assert got == frame
        assert before_s - 0.01 <= arrival_s <= asyncio.get_running_loop().time()

    on_bus(channel, session)


def test_two_ports_share_one_bus_each_with_its_filters(channel: str, other: can.BusABC) -> None:
    async def session(bus: CanBus, port: CanPort) -> None:
        second = CanPort(bus)
        second.set_filters([CanFilter(0x185, 0x7FF), CanFilter(0x700, 0x780)])
        await second.open()
        readers = [one for one in threading.enumerate() if channel in one.name]
        assert len(readers) == 1
        sent = [0x184, 0x185, 0x705, 0x780]
        for can_id in sent:
            other.send(can.Message(arbitration_id=can_id, is_extended_id=False))
        assert [frame.can_id for frame in await read(port, 4)] == sent
        assert [frame.can_id for frame in await read(second, 2)] == [0x185, 0x705]
        await port.close()
        other.send(can.Message(arbitration_id=0x706, is_extended_id=False))
        assert [frame.can_id for frame in await read(second, 1)] == [0x706]
        await second.close()

    on_bus(channel, session)


def keep_full(
    monkeypatch: pytest.MonkeyPatch, stamp_s: Callable[[float], float] = lambda now_s: now_s
) -> None:
    """Let the interface have one more frame whenever it is asked, after a millisecond."""

    def another(*_: Any) -> can.Message:  # noqa: ANN401 - as python-can's
        time.sleep(0.001)
        return can.Message(arbitration_id=0x705, timestamp=stamp_s(time.time()))

    monkeypatch.setattr(VirtualBus, "recv", another)


def test_frames_that_come_as_fast_as_they_are_read_are_handed_over(
    channel: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a computer that is too busy to catch up: the kernel always has one more."""

    async def session(_: CanBus, port: CanPort) -> None:
        keep_full(monkeypatch)
        for _once in range(5):
            await port.read(0.4)  # in time: a node is silent after 0.5 s

    on_bus(channel, session)


@pytest.mark.parametrize(
    ("stamp_s", "age_s"),
    [
        (lambda now_s: now_s - 3.0, 3.0),  # the kernel kept it while the computer was busy
        (lambda now_s: now_s + 0.5, 0.0),  # the system's time was set back
        (lambda _: 1000.0, 0.0),  # the interface counts from its own start
    ],
    ids=["waited", "later than now", "own clock"],
)
def test_a_frame_arrived_when_its_timestamp_says_if_that_is_the_system_s_time(
    channel: str,
    monkeypatch: pytest.MonkeyPatch,
    stamp_s: Callable[[float], float],
    age_s: float,
) -> None:
    async def session(_: CanBus, port: CanPort) -> None:
        keep_full(monkeypatch, stamp_s)
        arrival_s = (await port.read(SOON_S)).times_s[-1]
        waited_s = asyncio.get_running_loop().time() - arrival_s
        assert age_s - 0.01 < waited_s < age_s + 0.5

    on_bus(channel, session)


def test_the_controller_filters_what_nobody_wants(channel: str, other: can.BusABC) -> None:
    """python-can's own filter, where it has no better one: the frame does not reach any port."""

    async def session(bus: CanBus, port: CanPort) -> None:
        port.set_filters([CanFilter(0x185, 0x7FF)])
        await port.open()
        asked: list[CanFrame] = []

        def receive(frame: CanFrame, arrival_s: float | None = None) -> None:  # noqa: ARG001 -- theirs
            asked.append(frame)

        port.receive = receive  # type: ignore[method-assign]
        for can_id in (0x184, 0x185):
            other.send(can.Message(arbitration_id=can_id, is_extended_id=False))
        async with asyncio.timeout(SOON_S):
            while not asked:  # noqa: ASYNC110 -- the last of both is what is waited for
                await asyncio.sleep(0.005)
        assert asked == [CanFrame(0x185)]
        assert bus.error_frames == 0

    on_bus(channel, session)


def test_error_frames_are_counted_and_bus_off_fails_every_port(
    channel: str, other: can.BusABC
) -> None:
    async def session(bus: CanBus, port: CanPort) -> None:
        second = CanPort(bus)
        await second.open()
        other.send(can.Message(arbitration_id=0x04, is_error_frame=True))
        other.send(can.Message(arbitration_id=0x123, is_extended_id=False))
        assert await read(port, 1) == await read(second, 1) == [CanFrame(0x123)]
        assert port.error_frames == second.error_frames == 1
        waiting = [asyncio.create_task(one.read(60.0)) for one in (port, second)]
        await asyncio.sleep(0)  # they wait
        other.send(can.Message(arbitration_id=BUS_OFF, is_error_frame=True))
        for one in waiting:
            assert f"virtual {channel} is bus-off; check termination" in await failure_of(one)
        assert "bus-off" in await failure_of(port.write(CanFrame(1)))
        await second.close()

    on_bus(channel, session)


def test_a_bus_that_failed_works_again_once_it_is_opened_again(
    channel: str, other: can.BusABC
) -> None:
    async def session(_: CanBus, port: CanPort) -> None:
        other.send(can.Message(arbitration_id=BUS_OFF, is_error_frame=True))
        await failure_of(port.read(60.0))
        for can_id in (1, 2):
            await port.open()
            assert port.error_frames == 0
            other.send(can.Message(arbitration_id=can_id, is_extended_id=False))
            assert await read(port, 1) == [CanFrame(can_id)]
            await port.write(CanFrame(can_id))
            assert other.recv(SOON_S) is not None

    on_bus(channel, session)


def unplug(bus: CanBus) -> None:
    """Take the interface away, as a USB adapter does."""
    assert bus._bus is not None
    bus._bus.shutdown()


def test_an_interface_that_goes_away_fails_every_port(channel: str) -> None:
    async def session(bus: CanBus, port: CanPort) -> None:
        waiting = asyncio.create_task(port.read(60.0))
        await asyncio.sleep(0)
        unplug(bus)
        assert "has failed (Cannot operate on a closed bus); check interface" in await failure_of(
            waiting
        )
        with pytest.raises(TransportError, match="has failed"):
            await port.write(CanFrame(1))

    on_bus(channel, session)


def test_an_interface_that_only_a_sender_is_told_of_fails_every_port(
    channel: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As Linux does: the error of a socket is given once, to whoever uses it next."""

    def down(*_: Any, **__: Any) -> None:  # noqa: ANN401 - as python-can's
        raise can.CanOperationError from OSError(errno.ENETDOWN, "Network is down")

    async def session(bus: CanBus, port: CanPort) -> None:
        second = CanPort(bus)
        await second.open()
        waiting = asyncio.create_task(second.read(60.0))
        await asyncio.sleep(0)
        monkeypatch.setattr(VirtualBus, "send", down)
        assert "takes no frame" in await failure_of(port.write(CanFrame(1)))
        assert f"has failed ([Errno {errno.ENETDOWN}] Network is down)" in await failure_of(waiting)
        await second.close()

    on_bus(channel, session)


def test_drivers_that_recover_one_after_the_other_get_the_bus_back(
    channel: str, other: can.BusABC
) -> None:
    async def session(bus: CanBus, port: CanPort) -> None:
        second = CanPort(bus)
        await second.open()
        unplug(bus)
        for one in (port, second):
            await failure_of(one.read(60.0))
        for one in (port, second):
            await one.open()
            other.send(can.Message(arbitration_id=1, is_extended_id=False))
            assert await read(one, 1) == [CanFrame(1)]
        await second.close()

    on_bus(channel, session)


class Adapter:
    """The far end of a serial line: keeps what comes."""

    def __init__(self) -> None:
        self.received = bytearray()
        self.has_frame = asyncio.Event()

    def connect(self, send: Callable[[bytes], None]) -> None:
        """Nothing is ever sent."""

    def receive_data(self, data: bytes) -> None:
        self.received += data
        if b"t123101\r" in self.received:
            self.has_frame.set()


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")
def test_a_serial_adapter_outlives_a_pause_of_the_computer_amid_a_write(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The bytes are written, and only then is the process put aside for a while."""

    def late(*waits: Any) -> Any:  # noqa: ANN401 - as select's
        time.sleep(0.2)
        return select.select(*waits)

    async def session() -> None:
        adapter = Adapter()
        async with serve_on_pty(adapter) as path:
            port = CanPort(CanBus("slcan", path, {"sleep_after_open": 0.0}))
            await port.open()
            monkeypatch.setattr(serialposix, "select", SimpleNamespace(select=late))
            await port.write(CanFrame(0x123, b"\x01"))
            monkeypatch.undo()
            await asyncio.wait_for(adapter.has_frame.wait(), SOON_S)
            await port.close()

    asyncio.run(session())


def test_a_frame_that_the_interface_does_not_take_is_told(channel: str) -> None:
    async def session(bus: CanBus, port: CanPort) -> None:
        with can.Bus(interface="virtual", channel=channel, rx_queue_size=1):
            await port.write(CanFrame(1))
            refused = await failure_of(port.write(CanFrame(2)))
        assert f"virtual {channel} takes no frame (" in refused
        assert "check cable and termination" in refused
        await port.close()
        with pytest.raises(TransportError, match="is not open"):
            bus.send(CanFrame(1), port)

    on_bus(channel, session)


@pytest.mark.parametrize(
    ("interface", "options"),
    [
        ("socketcan", {}),  # no such interface, or no such kernel
        ("no-such-maker", {}),
        ("slcan", {}),
        ("socketcand", {"bitrate": 1}),  # it needs a host
    ],
)
def test_what_cannot_be_opened_is_told_in_a_sentence(
    interface: str, options: dict[str, object]
) -> None:
    async def run() -> None:
        port = CanPort(CanBus(interface, "northfinder-absent", options))
        for _ in range(2):
            with pytest.raises(
                TransportError, match=f"{interface} northfinder-absent cannot be op"
            ):
                await port.open()
        with pytest.raises(TransportError, match="is not open"):
            await port.read(1.0)
        await port.close()

    asyncio.run(run())
