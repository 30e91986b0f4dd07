"""A sensor's stream survives silence, pulled cables and defects, and says what happened."""

import asyncio
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import numpy as np
import pytest

from drivers.errors import DeviceFaultError, DriverError, LinkTimeoutError, TransportError
from drivers.interfaces import Chunk, Counters, Listener, SampleBlock
from drivers.links.memory import MemoryLink
from drivers.stream import SensorStream
from sim.clock import run_virtual

NAME = "counter on sim:gyro"
PERIOD_S = 0.01


def block_of(chunk: Chunk) -> SampleBlock | None:
    """Take each byte above zero for a sample, and the byte for its tick, modulo 255."""
    counts = np.array([byte for byte in chunk.data if byte], dtype=np.int64)
    if not len(counts):
        return None
    wraps = np.rint((chunk.arrival_s / PERIOD_S - counts) / 255)
    tick = counts + 255 * wraps.astype(np.int64)
    nothing = np.full((len(tick), 3), np.nan)
    invalid = np.zeros((len(tick), 3), dtype=np.bool_)
    time_s = np.full(len(tick), chunk.arrival_s)
    return SampleBlock(tick, time_s, nothing, nothing, invalid, invalid, nothing[:, 0])


class Rig:
    """A device that counts to 255 and begins again, on a link whose cable a test may pull."""

    def __init__(self, decode: Callable[[Chunk], SampleBlock | None]) -> None:
        self.link = MemoryLink("sim:gyro", on_write=lambda _: None)
        self.counters = Counters()
        self.stream = SensorStream(self.link, NAME, decode, self._bring_up, self.counters)
        self.powered = True
        self.refusals: list[DriverError] = []
        self.brought_up_s: list[float] = []

    async def live(self) -> None:
        while True:
            for count in range(1, 256):
                await asyncio.sleep(PERIOD_S)
                if self.powered:
                    self.link.deliver(bytes([count]))

    async def _bring_up(self) -> None:
        if self.refusals:
            raise self.refusals.pop(0)
        await self.link.read(0.5)
        self.brought_up_s.append(now_s())


def now_s() -> float:
    return asyncio.get_running_loop().time()


@asynccontextmanager
async def streaming(
    decode: Callable[[Chunk], SampleBlock | None] = block_of,
) -> AsyncIterator[Rig]:
    rig = Rig(decode)
    await rig.link.open()
    life = asyncio.create_task(rig.live())
    rig.stream.start()
    try:
        yield rig
    finally:
        life.cancel()
        await rig.stream.stop()


def in_virtual_time(
    scenario: Callable[[Rig], Awaitable[None]],
    decode: Callable[[Chunk], SampleBlock | None] = block_of,
) -> None:
    async def session() -> None:
        async with streaming(decode) as rig:
            await scenario(rig)

    run_virtual(session())


async def ticks(listener: Listener, count: int) -> list[int]:
    return [int((await listener.next(1.0)).tick[0]) for _ in range(count)]


def test_each_listener_gets_every_block_from_when_it_began() -> None:
    async def scenario(rig: Rig) -> None:
        await asyncio.sleep(0.105)
        async with rig.stream.listen() as first:
            assert await ticks(first, 2) == [11, 12]
            async with rig.stream.listen() as second:
                assert await ticks(second, 2) == [13, 14]
            assert await ticks(first, 3) == [13, 14, 15]

    in_virtual_time(scenario)


def test_chunks_that_complete_no_sample_are_passed_over() -> None:
    async def scenario(rig: Rig) -> None:
        async with rig.stream.listen() as listener:
            rig.link.deliver(bytes(5))
            assert await ticks(listener, 1) == [1]

    in_virtual_time(scenario)


def test_a_listener_that_waits_in_vain_is_told_what_to_check() -> None:
    async def scenario(rig: Rig) -> None:
        rig.powered = False
        async with rig.stream.listen() as listener:
            sentence = f"{NAME} sent no valid sample for 0.3 s; check power and cable"
            with pytest.raises(LinkTimeoutError, match=sentence):
                await listener.next(0.3)

    in_virtual_time(scenario)


def test_silence_fails_listeners_after_a_second_and_the_device_is_brought_up_when_it_returns() -> (
    None
):
    async def scenario(rig: Rig) -> None:
        async with rig.stream.listen() as listener:
            await ticks(listener, 10)
            rig.powered = False
            began_s = now_s()
            with pytest.raises(LinkTimeoutError, match="silent for 1 s; check power and cable"):
                await listener.next(60.0)
            assert now_s() - began_s == pytest.approx(1.0)
            await asyncio.sleep(30.0)
            assert rig.brought_up_s == []
            rig.powered = True
            await listener.next(1.0)
            assert len(rig.brought_up_s) == rig.counters.reconnects == 1

    in_virtual_time(scenario)


def test_a_cable_pushed_back_within_the_grace_time_fails_nobody() -> None:
    async def scenario(rig: Rig) -> None:
        async with rig.stream.listen() as listener:
            await ticks(listener, 10)
            rig.link.unplug()
            asyncio.get_running_loop().call_later(4.0, rig.link.plug_in)
            block = await listener.next(60.0)
            assert block.time_s[0] == pytest.approx(4.1, abs=0.3)
            assert len(rig.brought_up_s) == rig.counters.reconnects == 1

    in_virtual_time(scenario)


def test_a_cable_left_out_fails_listeners_once_after_the_grace_time() -> None:
    async def scenario(rig: Rig) -> None:
        async with rig.stream.listen() as listener:
            rig.link.unplug()
            with pytest.raises(TransportError, match="sim:gyro is gone; check its cable"):
                await listener.next(60.0)
            assert now_s() == pytest.approx(5.0, abs=0.3)
            with pytest.raises(LinkTimeoutError):
                await listener.next(100.0)
            rig.link.plug_in()
            await listener.next(1.0)
            assert rig.counters.reconnects == 1

    in_virtual_time(scenario)


def test_a_port_that_is_back_without_its_device_fails_listeners_after_the_grace_time() -> None:
    async def scenario(rig: Rig) -> None:
        async with rig.stream.listen() as listener:
            await ticks(listener, 10)
            rig.powered = False
            rig.link.unplug()
            rig.link.plug_in()
            with pytest.raises(LinkTimeoutError, match="sim:gyro was silent"):
                await listener.next(60.0)
            assert now_s() == pytest.approx(5.1, abs=1.0)

    in_virtual_time(scenario)


def test_a_device_whose_power_and_then_cable_go_is_brought_up_when_both_are_back() -> None:
    async def scenario(rig: Rig) -> None:
        async with rig.stream.listen() as listener:
            rig.powered = False
            with pytest.raises(LinkTimeoutError):
                await listener.next(60.0)
            rig.link.unplug()
            await asyncio.sleep(2.0)
            rig.link.plug_in()
            rig.powered = True
            await listener.next(2.0)

    in_virtual_time(scenario)


def test_a_device_that_refuses_to_come_up_fails_listeners_at_once_and_may_recover() -> None:
    async def scenario(rig: Rig) -> None:
        refusal = DeviceFaultError("the gyro's built-in test fails; have it serviced", "7E")
        rig.refusals = [refusal] * 3
        async with rig.stream.listen() as listener:
            rig.link.unplug()
            rig.link.plug_in()
            with pytest.raises(DeviceFaultError, match="built-in test"):
                await listener.next(60.0)
            assert now_s() == pytest.approx(0.0, abs=0.3)
            await listener.next(60.0)
            assert rig.refusals == []

    in_virtual_time(scenario)


def test_bring_up_may_fail_thousands_of_times_before_it_succeeds() -> None:
    async def scenario(rig: Rig) -> None:
        rig.refusals = [LinkTimeoutError("no answer")] * 2000
        rig.link.unplug()
        rig.link.plug_in()
        await asyncio.sleep(2000 * 0.25)
        async with rig.stream.listen() as listener:
            with pytest.raises(LinkTimeoutError, match="no answer"):
                await listener.next(1.0)
            await listener.next(1.0)
        async with rig.stream.listen() as listener:
            await listener.next(1.0)  # and nobody is told any more

    in_virtual_time(scenario)


def test_what_comes_twice_is_told_once() -> None:
    """A converter that repeats a burst, a bus that sends a frame again."""

    async def scenario(rig: Rig) -> None:
        async with rig.stream.listen() as listener:
            assert await ticks(listener, 2) == [1, 2]
            rig.powered = False
            rig.link.deliver(bytes([3, 4, 2, 3, 4, 4, 5]))
            assert (await listener.next(1.0)).tick.tolist() == [3, 4, 5]
            rig.link.deliver(bytes([3, 5]))
            with pytest.raises(LinkTimeoutError):
                await listener.next(0.5)

    in_virtual_time(scenario)


def test_a_listener_that_stopped_reading_is_told_and_then_gets_the_present() -> None:
    async def scenario(rig: Rig) -> None:
        async with rig.stream.listen() as listener:
            await asyncio.sleep(4100.5 * PERIOD_S)
            sentence = f"a listener of {NAME} fell 4096 blocks behind and they were discarded"
            with pytest.raises(DriverError, match=sentence):
                await listener.next(1.0)
            block = await listener.next(1.0)
            assert now_s() - block.time_s[0] < 5 * PERIOD_S

    in_virtual_time(scenario)


def test_a_stopped_stream_leaves_the_link_open_and_no_task_behind() -> None:
    async def session() -> None:
        tasks = asyncio.all_tasks()
        async with streaming() as rig:
            await rig.stream.stop()
            assert len((await rig.link.read(1.0)).data) == 1
            await rig.stream.stop()
        await asyncio.sleep(0)
        assert asyncio.all_tasks() == tasks

    run_virtual(session())


def test_a_stream_stops_in_the_middle_of_a_reconnection() -> None:
    async def scenario(rig: Rig) -> None:
        rig.link.unplug()
        await asyncio.sleep(1.1)
        await rig.stream.stop()
        assert now_s() == pytest.approx(1.1)

    in_virtual_time(scenario)


def test_a_defect_that_ended_the_stream_shows_when_it_is_stopped() -> None:
    def defective(chunk: Chunk) -> SampleBlock | None:
        raise ZeroDivisionError(chunk.arrival_s)

    async def scenario(_: Rig) -> None:
        await asyncio.sleep(1.0)

    with pytest.raises(ZeroDivisionError, match=re.escape(str(PERIOD_S))):
        in_virtual_time(scenario, defective)
