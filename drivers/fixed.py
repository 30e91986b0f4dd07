"""No table: the instruments stand on a mount that does not turn, in a vehicle say."""

from typing import ClassVar, Self

from drivers.errors import DeviceFaultError
from drivers.interfaces import Counters, Identity, MotionLimits, Role, TableState, Transport

_AT_REST = TableState(angle_rad=0.0, moving=False, homed=True)


class FixedMount:
    """Stands at its own reference for ever; implements ``Turntable`` without a link."""

    roles: ClassVar[frozenset[Role]] = frozenset({"turntable"})
    transport: ClassVar[Transport] = "none"

    def __init__(self) -> None:
        self.counters = Counters()

    @property
    def link_name(self) -> str:
        """Return that there is none."""
        return "none"

    @property
    def identity(self) -> Identity:
        """Return what it is."""
        return Identity("", "fixed mount", "")

    @property
    def limits(self) -> MotionLimits:
        """Return that it does not turn."""
        return MotionLimits(0.0, 0.0)

    async def open(self) -> Self:
        """Do nothing: there is nobody to ask."""
        return self

    async def close(self) -> None:
        """Do nothing."""

    async def state(self) -> TableState:
        """Return where it stands."""
        return _AT_REST

    async def observe(self) -> TableState:
        """Return where it stands."""
        return _AT_REST

    async def home(self) -> TableState:
        """Return where it stands: that is its reference."""
        return _AT_REST

    async def move_to(self, angle_rad: float, speed_rad_s: float | None = None) -> TableState:  # noqa: ARG002 -- every table's
        """Refuse.

        Raises:
            DeviceFaultError: Always.
        """
        msg = f"a fixed mount cannot turn to {angle_rad:.3f} rad: this rig has no table"
        raise DeviceFaultError(msg, "fixed")

    async def stop(self) -> None:
        """Do nothing: it stands."""
