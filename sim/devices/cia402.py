"""A simulated CiA 402 servo drive (CANopen) that turns an indexing table."""

from pathlib import Path
from typing import Self

from drivers.codecs.sdo import Entry
from drivers.interfaces import CanSettings
from sim.canopen.dictionary import ObjectDictionary
from sim.canopen.node import SimulatedNode
from sim.devices.cia402_drive import Drive
from sim.devices.cia402_motor import Motor
from sim.interfaces import TableMechanism

DATA_SHEET = Path(__file__).parent / "eds" / "cia402.eds"

_SERIAL = Entry(0x1018, 4)
_TICK_S = 0.02  # in motion: how often its ends are looked for, and changed values sent
_DRIVE_ERROR = 0x21  # 1001h: generic, and of the device profile


class SimulatedCia402(SimulatedNode):
    """A drive with a gear of 90:1 in profile position and homing mode; units of 0.0001 deg.

    Args:
        mechanism: The plate.
        node: Its number on the bus, 1 to 127.
        serial_number: What 1018h:4 says.
    """

    def __init__(
        self, mechanism: TableMechanism, node: int = 5, serial_number: int = 4_020_017
    ) -> None:
        data_sheet = DATA_SHEET.read_text("ascii")
        super().__init__(ObjectDictionary(data_sheet, node, {_SERIAL: serial_number}), node)
        self._motor = Motor(self._objects, mechanism)
        self._drive = Drive(self._objects, self._motor, self._report_or_take_back, self._notice)

    @classmethod
    def configured(cls, mechanism: TableMechanism, settings: CanSettings) -> Self:
        """Make it as a configuration says."""
        return cls(mechanism) if settings.node is None else cls(mechanism, settings.node)

    def lose_reference(self) -> None:
        """Restart, as after a dip of the supply: the counter begins at 0 where the plate is."""
        self.restart()

    def trip(self, code: int) -> None:
        """Fault injection: have a fault of this emergency code arise, 2310h for instance."""
        self._drive.trip(code)
        self._notice()

    def _reset_application(self) -> None:
        self._drive.restart()
        self._timers.set("motion", self._tick, 0.0)

    def _report_or_take_back(self, code: int) -> None:
        if code:
            self._report(code, _DRIVE_ERROR)
        else:
            self._take_back_errors()

    def _notice(self) -> None:
        if self._motor.moving:
            self._timers.set("motion", self._tick, _TICK_S)
        self._pdos.note_change()

    def _tick(self) -> None:
        self._drive.settle()
        if not self._motor.moving:
            self._timers.set("motion", self._tick, 0.0)
        self._pdos.note_change()
