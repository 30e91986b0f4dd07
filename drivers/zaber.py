"""A Zaber rotary stage (X-RST, X-RSW) as turntable, by the Zaber ASCII Protocol Manual."""

import contextlib
import math
from typing import ClassVar, Self

from drivers.codecs.zaber import (
    ACCELERATION_DATA,
    NO_REFERENCE,
    NO_WARNING,
    SPEED_DATA,
    WARNINGS,
    Rejection,
    Reply,
)
from drivers.errors import DeviceFaultError, DriverError, ProtocolError
from drivers.indexing_table import Check, Fault, IndexingTable, Seen, deg
from drivers.interfaces import Counters, Identity, Link, MotionLimits, Role, TableState, Transport
from drivers.zaber_dialogue import ZaberDialogue

_SPEED_OF_A_MOVE = [7, 25]
_HOMING_SHARE = 0.1  # of the full speed; the approach to the reference is slower


class Zaber(IndexingTable):
    """One rotary stage; implements ``Turntable``.

    While it is open, the stage adds checksums to its replies (``comm.checksum``), where its
    firmware can.

    Args:
        link: The port that the stage, or the chain it begins, is on.
    """

    roles: ClassVar[frozenset[Role]] = frozenset({"turntable"})
    transport: ClassVar[Transport] = "serial"
    baudrate: ClassVar[int] = 115_200

    def __init__(self, link: Link) -> None:
        super().__init__(link.name)
        self._dialogue = ZaberDialogue(link)
        self._microsteps_per_rad = math.nan

    @property
    def counters(self) -> Counters:
        """Return the counters: replies, damaged ones, and those that did not come."""
        return self._dialogue.counters

    async def open(self) -> Self:
        """Open the link, stop the table (it may still turn after a crash), read what it is.

        Raises:
            TransportError: The port is absent or busy, or nothing answers in time.
            ProtocolError: Something else answers, or a stage that does not turn.
            DeviceFaultError: A fault persists although it was acknowledged.
        """
        try:
            await self._dialogue.open()
            await self.stop()
            await self._dialogue.switch_on_checksums()
            await self._read_identity()
            await self._read_scales()
            await self._dialogue.request("warnings clear")
            await self.state()
        except DriverError:
            await self._release()
            raise
        return self

    async def close(self) -> None:
        """Stop the table, leave its settings as they were and release the link."""
        with contextlib.suppress(DriverError):
            await self.stop()
            await self._dialogue.restore_checksums()
        await self._release()

    async def _read_identity(self) -> None:
        _, model = await self._dialogue.number("get deviceid", axis=0)
        _, serial_number = await self._dialogue.number("get system.serial", axis=0)
        firmware = (await self._dialogue.request("get version", axis=0)).data
        self._identity = Identity("Zaber", f"device {model}", str(serial_number), firmware)

    async def _read_scales(self) -> None:
        turn = await self._microsteps_per_turn()
        _, speed = await self._dialogue.number("get maxspeed")
        _, acceleration = await self._dialogue.number("get accel")
        self._microsteps_per_rad = turn / (2 * math.pi)
        acceleration_rad_s2 = acceleration / ACCELERATION_DATA / self._microsteps_per_rad
        self._limits = MotionLimits(
            speed / SPEED_DATA / self._microsteps_per_rad,
            acceleration_rad_s2 or math.inf,  # the manual: 0 is no ramp at all
        )

    async def _microsteps_per_turn(self) -> int:
        turn, cause = 0, None
        try:
            _, turn = await self._dialogue.number("get limit.cycle.dist")
        except DeviceFaultError as rejection:
            if rejection.code != Rejection.BADCOMMAND:
                raise
            cause = rejection
        if turn <= 0:
            name = f"The Zaber {self.identity.model} on {self._link_name}"
            msg = f"{name} is no rotary stage: it has no limit.cycle.dist. Check the port."
            raise ProtocolError(msg) from cause
        return turn

    async def _look(self) -> Seen:
        reply, position = await self._dialogue.number("get pos")
        homed = await self._has_reference(reply)
        state = TableState(position / self._microsteps_per_rad, reply.busy, homed)
        return Seen(state, _fault_of(reply.warning, state))

    async def _moving(self) -> bool:
        return (await self._dialogue.request("")).busy

    async def _acknowledge(self) -> None:
        await self._dialogue.request("warnings clear")

    async def _begin_homing(self, check: Check) -> None:
        await self._dialogue.request("home", check=check)

    async def _begin_move(self, angle_rad: float, speed_rad_s: float | None, check: Check) -> None:
        # Repeating it is checked too: its reply may have been lost while a stop came in.
        motion = f"move abs {round(angle_rad * self._microsteps_per_rad)}"
        if speed_rad_s is not None:
            # Not by maxspeed: that is kept in the stage, also where nobody sets it back.
            self._require_speed_of_a_move()
            motion += f" {max(1, round(speed_rad_s * self._microsteps_per_rad * SPEED_DATA))}"
        await self._dialogue.request(motion, check=check)

    def _require_speed_of_a_move(self) -> None:
        """Refuse a stage whose firmware is older than 7.25, the first with a speed in the command.

        Raises:
            DeviceFaultError: It is.
        """
        firmware = self.identity.firmware
        if [int(part) for part in firmware.split(".")[:2] if part.isdecimal()] < _SPEED_OF_A_MOVE:
            msg = (
                f"The table on {self._link_name} has firmware {firmware}, and turning at a given"
                " speed takes 7.25 or newer. Update it, or stop at each angle."
            )
            raise DeviceFaultError(msg, "FIRMWARE")

    async def _halt(self) -> None:
        await self._dialogue.urge("stop")

    def _homing_speed_rad_s(self) -> float:
        return _HOMING_SHARE * self.limits.speed_rad_s

    async def _has_reference(self, reply: Reply) -> bool:
        """Tell whether ``WR`` holds; a graver flag hides it, so only ``--`` is a proof."""
        if reply.warning in (NO_WARNING, NO_REFERENCE):
            return reply.warning == NO_WARNING
        return NO_REFERENCE not in (await self._dialogue.request("warnings")).data.split()

    async def _release(self) -> None:
        with contextlib.suppress(DriverError):
            await self._dialogue.close()


def _fault_of(flag: str, state: TableState) -> Fault | None:
    """Say what a flag means; None where it is a warning or a note, no fault."""
    if not flag.startswith("F"):
        return None
    words = WARNINGS.get(flag, "a fault that the manual does not list")
    sentence = (
        f"The table reports {flag}, {words}, at {deg(state.angle_rad)}."
        " Check for an obstruction and its power, then resume."
    )
    return Fault(sentence, flag)
