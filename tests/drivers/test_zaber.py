"""The Zaber driver finds, homes, turns and stops the stage, and says plainly what goes wrong."""

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import pytest

from drivers.errors import DeviceFaultError, LinkTimeoutError, TransportError
from drivers.indexing_table import LATE, NO_REFERENCE, SHORT, STOPPED
from drivers.interfaces import TableState
from drivers.zaber import Zaber
from sim.clock import run_virtual
from sim.devices.zaber import SimulatedZaber
from sim.faults import FaultyWire
from sim.motion import Plate

T = TypeVar("T")
MILLIDEGREE = math.radians(1e-3)


@dataclass
class Bench:
    """A stage on a faulty wire, and its driver."""

    plate: Plate
    device: SimulatedZaber
    wire: FaultyWire
    table: Zaber


@asynccontextmanager
async def bench(start_deg: float = 100.0) -> AsyncIterator[Bench]:
    plate = Plate(math.radians(start_deg), 1e-5, np.random.default_rng(3))
    device = SimulatedZaber(plate)
    wire = FaultyWire("sim:turntable", device, np.random.default_rng(4))
    running = asyncio.create_task(device.run())
    table = Zaber(wire.link)
    try:
        yield Bench(plate, device, wire, await table.open())
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
    async def use(on: Bench) -> Zaber:
        return on.table

    table = on_bench(use)
    identity = table.identity
    assert (identity.vendor, identity.model) == ("Zaber", "device 50952")
    assert (identity.serial_number, identity.firmware) == ("77261", "7.30")
    assert math.degrees(table.limits.speed_rad_s) == pytest.approx(120, rel=1e-6)
    assert math.degrees(table.limits.acceleration_rad_s2) == pytest.approx(360, rel=2e-3)
    assert table.link_name == "sim:turntable"


@pytest.mark.parametrize("start_deg", [-170.0, 0.0, 100.0, 359.0, 700.0])
def test_homing_finds_the_plates_mark_from_an_unknown_angle(start_deg: float) -> None:
    async def use(on: Bench) -> tuple[TableState, TableState, float]:
        before, after = await on.table.state(), await on.table.home()
        return before, after, on.plate.angle_at(1e6)

    before, after, plate_rad = on_bench(use, start_deg)
    assert before == TableState(0.0, moving=False, homed=False)
    assert after == TableState(0.0, moving=False, homed=True)
    assert math.remainder(plate_rad, 2 * math.pi) == pytest.approx(0, abs=5 * MILLIDEGREE)


def test_a_revolution_of_moves_arrives_at_every_angle() -> None:
    async def use(on: Bench) -> list[tuple[float, float, float]]:
        await on.table.home()
        angles_rad = [*np.radians(np.arange(0, 361, 45)), *np.radians(np.arange(315, -1, -45))]
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

    assert on_bench(use) == pytest.approx(90 / 120 + 120 / 360, abs=0.06)


def test_a_slow_move_takes_its_time_and_the_next_is_as_fast_as_ever() -> None:
    async def use(on: Bench) -> tuple[list[float], int, int]:
        loop, durations_s = asyncio.get_running_loop(), []
        await on.table.home()
        maxspeed = (await on.table._dialogue.number("get maxspeed"))[1]
        for target_deg, speed_deg_s in ((30.0, 6.0), (120.0, None)):
            start_s = loop.time()
            speed = None if speed_deg_s is None else math.radians(speed_deg_s)
            await on.table.move_to(math.radians(target_deg), speed)
            durations_s.append(loop.time() - start_s)
        return durations_s, maxspeed, (await on.table._dialogue.number("get maxspeed"))[1]

    durations_s, before, after = on_bench(use)
    assert durations_s == pytest.approx([30 / 6 + 6 / 360, 90 / 120 + 120 / 360], abs=0.06)
    assert before == after, "the stage would keep a slow speed for good"


@pytest.mark.parametrize("speed_deg_s", [0.0, -1.0, 121.0, math.nan])
def test_a_speed_that_the_table_does_not_have_is_refused(speed_deg_s: float) -> None:
    async def use(on: Bench) -> None:
        await on.table.home()
        await on.table.move_to(1.0, math.radians(speed_deg_s))

    with pytest.raises(ValueError, match=r"rad/s is not above 0 and at most the table's 2\.09"):
        on_bench(use)


def test_firmware_without_a_speed_in_its_commands_says_so() -> None:
    async def use(on: Bench) -> None:
        on.device._identity["version"] = "7.24"
        await on.table.close()
        await on.table.open()
        await on.table.move_to(1.0, 0.1)

    code, message = fault_of(use)
    assert code == "FIRMWARE"
    assert "has firmware 7.24, and turning at a given speed takes 7.25 or newer" in message


def test_a_stop_during_a_move_ends_the_move_with_where_it_stands() -> None:
    async def use(on: Bench) -> None:
        move = asyncio.create_task(on.table.move_to(math.radians(180)))
        await asyncio.sleep(0.72)
        await on.table.stop()
        assert not (await on.table.state()).moving
        await move

    code, message = fault_of(use)
    assert code == STOPPED
    assert message.startswith("The table was stopped at 86")
    assert message.endswith("deg during the move to 180 deg.")


def test_a_stop_before_the_command_is_sent_keeps_the_table_still() -> None:
    async def use(on: Bench) -> None:
        on.wire.faults.delay_s = 0.01
        angle_rad = on.plate.angle_at(1e6)
        move = asyncio.create_task(on.table.move_to(1.0))
        await asyncio.sleep(0.005)
        try:
            await on.table.stop()
            await move
        finally:
            assert on.plate.angle_at(1e6) == angle_rad

    code, message = fault_of(use)
    assert code == STOPPED
    assert message == "The table was told to stop, so the move to 57.3 deg was given up."


def test_a_move_whose_reply_was_lost_is_not_repeated_once_a_stop_was_asked_for() -> None:
    async def use(on: Bench) -> None:
        on.wire.faults.delay_s = 0.01
        move = asyncio.create_task(on.table.move_to(1.0))
        await asyncio.sleep(0.005)
        on.wire.faults.drop_per_byte = 1.0
        await asyncio.sleep(0.1)
        assert on.plate.angle_at(asyncio.get_running_loop().time()) > 0.01
        on.wire.faults.drop_per_byte = 0.0
        await on.table.stop()
        try:
            await move
        finally:
            assert not (await on.table.state()).moving

    assert fault_of(use) == (
        STOPPED,
        "The table was told to stop, so the move to 57.3 deg was given up.",
    )


def test_a_stop_during_homing_is_told_even_if_the_old_reference_still_holds() -> None:
    async def use(on: Bench) -> None:
        await on.table.move_to(2.0)
        homing = asyncio.create_task(on.table.home())
        await asyncio.sleep(0.5)
        await on.table.stop()
        await homing

    code, message = fault_of(use)
    assert code == STOPPED
    assert message.endswith("during homing.")


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
    assert code == "FS"
    assert message == (
        "The table reports FS, stalled and stopped, at 50 deg."
        " Check for an obstruction and its power, then resume."
    )


@pytest.mark.parametrize(
    ("short_deg", "side"), [(0.31, "0.31 deg short of"), (-0.03, "0.03 deg beyond")]
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


@pytest.mark.parametrize("delay_s", [0.0, 0.3])
def test_a_lost_reference_is_told_before_and_during_a_move(delay_s: float) -> None:
    async def use(on: Bench) -> None:
        loop = asyncio.get_running_loop()
        if delay_s:
            loop.call_later(delay_s, on.device.lose_reference)
        else:
            on.device.lose_reference()
        await on.table.move_to(2.0)

    code, message = fault_of(use)
    assert code == NO_REFERENCE
    assert message.endswith("Home it, then resume.")


def test_a_table_that_turns_too_slowly_is_stopped_and_the_delay_told() -> None:
    async def use(on: Bench) -> None:
        on.device.receive_data(b"/1 1 set maxspeed 5000\n")
        try:
            await on.table.move_to(2.0)
        finally:
            assert not (await on.table.state()).moving

    assert fault_of(use)[0] == LATE


def test_opening_stops_a_table_that_a_crashed_program_left_turning() -> None:
    async def use(on: Bench) -> TableState:
        on.device.receive_data(b"/1 1 move vel 300000\n")
        await asyncio.sleep(1.0)
        await on.table.open()
        return await on.table.state()

    assert not on_bench(use).moving


def test_closing_stops_the_table_and_leaves_the_checksum_setting_as_it_was() -> None:
    async def run() -> list[bytes]:
        heard: list[bytes] = []
        async with bench() as on:
            on.device.receive_data(b"/1 1 move vel 300000\n")
        on.device.connect(heard.append)
        on.device.receive_data(b"/1 get comm.checksum\n/1\n")
        return heard

    assert run_virtual(run()) == [b"@01 0 OK IDLE WR 0\r\n", b"@01 0 OK IDLE WR 0\r\n"]


def test_damaged_replies_are_asked_for_again() -> None:
    async def use(on: Bench) -> int:
        await on.table.home()
        on.wire.faults.corrupt_per_byte = 0.005
        for target_deg in range(0, 180, 15):
            state = await on.table.move_to(math.radians(target_deg))
            assert state.angle_rad == pytest.approx(math.radians(target_deg), abs=MILLIDEGREE)
        return on.table.counters.crc_errors + on.table.counters.lost

    assert on_bench(use) > 10


def test_a_table_that_falls_silent_fails_within_a_second() -> None:
    async def use(on: Bench) -> float:
        on.wire.faults.silent = True
        start_s = asyncio.get_running_loop().time()
        with pytest.raises(LinkTimeoutError, match=r"sim:turntable did not answer 'get pos'"):
            await on.table.state()
        return asyncio.get_running_loop().time() - start_s

    assert on_bench(use) < 1.0


def test_a_cut_link_says_that_the_table_may_still_turn() -> None:
    async def use(on: Bench) -> None:
        await on.table.home()
        asyncio.get_running_loop().call_later(0.4, on.wire.link.unplug)
        with pytest.raises(TransportError, match="may still be turning"):
            await on.table.move_to(3.0)

    on_bench(use)


def test_stopping_a_table_that_does_not_slow_down_says_to_cut_its_power() -> None:
    async def use(on: Bench) -> None:
        on.device.receive_data(b"/1 1 set accel 1\n/1 1 move vel 800000\n")
        await asyncio.sleep(30.0)
        with pytest.raises(LinkTimeoutError, match="Cut its power"):
            await on.table.stop()

    on_bench(use)


def test_observing_reports_a_fault_and_leaves_it_to_the_move_that_it_befell() -> None:
    observed: list[TableState] = []

    async def watch(table: Zaber) -> None:
        while True:
            observed.append(await table.observe())
            await asyncio.sleep(0.01)

    async def use(on: Bench) -> None:
        on.plate.block_at(math.radians(50))
        watching = asyncio.create_task(watch(on.table))
        try:
            await on.table.move_to(math.radians(135))
        finally:
            watching.cancel()
            assert (await on.table.observe()).fault is None  # the move has acknowledged it

    code, message = fault_of(use)
    assert code == "FS"
    under_way = [state for state in observed if state.moving]
    assert [state.fault for state in under_way] == [None] * len(under_way)
    assert np.all(np.diff([state.angle_rad for state in under_way]) >= 0)
    assert message in {state.fault for state in observed}
    assert all(state.homed for state in observed)


def test_observing_a_table_that_has_fallen_silent_fails_within_a_second() -> None:
    async def use(on: Bench) -> float:
        on.wire.faults.silent = True
        start_s = asyncio.get_running_loop().time()
        with pytest.raises(LinkTimeoutError, match="did not answer"):
            await on.table.observe()
        return asyncio.get_running_loop().time() - start_s

    assert on_bench(use) < 1.0


@pytest.mark.parametrize("waited_s", np.arange(0.4, 0.8, 0.037))
def test_a_stop_is_on_the_wire_at_once_even_while_lost_replies_are_waited_for(
    waited_s: float,
) -> None:
    async def use(on: Bench) -> None:
        move = asyncio.create_task(on.table.move_to(3.0))
        await asyncio.sleep(0.3)
        on.wire.faults.drop_per_byte = 1.0
        await asyncio.sleep(waited_s - 0.3)
        now_s = asyncio.get_running_loop().time()
        stop = asyncio.create_task(on.table.stop())
        await asyncio.sleep(0.001)
        ramp_s = on.table.limits.speed_rad_s / on.table.limits.acceleration_rad_s2
        assert on.plate.end_s == pytest.approx(now_s + ramp_s, abs=0.002)
        on.wire.faults.drop_per_byte = 0.0
        await stop
        await move

    assert fault_of(use)[0] == STOPPED
