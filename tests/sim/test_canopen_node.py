"""A simulated CANopen node answers as CiA 301 says, frame by frame."""

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces import CanFrame
from sim.clock import run_virtual
from tests.sim.canopen_asking import Bus, on_bus

START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 0x80, 0x81, 0x82
UNITS_PER_DEG = 10_000


def test_it_boots_up_into_pre_operational_and_sends_nothing_more() -> None:
    async def use(bus: Bus) -> None:
        await asyncio.sleep(5.0)
        bus.nmt(START)
        del bus.heard[3:]  # what goes by event is sent once
        await asyncio.sleep(5.0)
        assert [frame.can_id for _, frame in bus.heard] == [0x705, 0x185, 0x285]
        assert bus.frames(0x705) == [(0.0, b"\0")]

    on_bus(use)


@pytest.mark.parametrize(
    ("commands", "state"),
    [
        ([], 0x7F),
        ([START], 0x05),
        ([STOP], 0x04),
        ([START, PRE_OPERATIONAL], 0x7F),
        ([STOP, START], 0x05),
    ],
)
def test_its_heartbeat_tells_the_state_that_it_was_told(commands: list[int], state: int) -> None:
    async def use(bus: Bus) -> None:
        assert bus.write(0x1017, 0, 2, 100) == 0
        for command in commands:
            bus.nmt(command)
        await asyncio.sleep(0.15)
        time_s, data = bus.frames(0x705)[-1]
        assert time_s == pytest.approx(0.1)
        assert data == bytes((state,))

    on_bus(use)


def test_a_changed_heartbeat_time_takes_effect_at_once() -> None:
    async def use(bus: Bus) -> None:
        bus.write(0x1017, 0, 2, 10_000)
        await asyncio.sleep(0.5)
        bus.write(0x1017, 0, 2, 100)
        await asyncio.sleep(0.35)
        bus.device.pause_heartbeat = True
        await asyncio.sleep(1.0)
        bus.device.pause_heartbeat = False
        bus.write(0x1017, 0, 2, 0)
        await asyncio.sleep(1.0)
        _, *beats = bus.frames(0x705)
        assert [time_s for time_s, _ in beats] == pytest.approx([0.6, 0.7, 0.8])

    on_bus(use)


def test_a_stopped_node_answers_nothing_and_others_commands_are_not_its_own() -> None:
    async def use(bus: Bus) -> None:
        bus.nmt(STOP, 6)
        assert bus.read(0x1000) & 0xFFFF == 402
        bus.nmt(STOP, 0)
        assert bus.send(0x605, bytes.fromhex("4000100000000000")) == []
        bus.nmt(PRE_OPERATIONAL)
        assert bus.read(0x1000) & 0xFFFF == 402

    on_bus(use)


@pytest.mark.parametrize(
    ("command", "speed", "heartbeat"),
    [(RESET_NODE, 600_000, 0), (RESET_COMMUNICATION, 100_000, 0), (STOP, 100_000, 2_000)],
)
def test_resets_put_defaults_back_and_boot_up_again(
    command: int, speed: int, heartbeat: int
) -> None:
    async def use(bus: Bus) -> None:
        bus.write(0x6081, 0, 4, 100_000)
        bus.write(0x1017, 0, 2, 2_000)
        bus.nmt(command)
        assert len(bus.frames(0x705)) == (1 if command == STOP else 2)
        bus.nmt(PRE_OPERATIONAL)
        assert (bus.read(0x6081), bus.read(0x1017)) == (speed, heartbeat)

    on_bus(use)


@pytest.mark.parametrize(
    ("index", "sub_index", "size", "value", "code"),
    [
        (0x2000, 0, 1, 0, 0x0602_0000),  # no such object
        (0x1018, 9, 4, 0, 0x0609_0011),  # no such sub-index
        (0x6041, 0, 2, 0, 0x0601_0002),  # read only
        (0x1008, 0, 4, 0, 0x0601_0002),
        (0x6040, 0, 4, 0, 0x0607_0012),  # too long
        (0x6040, 0, 1, 0, 0x0607_0013),  # too short
        (0x6081, 0, 4, 0, 0x0609_0032),  # below its LowLimit
        (0x6081, 0, 4, 10_000_000, 0x0609_0031),  # above its HighLimit
        (0x6060, 0, 1, 3, 0x0609_0030),  # a mode that 6502h does not have
        (0x1003, 0, 1, 1, 0x0609_0030),  # only 0 clears the errors (7.5.2.6)
        (0x1005, 0, 4, 0x4000_0080, 0x0609_0030),  # it does not produce SYNC
    ],
)
def test_what_may_not_be_written_is_refused_with_its_code(
    index: int, sub_index: int, size: int, value: int, code: int
) -> None:
    async def use(bus: Bus) -> None:
        assert bus.write(index, sub_index, size, value) == code

    on_bus(use)


def test_pdo_parameters_change_only_in_the_prescribed_order() -> None:
    """CiA 301, 7.5.2.36 and .38: invalid, count 0, entries, count, valid."""

    async def use(bus: Bus) -> None:
        velocity, text = 0x606C_0020, 0x1008_0020
        assert bus.write(0x1A00, 0, 1, 0) == 0x0601_0000  # still valid
        assert bus.write(0x1800, 1, 4, 0x186) == 0x0609_0030
        assert bus.write(0x1800, 1, 4, 0xC000_0185) == 0
        assert bus.write(0x1A00, 1, 4, velocity) == 0x0601_0000  # its count is not 0
        assert bus.write(0x1A00, 0, 1, 0) == 0
        assert bus.write(0x1A00, 1, 4, text) == 0x0604_0041
        assert bus.write(0x1A00, 1, 4, 0x6085_0020) == 0x0604_0041  # not mappable
        assert bus.write(0x1A00, 1, 4, 0x606C_0010) == 0x0604_0041  # not its length
        assert bus.write(0x1A00, 1, 4, 0x2000_0010) == 0x0602_0000
        for sub_index in (1, 2, 3):
            assert bus.write(0x1A00, sub_index, 4, velocity) == 0
        assert bus.write(0x1A00, 0, 1, 3) == 0x0604_0042  # 96 bits
        assert bus.write(0x1A00, 0, 1, 2) == 0
        assert bus.write(0x1800, 2, 1, 241) == 0x0609_0030  # reserved
        assert bus.write(0x1800, 2, 1, 1) == 0
        assert bus.write(0x1800, 1, 4, 0x601) == 0x0609_0030  # an SDO's identifier
        assert bus.write(0x1800, 1, 4, 0x4000_0197) == 0
        bus.nmt(START)
        assert bus.send(0x080) == [CanFrame(0x197, bytes(8))]

    on_bus(use)


def test_every_third_sync_and_only_while_operational() -> None:
    async def use(bus: Bus) -> None:
        bus.write(0x1800, 2, 1, 3)
        bus.send(0x080)
        bus.nmt(START)
        sent = [len(bus.send(0x080)) for _ in range(7)]
        assert sent == [0, 0, 1, 0, 0, 1, 0]
        bus.nmt(PRE_OPERATIONAL)
        assert [len(bus.send(0x080)) for _ in range(4)] == [0] * 4

    on_bus(use)


def test_an_event_timer_takes_effect_at_once_and_a_change_is_sent_without_it() -> None:
    async def use(bus: Bus) -> None:
        bus.nmt(START)
        bus.write(0x1801, 5, 2, 5_000)
        await asyncio.sleep(0.1)
        bus.write(0x1801, 5, 2, 20)
        await asyncio.sleep(0.05)
        assert [t for t, _ in bus.frames(0x285)] == pytest.approx([0.0, 0.12, 0.14])
        bus.write(0x1801, 5, 2, 0)
        assert [frame.can_id for frame in bus.send(0x205, bytes.fromhex("060000"))] == [
            0x185,
            0x285,
        ]  # READY TO SWITCH ON
        assert bus.frames(0x185)[-1][1] == bytes.fromhex("310200")

    on_bus(use)


def test_a_controlword_finds_the_target_that_came_with_it() -> None:
    async def use(bus: Bus) -> None:
        bus.nmt(START)
        for word in ("0600", "0700", "0F00"):
            bus.send(0x205, bytes.fromhex(word + "01"))
        bus.send(0x305, bytes.fromhex("1F00") + (5 * UNITS_PER_DEG).to_bytes(4, "little"))
        await asyncio.sleep(3.0)
        assert bus.read(0x6064) == 5 * UNITS_PER_DEG

    on_bus(use)


def test_a_pdo_that_is_too_short_is_an_emergency() -> None:
    async def use(bus: Bus) -> None:
        bus.nmt(START)
        (emergency,) = bus.send(0x305, bytes(3))
        assert emergency == CanFrame(0x085, bytes.fromhex("1082 11 0000000000"))  # 8210h
        assert (bus.read(0x1003), bus.read(0x1003, 1)) == (1, 0x8210)
        assert bus.write(0x1003, 0, 1, 0) == 0
        assert bus.read(0x1003) == 0
        assert bus.read(0x1003, 1) == -0x0800_0000

    on_bus(use)


def test_without_power_it_is_silent() -> None:
    async def run() -> None:
        bus = Bus()
        running = asyncio.create_task(bus.device.run())
        await asyncio.sleep(1.0)
        running.cancel()
        await asyncio.wait([running])
        assert bus.send(0x605, bytes.fromhex("4000100000000000")) == []

    run_virtual(run())


@given(
    st.lists(
        st.tuples(
            st.sampled_from([0x000, 0x080, 0x205, 0x305, 0x405, 0x605]), st.binary(max_size=8)
        ),
        max_size=30,
    )
)
def test_no_frames_whatever_bring_it_down(frames: list[tuple[int, bytes]]) -> None:
    async def use(bus: Bus) -> None:
        for can_id, data in frames:
            bus.send(can_id, data)
            await asyncio.sleep(0.01)
        bus.nmt(PRE_OPERATIONAL, 0)
        assert bus.read(0x1000) & 0xFFFF == 402

    on_bus(use)
