"""The simulated drive's states, modes and ramps are those of CiA 402-2, in virtual time."""

import asyncio
import math

import pytest

from tests.sim.canopen_asking import Bus, on_bus

UNITS_PER_DEG = 10_000

#: Controlwords and the state bits after each (CiA 402-2, tables 28 and 30), from power-up on.
WALKS = {
    "2 3 4 11 12": [(0x06, 0x21), (0x07, 0x23), (0x0F, 0x27), (0x02, 0x40)],
    "2 3 4 5 6 7": [(0x06, 0x21), (0x07, 0x23), (0x0F, 0x27), (0x07, 0x23), (6, 0x21), (0, 0x40)],
    "8": [(0x06, 0x21), (0x0F, 0x27), (0x06, 0x21)],
    "9": [(0x06, 0x21), (0x0F, 0x27), (0x00, 0x40)],
    "10": [(0x06, 0x21), (0x07, 0x23), (0x02, 0x40)],
    "7 by a quick stop": [(0x06, 0x21), (0x02, 0x40)],
    "none": [(0x07, 0x40), (0x0F, 0x40), (0x80, 0x40), (0x02, 0x40)],
}


@pytest.mark.parametrize("walk", WALKS.values(), ids=WALKS)
def test_controlwords_make_the_transitions_of_the_profile(walk: list[tuple[int, int]]) -> None:
    async def use(bus: Bus) -> None:
        for word, bits in walk:
            status = bus.control(word)
            assert status & (0x4F if bits == 0x40 else 0x6F) == bits
            assert status & 0x0200  # remote

    on_bus(use)


async def enabled(bus: Bus, mode: int) -> None:
    assert bus.write(0x6060, 0, 1, mode) == 0
    assert bus.control(0x06, 0x07, 0x0F) & 0x6F == 0x27


def position_deg(bus: Bus) -> float:
    number = bus.read(0x6064)
    return (number - (1 << 32) * (number >> 31)) / UNITS_PER_DEG


@pytest.mark.parametrize(
    ("option", "stands_after_s", "state"),
    [(1, 0.5, 0x40), (2, 1 / 12, 0x40), (5, 0.5, 0x07), (6, 1 / 12, 0x07)],
)
def test_a_quick_stop_takes_the_ramp_of_605ah(
    option: int, stands_after_s: float, state: int
) -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 1)
        bus.write(0x605A, 0, 2, option)
        bus.write(0x607A, 0, 4, 180 * UNITS_PER_DEG)
        bus.control(0x1F)
        await asyncio.sleep(1.0)
        assert bus.control(0x02) & 0x6F == 0x07
        await asyncio.sleep(stands_after_s - 0.01)
        assert bus.status() & 0x6F == 0x07
        assert bus.read(0x606C) > 0
        await asyncio.sleep(0.02)
        assert bus.status() & (0x4F if state == 0x40 else 0x6F) == state
        assert bus.read(0x606C) == 0
        # 45 deg after a second; the ramp's length is v^2/2a = v t/2.
        assert position_deg(bus) == pytest.approx(45 + 60 * stands_after_s / 2, abs=0.1)

    on_bus(use)


def test_a_disabled_motor_coasts_and_does_not_arrive() -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 1)
        bus.write(0x607A, 0, 4, 180 * UNITS_PER_DEG)
        bus.control(0x1F)
        await asyncio.sleep(1.0)
        bus.control(0x06)
        assert bus.read(0x606C) > 0
        await asyncio.sleep(5.0)
        assert bus.read(0x606C) == 0
        assert 45 < position_deg(bus) < 60

    on_bus(use)


def test_the_set_point_handshake() -> None:
    """CiA 402-2, 9.2.2: bit 12 answers bit 4; a second set-point waits, a third finds no room."""

    async def use(bus: Bus) -> None:
        await enabled(bus, 1)
        assert bus.status() & 0x1400 == 0x0400  # it is where it shall be
        bus.write(0x607A, 0, 4, 30 * UNITS_PER_DEG)
        assert bus.control(0x1F) & 0x1400 == 0x1000
        assert bus.control(0x0F) & 0x1400 == 0x0000
        bus.write(0x607A, 0, 4, 10 * UNITS_PER_DEG)
        assert bus.control(0x1F, 0x0F) & 0x1400 == 0x1000  # it waits: no room
        bus.write(0x607A, 0, 4, 99 * UNITS_PER_DEG)
        assert bus.control(0x1F, 0x0F) & 0x1400 == 0x1000
        await asyncio.sleep(1.1)  # 30 deg take 1 s
        assert bus.status() & 0x1400 == 0x0000
        assert position_deg(bus) < 30
        await asyncio.sleep(2.0)
        assert bus.status() & 0x1400 == 0x0400
        assert position_deg(bus) == 10
        bus.write(0x607A, 0, 4, -4 * UNITS_PER_DEG)
        bus.control(0x5F, 0x0F)  # relative
        await asyncio.sleep(2.0)
        assert position_deg(bus) == 6

    on_bus(use)


def test_a_set_point_in_place_of_the_present_one() -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 1)
        for target_deg, pause_s in ((90, 0.5), (-10, 5.0)):
            bus.write(0x607A, 0, 4, target_deg * UNITS_PER_DEG)
            assert bus.control(0x3F) & 0x1400 == 0x1000
            bus.control(0x0F)
            await asyncio.sleep(pause_s)
        assert position_deg(bus) == -10

    on_bus(use)


def test_a_halt_interrupts_a_move_until_it_is_taken_back() -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 1)
        bus.write(0x607A, 0, 4, 90 * UNITS_PER_DEG)
        bus.control(0x1F)
        await asyncio.sleep(0.5)
        assert bus.control(0x11F) & 0x0400 == 0
        await asyncio.sleep(1.0)
        assert bus.status() & 0x0400  # halted, and it stands
        assert position_deg(bus) == pytest.approx(30, abs=0.1)
        assert bus.control(0x0F) & 0x0400 == 0
        await asyncio.sleep(3.0)
        assert bus.status() & 0x0400
        assert position_deg(bus) == 90

    on_bus(use)


def test_a_target_beyond_the_software_limits_is_cut_and_told() -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 1)
        bus.write(0x607D, 2, 4, 8 * UNITS_PER_DEG)
        bus.write(0x607A, 0, 4, 30 * UNITS_PER_DEG)
        bus.control(0x1F)
        await asyncio.sleep(3.0)
        assert bus.status() & 0x0C00 == 0x0C00  # limit active, reached
        assert position_deg(bus) == 8

    on_bus(use)


@pytest.mark.parametrize(("method", "turned_deg"), [(33, -10.0), (34, 350.0), (35, 0.0), (37, 0.0)])
def test_homing_methods_turn_as_the_profile_says(method: int, turned_deg: float) -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 6)
        bus.write(0x6098, 0, 1, method)
        assert bus.status() & 0x3400 == 0x0400  # not started
        begun = bus.control(0x1F) & 0x3400
        assert begun == (0x0000 if turned_deg else 0x1400)
        await asyncio.sleep(20.0)
        assert bus.status() & 0x3400 == 0x1400
        assert position_deg(bus) == 0
        assert math.degrees(bus.plate.angle_at(20.0)) == pytest.approx(10 + turned_deg, abs=1e-6)

    on_bus(use)


def test_homing_that_is_interrupted_says_so() -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 6)
        bus.control(0x1F)
        await asyncio.sleep(0.2)
        assert bus.control(0x0F) & 0x3400 == 0x0000
        await asyncio.sleep(1.0)
        assert bus.status() & 0x3400 == 0x0400

    on_bus(use)


def test_a_stall_becomes_a_fault_in_time_and_bit_7_resets_it_by_its_edge() -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 1)
        bus.plate.block_at(math.radians(25))  # 15 deg from here: after 0.5 s
        bus.write(0x607A, 0, 4, 90 * UNITS_PER_DEG)
        bus.control(0x1F)
        await asyncio.sleep(2.0)
        ((time_s, emergency),) = bus.frames(0x085)
        assert emergency == bytes.fromhex("1186 21 0000000000")  # 8611h
        assert time_s == pytest.approx(0.5, abs=0.03)
        assert bus.status() & 0x204F == 0x2008
        assert bus.read(0x603F) == 0x8611
        assert bus.read(0x1001) == 0x21
        assert bus.control(0x0F) & 0x4F == 0x08
        assert bus.control(0x80) & 0x4F == 0x40
        assert bus.frames(0x085)[-1][1] == bytes(8)
        assert bus.read(0x603F) == 0
        bus.device.trip(0x2310)
        assert bus.control(0x80) & 0x4F == 0x08  # bit 7 was set all the time
        assert bus.control(0x00, 0x80) & 0x4F == 0x40

    on_bus(use)


def test_a_fault_in_mid_move_stops_the_plate_before_it_is_final() -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 1)
        bus.write(0x607A, 0, 4, 90 * UNITS_PER_DEG)
        bus.control(0x1F)
        await asyncio.sleep(1.0)
        bus.device.trip(0x2310)
        assert bus.status() & 0x4F == 0x0F
        await asyncio.sleep(0.1)
        assert bus.status() & 0x4F == 0x08
        assert position_deg(bus) == pytest.approx(47.5, abs=0.1)

    on_bus(use)


def test_after_a_dip_of_the_supply_the_counter_begins_where_the_plate_stands() -> None:
    async def use(bus: Bus) -> None:
        await enabled(bus, 6)
        bus.control(0x1F)
        await asyncio.sleep(5.0)
        await enabled(bus, 1)
        bus.write(0x607A, 0, 4, 40 * UNITS_PER_DEG)
        bus.control(0x1F)
        await asyncio.sleep(5.0)
        assert position_deg(bus) == 40
        bus.device.lose_reference()
        assert position_deg(bus) == 0
        assert bus.frames(0x705) == [(0.0, b"\0"), (10.0, b"\0")]
        assert bus.status() & 0x4F == 0x40
        bus.write(0x6060, 0, 1, 6)
        assert bus.status() & 0x1000 == 0

    on_bus(use)
