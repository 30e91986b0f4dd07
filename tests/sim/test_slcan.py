"""The simulated adapter on a serial line, by the Lawicel manual and by python-can's own client."""

import asyncio
import sys
from collections.abc import Callable

import can
import pytest

from drivers.interfaces import CanFrame
from drivers.links.memory_can import MemoryBus
from sim.slcan import SlcanAdapter


def session() -> tuple[SlcanAdapter, MemoryBus, list[CanFrame], list[bytes]]:
    bus = MemoryBus("bus")
    heard: list[CanFrame] = []
    said: list[bytes] = []
    bus.attach(heard.append)
    adapter = SlcanAdapter(bus)
    adapter.connect(said.append)
    return adapter, bus, heard, said


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        (b"C\r", b"\r"),
        (b"S6\r", b"\r"),
        (b"s031C\r", b"\r"),
        (b"\r", b"\r"),
        (b"V\r", b"V1013\r"),
        (b"F\r", b"F00\r"),
        (b"Z1\r", b"\r"),
        (b"S9\r", b"\a"),
        (b"t1230\r", b"\a"),  # not open
        (b"nonsense\r", b"\a"),
    ],
)
def test_a_command_is_confirmed_or_refused(line: bytes, answer: bytes) -> None:
    adapter, _, heard, said = session()
    adapter.receive_data(line)
    assert (said, heard) == ([answer], [])


@pytest.mark.parametrize(
    ("line", "frame", "answer"),
    [
        (b"t605212AB\r", CanFrame(0x605, b"\x12\xab"), b"z\r"),
        (b"T09F113238111D090000FFFFFF\r", None, b"Z\r"),
        (b"r0800\r", CanFrame(0x80, remote=True), b"z\r"),
        (b"R000000802\r", CanFrame(0x80, extended=True, remote=True), b"Z\r"),
    ],
)
def test_frames_pass_to_the_bus(line: bytes, frame: CanFrame | None, answer: bytes) -> None:
    adapter, _, heard, said = session()
    for byte in b"O\r" + line:
        adapter.receive_data(bytes((byte,)))
    nmea = CanFrame(0x09F11323, bytes.fromhex("111D090000FFFFFF"), extended=True)
    assert (heard, said) == ([frame or nmea], [b"\r", answer])


@pytest.mark.parametrize(
    "line", [b"t60521\r", b"t6059\r", b"t8001FF\r", b"T2000000000\r", b"t60\r"]
)
def test_a_line_that_is_no_frame_is_refused(line: bytes) -> None:
    adapter, _, heard, said = session()
    adapter.receive_data(b"O\r" + line)
    assert (heard, said) == ([], [b"\r", b"\a"])


def test_frames_pass_from_the_bus_while_it_is_open_and_fit() -> None:
    adapter, bus, _, said = session()
    other: list[CanFrame] = []
    nobody: Callable[[CanFrame], None] = other.append
    bus.put(CanFrame(0x185, b"\x01"), nobody)
    adapter.receive_data(b"O\r")
    bus.put(CanFrame(0x185, b"\x01\xfe"), nobody)
    bus.put(CanFrame(0x09F11323, b"", extended=True), nobody)
    bus.put(CanFrame(0x185, bytes(12)), nobody)
    bus.put(CanFrame(0x80, remote=True), nobody)
    adapter.receive_data(b"C\r")
    bus.put(CanFrame(0x185, b"\x01"), nobody)
    assert said == [b"\r", b"t185201FE\r", b"T09F113230\r", b"r0800\r", b"\r"]


def test_a_line_without_an_end_is_not_kept_for_ever() -> None:
    adapter, _, _, said = session()
    adapter.receive_data(b"x" * 10_000)
    adapter.receive_data(b"\rV\r")
    assert said[-1] == b"V1013\r"


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")
def test_python_cans_own_client_opens_it_sends_and_receives() -> None:
    from sim.pty import serve_on_pty  # noqa: PLC0415 - absent on Windows

    async def serve() -> tuple[list[CanFrame], can.Message | None]:
        adapter, bus, heard, _ = session()
        async with serve_on_pty(adapter) as path:
            client = await asyncio.to_thread(_opened, path)
            try:
                await asyncio.to_thread(
                    client.send, can.Message(arbitration_id=0x605, data=b"\x40")
                )
                bus.put(CanFrame(0x585, b"\x43\x00\x10\x00"), heard.append)
                return heard, await asyncio.to_thread(client.recv, 5.0)
            finally:
                await asyncio.to_thread(client.shutdown)

    heard, message = asyncio.run(serve())
    assert message is not None
    assert (message.arbitration_id, bytes(message.data)) == (0x585, b"\x43\x00\x10\x00")
    assert [frame.can_id for frame in heard] == [0x605]


def _opened(path: str) -> can.BusABC:
    return can.Bus(interface="slcan", channel=path, bitrate=500_000, sleep_after_open=0)
