"""Our bus on the kernel's own CAN, with can-utils as foreign eyes and hands."""

import asyncio
import gc
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from drivers.errors import LinkTimeoutError, TransportError
from drivers.interfaces import CanFilter, CanFrame
from drivers.links.can import CanBus
from drivers.links.can_port import CanPort
from tests.can.onlookers import (
    BUS_OFF,
    CHANNEL,
    ERROR_WARNING,
    SOON_S,
    candump,
    cansend,
    ip_link,
    kernel_filters,
    received,
)
from tests.evidence import Record

WANTED = 0x181
RATE_HZ, FOREIGN_PER_WANTED, SECONDS = 1000, 5, 2


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(SOON_S):
        while not condition():  # noqa: ASYNC110 -- the kernel does not tell
            await asyncio.sleep(0.005)


def on_vcan(session: Callable[[CanPort], Awaitable[None]], *filters: CanFilter) -> None:
    """Run a session with an opened port."""

    async def run() -> None:
        port = CanPort(CanBus("socketcan", CHANNEL, {}))
        if filters:
            port.set_filters(filters)
        await port.open()
        try:
            await session(port)
        finally:
            await port.close()

    asyncio.run(run())


async def failure_of(pending: Awaitable[object]) -> str:
    """Return what it fails with, in time."""
    begun_s = time.monotonic()
    with pytest.raises(TransportError) as raised:
        await pending
    assert not isinstance(raised.value, LinkTimeoutError)
    assert time.monotonic() - begun_s < SOON_S
    return str(raised.value)


@pytest.mark.parametrize(
    ("frame", "line"),
    [  # as candump -L writes them
        (CanFrame(0x123, b"\xde\xad"), "123#DEAD"),
        (CanFrame(0x705, b"\x00"), "705#00"),
        (CanFrame(0x09F11323, bytes.fromhex("111D090000FFFFFF"), extended=True),
         "09F11323#111D090000FFFFFF"),
        (CanFrame(0x123, remote=True), "123#R"),
        (CanFrame(0x123), "123#"),
    ],
)  # fmt: skip
def test_frames_pass_to_and_from_can_utils(frame: CanFrame, line: str) -> None:
    async def session(port: CanPort) -> None:
        with candump("-n", "1") as seen:
            await port.write(frame)
            assert seen.readline().split()[2] == line
        cansend(line)
        sent_s = asyncio.get_running_loop().time()
        frames, (arrival_s,) = await port.read(SOON_S)
        assert frames == [frame]
        assert abs(arrival_s - sent_s) < SOON_S

    on_vcan(session)


def test_filters_are_the_kernels() -> None:
    """What nobody wants does not wake us: the kernel lists the filters and drops the rest."""

    async def session(port: CanPort) -> None:
        # 80000000h in a mask: standard and extended identifiers are told apart (linux/can.h)
        wanted = [("185", "800007ff"), ("700", "80000780")]
        assert kernel_filters() == dict.fromkeys(wanted, 0)
        for line in ("184#01", "185#02", "00000185#03", "7FF#04", "680#05", "705#05"):
            cansend(line)
        got: list[CanFrame] = []
        while len(got) < 2:
            got += (await port.read(SOON_S)).frames
        assert got == [CanFrame(0x185, b"\x02"), CanFrame(0x705, b"\x05")]
        assert kernel_filters() == dict.fromkeys(wanted, 1)

    on_vcan(session, CanFilter(0x185, 0x7FF), CanFilter(0x700, 0x780))


def test_an_error_frame_is_counted_and_bus_off_fails_the_port() -> None:
    async def session(port: CanPort) -> None:
        cansend(ERROR_WARNING)
        await until(lambda: port.error_frames == 1)
        cansend("123#01")
        assert (await port.read(SOON_S)).frames == [CanFrame(0x123, b"\x01")]
        reading = asyncio.create_task(port.read(60.0))
        await asyncio.sleep(0)  # it waits
        cansend(BUS_OFF)
        assert "socketcan vcan0 is bus-off" in await failure_of(reading)
        assert "is bus-off" in await failure_of(port.write(CanFrame(0x123)))
        await port.open()
        cansend("123#02")
        assert (await port.read(SOON_S)).frames == [CanFrame(0x123, b"\x02")]

    on_vcan(session)


def test_an_interface_that_goes_down_fails_the_port_and_comes_back() -> None:
    async def session(port: CanPort) -> None:
        reading = asyncio.create_task(port.read(60.0))
        await asyncio.sleep(0)
        ip_link("down")
        try:
            assert "socketcan vcan0 has failed" in await failure_of(reading)
            assert "vcan0" in await failure_of(port.write(CanFrame(0x123)))
        finally:
            ip_link("up")
        await port.open()
        cansend("123#02")
        assert (await port.read(SOON_S)).frames == [CanFrame(0x123, b"\x02")]

    on_vcan(session)


def test_an_interface_that_is_down_is_told() -> None:
    async def session(port: CanPort) -> None:
        assert "socketcan vcan0 has failed" in await failure_of(port.read(60.0))

    ip_link("down")
    try:
        on_vcan(session)
    finally:
        ip_link("up")


# python-can leaves its socket to the garbage collector.
@pytest.mark.filterwarnings("ignore:Exception ignored in. <socket")
@pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning")
def test_an_interface_that_is_absent_is_told() -> None:
    absent = CanPort(CanBus("socketcan", "vcan9", {}))
    with pytest.raises(TransportError, match="socketcan vcan9 cannot be opened"):
        asyncio.run(absent.open())
    gc.collect()


def test_a_loaded_bus_loses_nothing_of_a_wanted_stream(
    tmp_path: Path, record_property: Record
) -> None:
    """6 000 frames/s, about 80 % of 1 Mbit/s, replayed in their own time by canplayer."""
    log = tmp_path / "load.log"
    with log.open("w") as lines:
        for number in range(RATE_HZ * SECONDS):
            stamp = f"({1.7e9 + number / RATE_HZ:.6f}) {CHANNEL}"
            lines.write(f"{stamp} {WANTED:03X}#{number.to_bytes(8, 'little').hex()}\n")
            for foreign in range(FOREIGN_PER_WANTED):
                lines.write(f"{stamp} {0x300 + foreign:03X}#{number:016X}\n")

    async def session(port: CanPort) -> None:
        before, begun_s = received(), time.monotonic()
        player = await asyncio.create_subprocess_exec("canplayer", "-I", str(log))
        got: list[CanFrame] = []
        while len(got) < RATE_HZ * SECONDS:
            got += (await port.read(SOON_S)).frames
        assert time.monotonic() - begun_s < 1.5 * SECONDS  # the load was one
        assert await player.wait() == 0
        numbers = [int.from_bytes(frame.data, "little") for frame in got]
        absent = set(range(RATE_HZ * SECONDS)) - set(numbers)
        record_property("measured", f"{len(absent)} of {RATE_HZ * SECONDS} lost")
        assert {frame.can_id for frame in got} == {WANTED}
        assert numbers == list(range(RATE_HZ * SECONDS))
        assert received() - before == (1 + FOREIGN_PER_WANTED) * len(got)

    on_vcan(session, CanFilter(WANTED, 0x7FF))
