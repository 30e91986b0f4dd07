"""The CiA 402 driver finds, homes, turns and stops a drive, and says plainly what goes wrong."""

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import pytest

from drivers.cia402 import Cia402
from drivers.codecs.canopen import NmtCommand, encode_nmt
from drivers.codecs.cia402 import CONTROLWORD, MODE, PROFILE_VELOCITY, TARGET_POSITION, Command
from drivers.codecs.sdo import Entry
from drivers.codecs.sdo_client import Transfer
from drivers.errors import DeviceFaultError, LinkTimeoutError, ProtocolError, TransportError
from drivers.indexing_table import LATE, NO_REFERENCE, SHORT, STOPPED
from drivers.interfaces import CanFrame, TableState
from drivers.links.can_port import CanPort
from drivers.links.memory_can import MemoryBus
from sim.clock import run_virtual
from sim.devices.cia402 import SimulatedCia402
from sim.motion import Plate

T = TypeVar("T")
MILLIDEGREE = math.radians(1e-3)
UNITS_PER_DEG = 10_000  # of the simulated drive's data sheet: 3 600 000 a turn


@dataclass
class Bench:
    """A drive on a bus in memory, and its driver."""

    plate: Plate
    device: SimulatedCia402
    bus: MemoryBus
    table: Cia402

    def tell(self, entry: Entry, number: int, size: int) -> None:
        """Write an object past the driver; the drive's answer goes nowhere."""
        request = Transfer(entry, (number % (1 << 8 * size)).to_bytes(size, "little")).begin()
        self.device.connect(lambda _: None)
        self.device.receive_frame(CanFrame(0x605, request))
        self.reconnect()

    def reconnect(self) -> None:
        self.device.connect(lambda frame: self.bus.put(frame, self.device.receive_frame))

    def turn_past_the_driver(self, position: int) -> None:
        """Leave the drive turning, as a program does that has crashed."""
        self.tell(MODE, 1, 1)
        for word in (Command.SHUT_DOWN, Command.SWITCH_ON, Command.ENABLE):
            self.tell(CONTROLWORD, word, 2)
        self.tell(TARGET_POSITION, position, 4)
        self.tell(CONTROLWORD, Command.START_AT_ONCE, 2)


@asynccontextmanager
async def bench(start_deg: float = 100.0) -> AsyncIterator[Bench]:
    plate = Plate(math.radians(start_deg), 1e-5, np.random.default_rng(3))
    device = SimulatedCia402(plate)
    bus = MemoryBus("sim:can")
    table = Cia402(CanPort(bus), 5)
    on = Bench(plate, device, bus, table)
    bus.attach(device.receive_frame)
    on.reconnect()
    running = asyncio.create_task(device.run())
    try:
        await table.open()
        yield on
    finally:
        await table.close()
        running.cancel()


def on_bench(use: Callable[[Bench], Awaitable[T]], start_deg: float = 100.0) -> T:
    async def run() -> T:
        async with bench(start_deg) as on:
            return await use(on)

    return run_virtual(run())


def fault_of(use: Callable[[Bench], Awaitable[object]]) -> tuple[str, str]:
    """Return code and message of the fault that the homed table raises."""

    async def run(on: Bench) -> tuple[str, str]:
        await on.table.home()
        with pytest.raises(DeviceFaultError) as raised:
            await use(on)
        return raised.value.code, str(raised.value)

    return on_bench(run)


def test_opening_reads_identity_and_limits_from_the_device() -> None:
    async def use(on: Bench) -> Cia402:
        return on.table

    table = on_bench(use)
    identity = table.identity
    assert (identity.vendor, identity.model) == ("CANopen vendor 0h", "Simulated CiA 402 drive")
    assert (identity.serial_number, identity.firmware) == ("4020017", "1.0")
    assert math.degrees(table.limits.speed_rad_s) == pytest.approx(60)
    assert math.degrees(table.limits.acceleration_rad_s2) == pytest.approx(120)
    assert table.link_name == "node 5 on sim:can"


@pytest.mark.parametrize("start_deg", [-170.0, 0.0, 0.3, 100.0, 359.0, 700.0])
def test_homing_finds_the_plates_mark_from_an_unknown_angle(start_deg: float) -> None:
    async def use(on: Bench) -> tuple[TableState, TableState, float]:
        before, after = await on.table.state(), await on.table.home()
        return before, after, on.plate.angle_at(1e6)

    before, after, plate_rad = on_bench(use, start_deg)
    assert before == TableState(0.0, moving=False, homed=False)
    assert after == TableState(0.0, moving=False, homed=True)
    assert math.remainder(plate_rad, 2 * math.pi) == pytest.approx(0, abs=5 * MILLIDEGREE)


def test_a_slow_move_takes_its_time_and_the_next_is_as_fast_as_ever() -> None:
    async def use(on: Bench) -> list[float]:
        loop, durations_s = asyncio.get_running_loop(), []
        await on.table.home()
        for target_deg, speed_deg_s in ((30.0, 6.0), (90.0, None)):
            start_s = loop.time()
            speed = None if speed_deg_s is None else math.radians(speed_deg_s)
            await on.table.move_to(math.radians(target_deg), speed)
            durations_s.append(loop.time() - start_s)
        return durations_s

    assert on_bench(use) == pytest.approx([30 / 6 + 6 / 120, 60 / 60 + 60 / 120], abs=0.1)


def test_a_slow_move_that_was_stopped_leaves_the_drive_as_fast_as_it_was() -> None:
    async def use(on: Bench) -> tuple[int, int]:
        await on.table.home()
        move = asyncio.create_task(on.table.move_to(3.0, math.radians(6.0)))
        await asyncio.sleep(2.0)
        during = await on.table._node.number(PROFILE_VELOCITY)
        await on.table.stop()
        with pytest.raises(DeviceFaultError):
            await move
        return during, await on.table._node.number(PROFILE_VELOCITY)

    assert on_bench(use) == (6 * UNITS_PER_DEG, 60 * UNITS_PER_DEG)


def test_a_table_that_was_homed_homes_again() -> None:
    async def use(on: Bench) -> list[TableState]:
        states = [await on.table.home()]
        await on.table.move_to(2.0)
        return [*states, await on.table.home(), await on.table.home()]

    assert on_bench(use) == [TableState(0.0, moving=False, homed=True)] * 3


def test_a_revolution_of_moves_arrives_at_every_angle() -> None:
    async def use(on: Bench) -> list[tuple[float, float, float]]:
        await on.table.home()
        angles_rad = [*np.radians(np.arange(0, 361, 45)), *np.radians(np.arange(315, -91, -45))]
        return [
            (target, (await on.table.move_to(target)).angle_rad, on.plate.angle_at(1e6))
            for target in angles_rad
        ]

    for target_rad, reported_rad, plate_rad in on_bench(use):
        assert reported_rad == pytest.approx(target_rad, abs=MILLIDEGREE)
        assert plate_rad == pytest.approx(target_rad, abs=5 * MILLIDEGREE)


def test_a_move_takes_the_profiles_time_and_no_more_than_a_poll() -> None:
    async def use(on: Bench) -> float:
        await on.table.home()
        start_s = asyncio.get_running_loop().time()
        await on.table.move_to(math.radians(90))
        return asyncio.get_running_loop().time() - start_s

    assert on_bench(use) == pytest.approx(90 / 60 + 60 / 120, abs=0.06)


def test_a_stop_during_a_move_ends_the_move_with_where_it_stands() -> None:
    async def use(on: Bench) -> None:
        move = asyncio.create_task(on.table.move_to(math.radians(180)))
        await asyncio.sleep(1.5)
        now_s = asyncio.get_running_loop().time()
        await on.table.stop()
        assert on.plate.end_s == pytest.approx(now_s + 60 / 720, abs=0.02)  # by 6085h
        assert not (await on.table.state()).moving
        await move

    code, message = fault_of(use)
    assert code == STOPPED
    # The ramp up takes 15 deg and 0.5 s, the quick stop 2.5 deg.
    assert message.startswith("The table was stopped at 77")
    assert message.endswith("deg during the move to 180 deg.")


def delay_answers(on: Bench, delay_s: float) -> None:
    """Let the drive answer only after a while, as real ones do."""
    loop = asyncio.get_running_loop()

    def later(frame: CanFrame) -> None:
        loop.call_later(delay_s, on.bus.put, frame, on.device.receive_frame)

    on.device.connect(later)


@pytest.mark.parametrize("stopped_s", np.arange(0.0005, 0.06, 0.001))
def test_a_stop_while_a_move_is_being_begun_gives_it_up_and_says_so(stopped_s: float) -> None:
    async def use(on: Bench) -> None:
        delay_answers(on, 0.003)
        loop = asyncio.get_running_loop()
        move = asyncio.create_task(on.table.move_to(1.0))
        await asyncio.sleep(stopped_s)
        start_s = loop.time()
        await on.table.stop()
        try:
            await move
        finally:
            assert loop.time() - start_s < 1.0
            assert loop.time() > on.plate.end_s

    assert fault_of(use)[0] == STOPPED


@pytest.mark.parametrize("stopped_s", [*np.arange(0.0005, 0.04, 0.001), 1.0])
def test_a_stop_during_homing_is_told_even_if_the_old_reference_still_holds(
    stopped_s: float,
) -> None:
    async def use(on: Bench) -> None:
        await on.table.move_to(2.0)
        delay_answers(on, 0.003)
        homing = asyncio.create_task(on.table.home())
        await asyncio.sleep(stopped_s)
        await on.table.stop()
        await homing

    code, message = fault_of(use)
    assert code == STOPPED
    assert "homing" in message


def test_an_obstacle_stalls_the_table_and_once_removed_the_move_succeeds() -> None:
    async def use(on: Bench) -> None:
        on.plate.block_at(math.radians(50))
        try:
            await on.table.move_to(math.radians(135))
        finally:
            on.plate.block_at(None)
            state = await on.table.move_to(math.radians(135))
            assert state.angle_rad == pytest.approx(math.radians(135), abs=MILLIDEGREE)

    code, message = fault_of(use)
    assert code == "8611h"
    assert message == (
        "The table reports 8611h (following error), at 50 deg."
        " Check for an obstruction and its power, then resume."
    )


def test_homing_that_an_obstacle_ends_fails_and_leaves_no_reference() -> None:
    async def use(on: Bench) -> None:
        await on.table.move_to(2.0)
        watching = asyncio.create_task(watch(on.table, []))
        on.plate.block_at(math.radians(30))
        try:
            await on.table.home()
        finally:
            watching.cancel()
            assert not (await on.table.state()).homed

    assert fault_of(use)[0] == "8611h"


@pytest.mark.parametrize(
    ("short_deg", "side"), [(0.31, "0.31 deg short of"), (-0.025, "0.03 deg beyond")]
)
def test_a_table_that_misses_says_by_how_much(short_deg: float, side: str) -> None:
    async def use(on: Bench) -> None:
        on.plate.fall_short_by(math.radians(short_deg))
        await on.table.move_to(math.radians(135))

    code, message = fault_of(use)
    assert code == SHORT
    if short_deg > 0:
        assert message == (
            f"The table stopped {side} 135 deg. Check for an obstruction, then resume."
        )


def test_a_move_without_a_reference_is_refused() -> None:
    async def use(on: Bench) -> None:
        with pytest.raises(DeviceFaultError, match="Home it, then resume") as raised:
            await on.table.move_to(1.0)
        assert raised.value.code == NO_REFERENCE

    on_bench(use)


def test_a_drive_that_restarts_during_a_move_is_told_at_once() -> None:
    async def use(on: Bench) -> None:
        await on.table.home()
        loop = asyncio.get_running_loop()
        loop.call_later(0.7, on.device.lose_reference)
        start_s = loop.time()
        with pytest.raises(TransportError, match="node 5 on sim:can has restarted"):
            await on.table.move_to(2.0)
        assert loop.time() - start_s < 0.8
        with pytest.raises(TransportError, match="has restarted"):
            await on.table.observe()

    on_bench(use)


def test_after_a_restart_the_table_is_opened_and_homed_anew() -> None:
    async def use(on: Bench) -> TableState:
        await on.table.home()
        await on.table.move_to(1.0)
        on.device.lose_reference()
        await on.table.open()
        assert await on.table.state() == TableState(0.0, moving=False, homed=False)
        await on.table.home()
        return await on.table.move_to(1.0)

    assert on_bench(use).angle_rad == pytest.approx(1.0, abs=MILLIDEGREE)


def test_a_table_that_turns_too_slowly_is_stopped_and_the_delay_told() -> None:
    async def use(on: Bench) -> None:
        on.tell(Entry(0x6081), UNITS_PER_DEG, 4)
        try:
            await on.table.move_to(2.0)
        finally:
            assert not (await on.table.state()).moving

    assert fault_of(use)[0] == LATE


def test_opening_stops_a_table_that_a_crashed_program_left_turning() -> None:
    async def use(on: Bench) -> TableState:
        on.turn_past_the_driver(2_000 * UNITS_PER_DEG)
        await asyncio.sleep(1.0)
        assert asyncio.get_running_loop().time() < on.plate.end_s
        await on.table.open()
        return await on.table.state()

    assert not on_bench(use).moving


def test_closing_stops_the_table_and_leaves_mode_and_heartbeat_as_they_were() -> None:
    async def run() -> list[bytes]:
        heard: list[CanFrame] = []
        async with bench() as on:
            on.turn_past_the_driver(2_000 * UNITS_PER_DEG)
            await asyncio.sleep(1.0)
        assert asyncio.get_running_loop().time() >= on.plate.end_s
        on.device.connect(heard.append)
        for entry in (Entry(0x6060), Entry(0x1017), Entry(0x6041)):
            on.device.receive_frame(CanFrame(0x605, Transfer(entry).begin()))
        return [frame.data[4:6] for frame in heard]

    # No mode, no heartbeat, and the power stage off: it is neither switched on nor enabled.
    mode, heartbeat, status = run_virtual(run())
    assert (mode[:1], heartbeat) == (b"\0", b"\0\0")
    assert status[0] & 0b110 == 0


def test_a_drive_that_falls_silent_fails_within_a_second() -> None:
    async def use(on: Bench) -> float:
        on.device.connect(lambda _: None)
        start_s = asyncio.get_running_loop().time()
        with pytest.raises(LinkTimeoutError, match="node 5 on sim:can"):
            await on.table.state()
        return asyncio.get_running_loop().time() - start_s

    assert on_bench(use) < 1.0


def test_a_drive_whose_heartbeat_stops_is_told_to_hang() -> None:
    async def use(on: Bench) -> None:
        on.device.pause_heartbeat = True
        with pytest.raises(LinkTimeoutError, match="its firmware hangs"):
            await watch(on.table, [])

    on_bench(use)


def test_a_bus_that_fails_is_told_and_the_table_can_be_opened_again() -> None:
    async def use(on: Bench) -> None:
        await on.table.home()
        asyncio.get_running_loop().call_later(0.4, on.bus.fail, "is bus-off")
        with pytest.raises(TransportError, match="bus-off"):
            await on.table.move_to(3.0)
        on.bus.mend()
        await on.table.open()
        await on.table.home()

    on_bench(use)


def test_a_node_of_another_profile_is_refused() -> None:
    async def use(on: Bench) -> None:
        on.device._objects.set_number(Entry(0x1000), 0x0004_019A)
        with pytest.raises(ProtocolError, match="is no drive"):
            await on.table.open()

    on_bench(use)


async def watch(table: Cia402, observed: list[TableState]) -> None:
    while True:
        observed.append(await table.observe())
        await asyncio.sleep(0.01)


def test_observing_reports_a_fault_and_leaves_it_to_the_move_that_it_befell() -> None:
    observed: list[TableState] = []

    async def use(on: Bench) -> None:
        on.plate.block_at(math.radians(50))
        watching = asyncio.create_task(watch(on.table, observed))
        try:
            await on.table.move_to(math.radians(135))
        finally:
            watching.cancel()
            assert (await on.table.observe()).fault is None  # the move has acknowledged it

    code, message = fault_of(use)
    assert code == "8611h"
    under_way = [state for state in observed if state.moving]
    assert [state.fault for state in under_way] == [None] * len(under_way)
    assert np.all(np.diff([state.angle_rad for state in under_way]) >= 0)
    assert message in {state.fault for state in observed}
    assert all(state.homed for state in observed)


def test_a_drive_that_another_program_stops_in_the_network_is_told() -> None:
    async def use(on: Bench) -> None:
        on.device.receive_frame(encode_nmt(NmtCommand.STOP, 0))
        with pytest.raises(LinkTimeoutError, match="did not answer"):
            await on.table.state()

    on_bench(use)


def test_a_drive_that_cannot_be_trusted_is_told_to_stop_all_the_same() -> None:
    """A second device answers under its number: the driver gives it up, and must not let it run."""

    async def use(on: Bench) -> tuple[float, float]:
        await on.table.home()
        moving = asyncio.create_task(on.table.move_to(math.radians(300)))
        await asyncio.sleep(1.0)
        stray = CanFrame(0x585, bytes.fromhex("4B 41 60 00 37 02 00 00"))
        on.bus.put(stray, on.device.receive_frame)
        with pytest.raises(ProtocolError, match="Two devices answer"):
            await moving
        with pytest.raises(ProtocolError, match="Two devices answer"):
            await on.table.stop()
        stopped_s = asyncio.get_running_loop().time()
        await asyncio.sleep(5.0)
        return on.plate.end_s - stopped_s, math.degrees(on.plate.angle_at(on.plate.end_s))

    stood_after_s, angle_deg = on_bench(use)
    assert stood_after_s < 1.0
    assert 10.0 < angle_deg % 360.0 < 290.0
