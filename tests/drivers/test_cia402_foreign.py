"""Our CiA 402 driver turns a drive whose CANopen nobody here wrote: PyPI's `canopen` speaks it.

Object dictionary, SDO server, network states, heartbeat and emergencies are the library's; the
power states and both modes are written here from CiA 402-2's tables. All of it in wall time.
"""

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Iterable
from itertools import count
from typing import Any

import canopen
import pytest
from canopen.objectdictionary import ObjectDictionary, ODRecord, ODVariable
from canopen.objectdictionary.datatypes import (
    INTEGER8,
    INTEGER32,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
    VISIBLE_STRING,
)

from drivers.cia402 import Cia402
from drivers.errors import DeviceFaultError, ProtocolError, TransportError
from drivers.interfaces import TableState
from drivers.links.can import CanBus
from drivers.links.can_port import CanPort

NODE = 17
SPEED_DEG_S, HOMING_DEG_S = 60.0, 40.0
MARK_DEG = -8.0  # where the home switch is, from where the drive is switched on
MILLIDEGREE = 1e-3
SOON_S = 2.0
_channels = count()

Row = tuple[int, int, int, str, Any]
#: Index, sub-index, type, access, value: what CiA 402-2 asks of a drive with these two modes.
DRIVE: tuple[Row, ...] = (
    (0x1000, 0, UNSIGNED32, "ro", 0x0002_0192),  # a servo drive, profile 402
    (0x1001, 0, UNSIGNED8, "ro", 0),
    (0x1008, 0, VISIBLE_STRING, "const", "A foreign servo"),
    (0x1018, 0, UNSIGNED8, "ro", 4),
    (0x1018, 1, UNSIGNED32, "ro", 0x2B6),
    (0x1018, 2, UNSIGNED32, "ro", 0x77),
    (0x1018, 3, UNSIGNED32, "ro", 1),
    (0x1018, 4, UNSIGNED32, "ro", 123_456),
    (0x603F, 0, UNSIGNED16, "ro", 0),
    (0x6040, 0, UNSIGNED16, "rw", 0),
    (0x6041, 0, UNSIGNED16, "ro", 0),
    (0x6060, 0, INTEGER8, "rw", 0),
    (0x6061, 0, INTEGER8, "ro", 0),
    (0x6064, 0, INTEGER32, "ro", 0),
    (0x606C, 0, INTEGER32, "ro", 0),
    (0x607A, 0, INTEGER32, "rw", 0),
    (0x6098, 0, INTEGER8, "rw", 24),
    (0x6502, 0, UNSIGNED32, "ro", 0x21),
)
HEARTBEAT: tuple[Row, ...] = ((0x1017, 0, UNSIGNED16, "rw", 0),)
#: 90 000 units of feed for every two turns of the shaft.
FEED: tuple[Row, ...] = (
    (0x6092, 0, UNSIGNED8, "ro", 2),
    (0x6092, 1, UNSIGNED32, "rw", 90_000),
    (0x6092, 2, UNSIGNED32, "rw", 2),
)
#: 4 096 increments a turn of the motor, which turns 90 times for every turn of the shaft.
ENCODER_AND_GEAR: tuple[Row, ...] = (
    (0x608F, 0, UNSIGNED8, "ro", 2),
    (0x608F, 1, UNSIGNED32, "rw", 4096),
    (0x608F, 2, UNSIGNED32, "rw", 1),
    (0x6091, 0, UNSIGNED8, "ro", 2),
    (0x6091, 1, UNSIGNED32, "rw", 180),
    (0x6091, 2, UNSIGNED32, "rw", 2),
)
FEED_UNITS, ENCODER_UNITS = 45_000, 368_640  # a turn

#: CiA 402-2, table 30: the lower bits of the statusword; voltage is there, it may be told remotely.
STATUS = {
    "switch on disabled": 0x250,
    "ready": 0x231,
    "switched on": 0x233,
    "enabled": 0x237,
    "quick stop": 0x217,
    "fault": 0x218,
}
#: CiA 402-2, table 28: under which mask the controlword leads where.
SHUT_DOWN, SWITCH_ON = (0x87, 0x06, "ready"), (0x8F, 0x07, "switched on")
ENABLE, STOP = (0x8F, 0x0F, "enabled"), (0x86, 0x02, "quick stop")
NO_VOLTAGE, QUICK_STOP = (0x82, 0x00, "switch on disabled"), (0x86, 0x02, "switch on disabled")
TRANSITIONS = {
    "switch on disabled": (SHUT_DOWN,),
    "ready": (SWITCH_ON, NO_VOLTAGE, QUICK_STOP),
    "switched on": (ENABLE, SHUT_DOWN, NO_VOLTAGE, QUICK_STOP),
    "enabled": (SWITCH_ON, SHUT_DOWN, NO_VOLTAGE, STOP),
    "quick stop": (NO_VOLTAGE,),
    "fault": (),
}


class Drive:
    """A servo at constant speeds; whatever it is asked is worked out when it is asked.

    Its units are from where it was switched on, until it has been homed.
    """

    def __init__(self, channel: str, rows: Iterable[Row], units_per_turn: int) -> None:
        self.state, self.code = "switch on disabled", 0
        self._units_per_deg = units_per_turn / 360.0
        self._mode = self._controlword = self._target = 0
        self._done = True  # the last motion was carried out
        self._homed = False
        self._zero_deg = 0.0
        self._from_deg = self._to_deg = self._speed_deg_s = 0.0
        self._begun_s = 0.0
        units = round(SPEED_DEG_S * self._units_per_deg)
        profile: tuple[Row, ...] = (
            (0x6081, 0, UNSIGNED32, "rw", units),
            (0x6083, 0, UNSIGNED32, "rw", 100 * units),
            (0x6099, 0, UNSIGNED8, "ro", 2),
            (0x6099, 1, UNSIGNED32, "rw", units),
            (0x6099, 2, UNSIGNED32, "rw", round(HOMING_DEG_S * self._units_per_deg)),
        )
        self.node = canopen.LocalNode(NODE, dictionary([*rows, *profile]))
        self.node.add_read_callback(self._read)  # type: ignore[no-untyped-call]
        self.node.add_write_callback(self._write)  # type: ignore[no-untyped-call]
        self._network = canopen.Network()
        self._network.NOTIFIER_CYCLE = 0.05  # s; for so long switching it off may take
        self._network.connect(interface="virtual", channel=channel)
        self._network.add_node(self.node)
        if 0x1017 in self.node.object_dictionary:
            self.node.nmt.state = "INITIALISING"
            self.node.nmt.state = "PRE-OPERATIONAL"

    def switch_off(self) -> None:
        self.node.nmt.stop_heartbeat()  # type: ignore[no-untyped-call]
        self._network.disconnect()

    def shaft_deg(self) -> float:
        """Return where the shaft is, from where it was switched on."""
        way_deg = self._to_deg - self._from_deg
        gone_deg = self._speed_deg_s * (time.monotonic() - self._begun_s)
        if gone_deg >= abs(way_deg):
            return self._to_deg
        return self._from_deg + math.copysign(gone_deg, way_deg)

    def angle_deg(self) -> float:
        """Return where the shaft is, from the home switch."""
        return self.shaft_deg() - MARK_DEG

    def fail(self, code: int) -> None:
        """Report a fault and stop, as with a hardware that protects itself."""
        self._stand()
        self.state, self.code = "fault", code
        self.node.emcy.send(code, 0x05)

    def _stand(self) -> None:
        self._from_deg = self._to_deg = self.shaft_deg()

    def _go(self, to_deg: float, speed_deg_s: float) -> None:
        self._from_deg, self._to_deg = self.shaft_deg(), to_deg
        self._begun_s, self._speed_deg_s, self._done = time.monotonic(), speed_deg_s, False

    def _turns(self) -> bool:
        return self.shaft_deg() != self._to_deg

    def _read(self, index: int, **_: object) -> int | None:
        units_deg = self.shaft_deg() - self._zero_deg
        if index == 0x6041:
            return self._statusword()
        if index == 0x6064:
            return round(units_deg * self._units_per_deg)
        if index == 0x606C:
            sign = math.copysign(1.0, self._to_deg - self._from_deg)
            return round(sign * self._speed_deg_s * self._units_per_deg) if self._turns() else 0
        return {0x6061: self._mode, 0x603F: self.code}.get(index)

    def _statusword(self) -> int:
        """Return the state; bits 10 and 12 are the mode's (CiA 402-2, tables 118 and 96)."""
        self._note_arrival()
        word = STATUS[self.state] | (0 if self._turns() else 1 << 10)
        if self._mode == 1:
            return word | (1 << 12 if self._controlword & 1 << 4 else 0)
        return word | (1 << 12 if self._mode == 6 and self._homed else 0)

    def _note_arrival(self) -> None:
        if self._done or self._turns():
            return
        self._done = True
        if self._mode == 6 and self.state == "enabled":
            self._homed, self._zero_deg = True, MARK_DEG

    def _write(self, index: int, data: bytes, **_: object) -> None:
        number = int.from_bytes(data, "little", signed=True)
        if index == 0x6060:
            self._note_arrival()
            self._mode = number
        elif index == 0x607A:
            self._target = number
        elif index == 0x6040:
            self._obey(number & 0xFFFF)

    def _obey(self, word: int) -> None:
        rising, self._controlword = word & ~self._controlword, word
        if self.state == "fault" and rising & 1 << 7:
            self.state, self.code = "switch on disabled", 0
            self.node.emcy.reset()
        for mask, bits, leads_to in TRANSITIONS[self.state]:
            if word & mask == bits:
                self.state = leads_to
                break
        if self.state != "enabled":
            self._stand()
        elif rising & 1 << 4 and self._mode == 6:
            self._homed = False
            self._go(MARK_DEG, HOMING_DEG_S)
        elif rising & 1 << 4 and self._mode == 1:
            self._go(self._zero_deg + self._target / self._units_per_deg, SPEED_DEG_S)


def dictionary(rows: Iterable[Row]) -> ObjectDictionary:
    """Write down an object dictionary as `canopen` has it."""
    objects = ObjectDictionary()  # type: ignore[no-untyped-call]
    table = list(rows)
    records = {row[0]: ODRecord(f"{row[0]:04X}h", row[0]) for row in table if row[1]}
    for record in records.values():
        objects.add_object(record)
    for index, sub_index, kind, access, value in table:
        variable = ODVariable(f"{index:04X}h:{sub_index:X}", index, sub_index)
        variable.data_type, variable.access_type, variable.default = kind, access, value
        if index in records:
            records[index].add_member(variable)
        else:
            objects.add_object(variable)
    return objects


def with_drive(
    use: Callable[[Drive, Cia402], Awaitable[None]],
    rows: Iterable[Row],
    units_per_turn: int = FEED_UNITS,
    configured_units: float | None = None,
) -> None:
    """Switch a drive on, use it through a driver that is not open yet, and close both."""
    channel = f"northfinder-foreign-{next(_channels)}"
    drive = Drive(channel, rows, units_per_turn)

    async def run() -> None:
        table = Cia402(CanPort(CanBus("virtual", channel, {})), NODE, configured_units)
        try:
            await use(drive, table)
        finally:
            await table.close()

    try:
        asyncio.run(run())
    finally:
        drive.switch_off()


def degrees(state: TableState) -> float:
    assert not state.moving
    assert state.homed
    return math.degrees(state.angle_rad)


async def until_beyond_ten(drive: Drive) -> None:
    async with asyncio.timeout(SOON_S):
        while drive.angle_deg() < 10.0:  # noqa: ASYNC110 -- no drive tells what its shaft does
            await asyncio.sleep(0.005)


async def home_and_turn(drive: Drive, table: Cia402) -> None:
    """Home, move there and back; the shaft is where the driver says."""
    await table.open()
    assert degrees(await table.home()) == pytest.approx(0.0, abs=MILLIDEGREE)
    assert drive.shaft_deg() == MARK_DEG
    for target_deg in (20.0, 5.0):
        state = await table.move_to(math.radians(target_deg))
        assert degrees(state) == pytest.approx(target_deg, abs=10 * MILLIDEGREE)
        assert drive.angle_deg() == pytest.approx(target_deg, abs=10 * MILLIDEGREE)


@pytest.mark.parametrize(
    ("rows", "units_per_turn"),
    [
        ([*DRIVE, *HEARTBEAT, *FEED], FEED_UNITS),
        ([*DRIVE, *HEARTBEAT, *ENCODER_AND_GEAR], ENCODER_UNITS),
        ([*DRIVE, *FEED], FEED_UNITS),
    ],
    ids=["feed constant", "encoder and gear", "no heartbeat"],
)
def test_a_foreign_drive_is_homed_and_turned(rows: list[Row], units_per_turn: int) -> None:
    async def use(drive: Drive, table: Cia402) -> None:
        await home_and_turn(drive, table)
        identity = table.identity
        assert (identity.model, identity.serial_number) == ("A foreign servo", "123456")
        assert math.degrees(table.limits.speed_rad_s) == pytest.approx(SPEED_DEG_S)

    with_drive(use, rows, units_per_turn)


def test_a_drive_that_tells_no_scale_is_refused_until_it_is_configured() -> None:
    rows = [*DRIVE, *HEARTBEAT]

    async def refused(_: Drive, table: Cia402) -> None:
        with pytest.raises(ProtocolError, match=r"Give units_per_turn in \[turntable\]"):
            await table.open()

    with_drive(refused, rows, 12_345)
    with_drive(home_and_turn, rows, 123_456, configured_units=123_456)


def test_a_stop_amid_a_move_leaves_the_shaft_where_it_was_and_is_told() -> None:
    async def use(drive: Drive, table: Cia402) -> None:
        await table.open()
        await table.home()
        move = asyncio.create_task(table.move_to(math.radians(300.0)))
        await until_beyond_ten(drive)
        await table.stop()
        stopped_deg = drive.angle_deg()
        with pytest.raises(DeviceFaultError, match=r"was stopped at .* during the move to 300 deg"):
            await move
        assert 10.0 <= stopped_deg < 60.0
        assert drive.angle_deg() == stopped_deg
        state = await table.move_to(math.radians(5.0))
        assert degrees(state) == pytest.approx(5.0, abs=10 * MILLIDEGREE)

    with_drive(use, [*DRIVE, *HEARTBEAT, *FEED])


@pytest.mark.parametrize("absent", [{0x603F}, set()], ids=["by emergency only", "by 603Fh"])
def test_a_fault_amid_a_move_is_told_in_words_and_may_be_resumed(absent: set[int]) -> None:
    async def use(drive: Drive, table: Cia402) -> None:
        await table.open()
        await table.home()
        move = asyncio.create_task(table.move_to(math.radians(300.0)))
        await until_beyond_ten(drive)
        drive.fail(0x4310)  # CiA 402-2, table 19: excess temperature of the drive
        words = r"The table reports 4310h \(drive too hot\), at 1\d"
        with pytest.raises(DeviceFaultError, match=words):
            await move
        assert drive.state != "fault"
        state = await table.move_to(math.radians(5.0))
        assert degrees(state) == pytest.approx(5.0, abs=10 * MILLIDEGREE)

    with_drive(use, [row for row in [*DRIVE, *HEARTBEAT, *FEED] if row[0] not in absent])


def test_the_drive_is_left_without_power_and_its_heartbeat_as_it_was() -> None:
    async def use(drive: Drive, table: Cia402) -> None:
        await table.open()
        await table.home()
        assert int.from_bytes(drive.node.get_data(0x1017, 0), "little") > 0
        await table.close()
        assert int.from_bytes(drive.node.get_data(0x1017, 0), "little") == 0
        assert drive.state not in {"switched on", "enabled"}

    with_drive(use, [*DRIVE, *HEARTBEAT, *FEED])


def test_a_drive_that_is_switched_off_is_told() -> None:
    async def use(drive: Drive, table: Cia402) -> None:
        await table.open()
        drive.switch_off()
        with pytest.raises(TransportError, match=f"node {NODE} on virtual"):
            await table.home()

    with_drive(use, [*DRIVE, *HEARTBEAT, *FEED])
