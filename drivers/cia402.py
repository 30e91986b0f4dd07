"""A CiA 402 drive as turntable, in profile position and homing mode (CiA 402-2, CiA 301).

Everything goes by SDO: some forty short transfers a second while the table turns, and no mapping
of the drive's to be changed and put back. Its own speeds, accelerations and homing method hold.
"""

import asyncio
import contextlib
import math
from collections.abc import Callable
from functools import partial
from typing import ClassVar, Self

from drivers.canopen.drive_scale import read_units_per_turn
from drivers.canopen.identity import node_of, read_identity, require_profile
from drivers.canopen.node import CanopenNode
from drivers.codecs.canopen import NmtCommand, describe_error
from drivers.codecs.cia402 import (
    CONTROLWORD,
    ERROR_CODE,
    HOMING_SPEED_ZERO,
    MODE,
    MODE_DISPLAY,
    POSITION,
    PROFILE,
    PROFILE_ACCELERATION,
    PROFILE_VELOCITY,
    STATUSWORD,
    SUPPORTED_MODES,
    TARGET_POSITION,
    TOWARDS_ENABLED,
    VELOCITY,
    Command,
    Mode,
    State,
    Status,
)
from drivers.errors import DeviceFaultError, DriverError, LinkTimeoutError, ProtocolError
from drivers.indexing_table import Check, Fault, IndexingTable, Seen, deg
from drivers.interfaces import (
    CanLink,
    CanSettings,
    Counters,
    MotionLimits,
    Role,
    TableState,
    Transport,
)

_TRANSITION_S = 2.0  # a drive that releases its brake takes half a second
_POLL_S = 0.01
_STALE_S = 0.2  # for so long a statusword may still be that of the motion before
_STANDING_DEG_S = 0.02  # a servo that holds its place trembles
_FEWEST_UNITS = 36_000  # one is 0.01 deg, as near as a move must come to its target
_HOMING_SHARE = 0.1  # of the full speed, where the drive does not say
_HOMED = Status.HOMING_ATTAINED | Status.TARGET_REACHED


class Cia402(IndexingTable):
    """One drive on a bus; implements ``Turntable``.

    Args:
        link: The bus.
        node: The drive's number.
        units_per_turn: Position units per turn of the table; by default as the drive says.
    """

    roles: ClassVar[frozenset[Role]] = frozenset({"turntable"})
    transport: ClassVar[Transport] = "can"

    def __init__(self, link: CanLink, node: int, units_per_turn: float | None = None) -> None:
        self._node = CanopenNode(link, node)
        super().__init__(self._node.name)
        self._units_per_turn = units_per_turn
        self._units_per_rad = math.nan
        self._homing_rad_s = math.nan
        self._found_mode: int | None = None
        self._mode: Mode | None = None  # of the motion under way, or the last
        self._homed = False

    @classmethod
    def configured(cls, link: CanLink, settings: CanSettings) -> Self:
        """Make it as a configuration says.

        Raises:
            ValueError: No node number is given.
        """
        return cls(link, node_of(settings), settings.units_per_turn)

    @property
    def counters(self) -> Counters:
        """Return the counters: the node's frames, and answers that did not come."""
        return self._node.counters

    async def open(self) -> Self:
        """Open the bus, stop the drive (it may still turn after a crash), read what it is.

        Raises:
            TransportError: The interface is absent or down, or the node does not answer.
            ProtocolError: It is no drive, has neither mode or no scale, or shares its number.
            DeviceFaultError: A fault persists although it was reset.
        """
        self._mode, self._homed = None, False
        await self._node.open()
        try:
            await self._require_drive()
            await self._node.command(NmtCommand.START)
            self._units_per_rad = await self._read_scale()
            await self.stop()
            self._identity = await read_identity(self._node)
            await self._read_limits()
            await self._acknowledge()
            await self.state()
        except BaseException:
            await self._node.close()
            raise
        return self

    async def close(self) -> None:
        """Stop the table, take its power stage off and release the bus."""
        with contextlib.suppress(DriverError):
            await self.stop()
            await self._node.write(CONTROLWORD, Command.SHUT_DOWN, 2)
            if self._found_mode is not None:
                await self._node.write(MODE, self._found_mode, 1)
        await self._node.close()

    async def _require_drive(self) -> None:
        await require_profile(self._node, PROFILE, "drive")
        supported = await self._node.number(SUPPORTED_MODES)
        for mode in Mode:
            if not supported & mode.supported_bit:
                name = mode.name.lower().replace("_", " ")
                msg = f"The drive at {self._node.name} has no {name} mode (6502h {supported:08X}h)."
                raise ProtocolError(msg)
        self._found_mode = await self._node.number(MODE)

    async def _read_scale(self) -> float:
        units_per_turn = self._units_per_turn or await read_units_per_turn(self._node)
        if units_per_turn < _FEWEST_UNITS:
            msg = (
                f"The drive at {self._node.name} counts {units_per_turn:g} position units per turn:"
                f" too coarse to tell where the table stands. Take {_FEWEST_UNITS} or more."
            )
            raise ProtocolError(msg)
        return units_per_turn / (2 * math.pi)

    async def _read_limits(self) -> None:
        speed = await self._node.number(PROFILE_VELOCITY)
        acceleration = await self._node.number(PROFILE_ACCELERATION)
        if speed == 0 or acceleration == 0:
            msg = (
                f"The drive at {self._node.name} has no speed or acceleration for moves (6081h"
                f" {speed}, 6083h {acceleration}). Set them with its maker's program."
            )
            raise ProtocolError(msg)
        self._limits = MotionLimits(speed / self._units_per_rad, acceleration / self._units_per_rad)
        homing = await self._node.number_if_present(HOMING_SPEED_ZERO)
        self._homing_rad_s = (homing or _HOMING_SHARE * speed) / self._units_per_rad

    async def _look(self) -> Seen:
        status = await self._node.number(STATUSWORD)
        angle_rad = await self._node.number(POSITION, signed=True) / self._units_per_rad
        moving = await self._turns(status)
        if self._mode is Mode.HOMING and not moving and status & _HOMED == _HOMED:
            self._homed = True
        state = TableState(angle_rad, moving, self._homed)
        return Seen(state, await self._fault(status, state))

    async def _moving(self) -> bool:
        return await self._turns(await self._node.number(STATUSWORD))

    async def _turns(self, status: int) -> bool:
        """Tell a motion by its own bits while the drive is enabled, else by the velocity."""
        if State.of(status) is State.ENABLED and self._mode is not None:
            ended = Status.TARGET_REACHED
            if self._mode is Mode.HOMING:
                ended |= Status.HOMING_ERROR
            return not status & ended
        velocity = await self._node.number(VELOCITY, signed=True)
        return abs(velocity) / self._units_per_rad > math.radians(_STANDING_DEG_S)

    async def _fault(self, status: int, state: TableState) -> Fault | None:
        if State.of(status) in {State.FAULT, State.FAULT_REACTION}:
            code = await self._node.number_if_present(ERROR_CODE)
            if not code:  # not every drive has 603Fh, but an emergency it sends
                code = self._node.emergency.code if self._node.emergency else 0x1000
            return _fault(describe_error(code), f"{code:04X}h", state)
        enabled = State.of(status) is State.ENABLED
        if enabled and self._mode is Mode.HOMING and status & Status.HOMING_ERROR:
            return _fault("that homing failed", "HOMING", state)
        if enabled and self._mode is Mode.PROFILE_POSITION and status & Status.FOLLOWING_ERROR:
            return _fault(describe_error(0x8611), "8611h", state)
        return None

    async def _acknowledge(self) -> None:
        """Reset a fault; one whose cause persists comes back."""
        self._mode = None
        if State.of(await self._node.number(STATUSWORD)) is not State.FAULT:
            return
        await self._node.write(CONTROLWORD, Command.DISABLE_VOLTAGE, 2)
        await self._node.write(CONTROLWORD, Command.RESET_FAULT, 2)  # acts on the rising edge
        with contextlib.suppress(LinkTimeoutError):
            await self._until(lambda status: State.of(status) is not State.FAULT, "leave its fault")
        await self._node.write(CONTROLWORD, Command.DISABLE_VOLTAGE, 2)

    async def _begin_homing(self, check: Check) -> None:
        await self._prepare(Mode.HOMING, check)
        self._homed = False
        await self._node.write(CONTROLWORD, Command.START, 2, check=check)
        with contextlib.suppress(LinkTimeoutError):  # it may be where it shall be
            await self._until(lambda status: status & _HOMED != _HOMED, "begin", _STALE_S)
        self._mode = Mode.HOMING

    async def _begin_move(self, angle_rad: float, speed_rad_s: float | None, check: Check) -> None:
        await self._prepare(Mode.PROFILE_POSITION, check)
        if speed_rad_s is not None:
            await self._node.write(
                PROFILE_VELOCITY, max(1, round(speed_rad_s * self._units_per_rad)), 4
            )
        await self._node.write(TARGET_POSITION, round(angle_rad * self._units_per_rad), 4)
        await self._node.write(CONTROLWORD, Command.START_AT_ONCE, 2, check=check)
        taken = Status.SET_POINT_ACKNOWLEDGED
        await self._until(lambda status: bool(status & taken), "take the new target", check=check)
        await self._node.write(CONTROLWORD, Command.ENABLE, 2, check=check)
        await self._until(lambda status: not status & taken, "begin the move")
        self._mode = Mode.PROFILE_POSITION

    async def _forget_speed(self) -> None:
        speed = round(self.limits.speed_rad_s * self._units_per_rad)
        await self._node.write(PROFILE_VELOCITY, speed, 4)

    async def _prepare(self, mode: Mode, check: Check) -> None:
        """Enable the drive in a mode; no motion begins by that, and none has a mode until then."""
        self._mode = None
        await self._node.write(MODE, mode, 1)
        await self._enable(check)
        shown = await self._node.number(MODE_DISPLAY)
        if shown != mode:
            name = mode.name.lower().replace("_", " ")
            msg = f"The drive at {self._node.name} does not enter {name} mode (6061h {shown})."
            raise DeviceFaultError(msg, "MODE")

    async def _enable(self, check: Check) -> None:
        """Go through the drive's states until it is enabled, waiting for each."""
        state = State.NOT_READY
        for _ in State:
            status = await self._node.number(STATUSWORD)
            if not status & Status.REMOTE:
                msg = f"The drive at {self._node.name} is under local control: hand it over."
                raise DeviceFaultError(msg, "LOCAL")
            state = State.of(status)
            if state is State.ENABLED:
                await self._node.write(CONTROLWORD, Command.ENABLE, 2, check=check)
                return
            step = TOWARDS_ENABLED.get(state)
            if step is not None:
                await self._node.write(CONTROLWORD, step, 2, check=check)
            await self._until(partial(_has_left, state), f"leave {_words(state)}", check=check)
        msg = f"The drive at {self._node.name} does not get enabled; it is {_words(state)}."
        raise DeviceFaultError(msg, "STATE")

    async def _halt(self) -> None:
        await self._node.urge(CONTROLWORD, Command.QUICK_STOP, 2)

    def _homing_speed_rad_s(self) -> float:
        return self._homing_rad_s

    async def _until(
        self,
        holds: Callable[[int], bool],
        what: str,
        timeout_s: float = _TRANSITION_S,
        *,
        check: Check | None = None,
    ) -> None:
        """Ask for the statusword until something holds of it, or ``check`` raises.

        Raises:
            LinkTimeoutError: It does not in time.
        """
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + timeout_s
        while not holds(status := await self._node.number(STATUSWORD)):
            if check is not None:  # a stop takes back what is being waited for
                check()
            if loop.time() >= deadline_s:
                state = _words(State.of(status))
                msg = (
                    f"The drive at {self._node.name} did not {what} within {timeout_s:g} s: it is"
                    f" {state} (statusword {status:04X}h). Check its enable input and its supply."
                )
                raise LinkTimeoutError(msg)
            await asyncio.sleep(_POLL_S)


def _fault(what: str, code: str, state: TableState) -> Fault:
    sentence = (
        f"The table reports {what}, at {deg(state.angle_rad)}."
        " Check for an obstruction and its power, then resume."
    )
    return Fault(sentence, code)


def _has_left(state: State, status: int) -> bool:
    return State.of(status) is not state


def _words(state: State) -> str:
    return state.name.lower().replace("_", " ")
