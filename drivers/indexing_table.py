"""What every indexing table does alike: begin a motion, wait for it, say what became of it."""

import asyncio
import contextlib
import math
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import NamedTuple

from drivers.errors import DeviceFaultError, DriverError, LinkTimeoutError
from drivers.interfaces import Identity, MotionLimits, TableState

#: Fault codes of our own, beside those of each table's manual.
STOPPED, SHORT, LATE, NO_REFERENCE = "STOPPED", "SHORT", "LATE", "NO REFERENCE"

_POLL_S = 0.05
_ARRIVING_POLL_S, _ARRIVING_S = 0.005, 0.25
_MARGIN_S = 3.0
_ROUNDED = 1.02  # what a slow speed in whole units a second may come to
_STOP_S = 10.0
_SWINGS_S = 1.0  # about its target after a move, at most, by more than the tolerance
_TOLERANCE_RAD = math.radians(0.01)


class Fault(NamedTuple):
    """What a table complains of: a sentence, and the code of its manual."""

    sentence: str
    code: str


class Seen(NamedTuple):
    """A table at one moment, and its fault if it reports one."""

    state: TableState
    fault: Fault | None


#: Raises where a motion shall not begin any more, for a stop has been asked for meanwhile.
Check = Callable[[], None]


class IndexingTable(ABC):
    """The motions of a ``Turntable``; the steps that differ are those of its protocol.

    Args:
        link_name: What a message calls the link.
    """

    def __init__(self, link_name: str) -> None:
        self._link_name = link_name
        self._identity: Identity | None = None
        self._limits: MotionLimits | None = None
        self._stops = 0

    @property
    def link_name(self) -> str:
        """Return the link's name."""
        return self._link_name

    @property
    def identity(self) -> Identity:
        """Return who answered; known once open."""
        if self._identity is None:
            raise self._not_open()
        return self._identity

    @property
    def limits(self) -> MotionLimits:
        """Return the speed and acceleration of moves; known once open."""
        if self._limits is None:
            raise self._not_open()
        return self._limits

    async def state(self) -> TableState:
        """Ask where the table is.

        Raises:
            LinkTimeoutError: No answer.
            DeviceFaultError: It reports a fault.
        """
        seen = await self._look()
        await self._raise_fault(seen)
        return seen.state

    async def observe(self) -> TableState:
        """Look where the table is, at any time, also while a move is awaited.

        A fault is reported, and neither raised nor acknowledged: it is the move's to tell.

        Raises:
            LinkTimeoutError: No answer.
            TransportError: The link was cut.
            ProtocolError: The answer is no number, however often asked.
        """
        state, fault = await self._look()
        return state if fault is None else replace(state, fault=fault.sentence)

    async def home(self) -> TableState:
        """Find the reference; returns when at rest.

        Raises:
            LinkTimeoutError: No answer.
            DeviceFaultError: The table stalled, was stopped, or did not find it.
        """
        stops = self._stops
        await self._begin_homing(self._unless_stopped("homing"))
        turn_s = 2 * math.pi / self._homing_speed_rad_s()
        state = await self._rest("homing", turn_s + _MARGIN_S)
        self._check_not_stopped(stops, state, "homing")
        if not state.homed:
            msg = (
                "The table came to rest without its reference. Check its home sensor, then resume."
            )
            raise DeviceFaultError(msg, NO_REFERENCE)
        return state

    async def move_to(self, angle_rad: float, speed_rad_s: float | None = None) -> TableState:
        """Turn to an absolute angle, no wrap; returns when at rest there.

        Args:
            angle_rad: Counter-clockwise from the reference.
            speed_rad_s: Of this move alone, at most that of the limits; by default the latter.

        Raises:
            LinkTimeoutError: No answer.
            DeviceFaultError: The table stalled, was stopped, lost its reference or stopped
                short; the message says where. Or it cannot turn at a speed given.
            ValueError: The speed is not positive, or above the limit.
        """
        self._check_speed(speed_rad_s)
        stops = self._stops
        what = f"the move to {deg(angle_rad)}"
        check = self._unless_stopped(what)
        start = await self.state()
        _require_reference(start)
        distance_rad = abs(angle_rad - start.angle_rad)
        async with self._speed_of_one_move(speed_rad_s):
            await self._begin_move(angle_rad, speed_rad_s, check)
            expected_s = self._duration_s(distance_rad, speed_rad_s)
            state = await self._rest(what, expected_s + _MARGIN_S, expected_s)
        _require_reference(state)
        state = await self._swung_out(state, angle_rad, stops)
        if abs(state.angle_rad - angle_rad) > _TOLERANCE_RAD:
            self._check_not_stopped(stops, state, what)
            raise _missed(start.angle_rad, angle_rad, state.angle_rad)
        return state

    async def _swung_out(self, state: TableState, angle_rad: float, stops: int) -> TableState:
        """Look again while it is off: asked the moment it arrived, it may still swing."""
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + _SWINGS_S
        while abs(state.angle_rad - angle_rad) > _TOLERANCE_RAD:
            if stops != self._stops or loop.time() >= deadline_s:
                break
            await asyncio.sleep(_POLL_S)
            state = await self.state()
        return state

    async def stop(self) -> None:
        """Stop now, whatever else is being asked; a move awaited, or about to begin, fails.

        Raises:
            LinkTimeoutError: The table did not confirm that it stands.
        """
        self._stops += 1
        await self._halt()
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + _STOP_S
        while await self._moving():
            if loop.time() >= deadline_s:
                msg = (
                    f"The table on {self._link_name} still turns {_STOP_S:g} s after it was told"
                    " to stop. Cut its power."
                )
                raise LinkTimeoutError(msg)
            await asyncio.sleep(_POLL_S)

    @abstractmethod
    async def _look(self) -> Seen:
        """Ask where the table is and what it complains of."""

    @abstractmethod
    async def _moving(self) -> bool:
        """Ask only whether the table turns."""

    @abstractmethod
    async def _acknowledge(self) -> None:
        """Take note of a fault, so that the table may be moved again."""

    @abstractmethod
    async def _begin_homing(self, check: Check) -> None:
        """Have the table find its reference, unless ``check`` raises just before."""

    @abstractmethod
    async def _begin_move(self, angle_rad: float, speed_rad_s: float | None, check: Check) -> None:
        """Have the table turn to an angle, unless ``check`` raises just before.

        A speed is of this move alone; None stands for the table's own.
        """

    async def _forget_speed(self) -> None:  # noqa: B027 -- where it is part of the command
        """Let moves have the table's own speed again, after one that had a speed given."""

    @abstractmethod
    async def _halt(self) -> None:
        """Tell the table to stop, ahead of whatever else is being asked."""

    @abstractmethod
    def _homing_speed_rad_s(self) -> float:
        """Return how slowly the table may turn while it looks for its reference."""

    def _unless_stopped(self, what: str) -> Check:
        """Return what raises once a stop has been asked for, counted from now."""
        stops = self._stops

        def check() -> None:
            if self._stops != stops:
                msg = f"The table was told to stop, so {what} was given up."
                raise DeviceFaultError(msg, STOPPED)

        return check

    async def _rest(self, what: str, timeout_s: float, expected_s: float = math.inf) -> TableState:
        """Poll until the table stands, and look what it reports.

        Where it is expected to come to rest it is asked at once, and often for a moment: whoever
        waits for it has nothing else to do.
        """
        loop = asyncio.get_running_loop()
        deadline_s, arrival_s = loop.time() + timeout_s, loop.time() + expected_s
        seen = await self._look()
        while seen.state.moving:
            if loop.time() >= deadline_s:
                await self.stop()
                msg = (
                    f"The table still turned at {deg(seen.state.angle_rad)}, {timeout_s:.1f} s"
                    f" after {what} began, so it was stopped. Check its load and its speed."
                )
                raise DeviceFaultError(msg, LATE)
            await asyncio.sleep(_wait_s(arrival_s - loop.time()))
            seen = await self._look()
        await self._raise_fault(seen)
        return seen.state

    async def _raise_fault(self, seen: Seen) -> None:
        """Acknowledge a fault, so that the operator may resume, and raise it."""
        if seen.fault is not None:
            await self._acknowledge()
            raise DeviceFaultError(*seen.fault)

    def _check_not_stopped(self, stops: int, state: TableState, what: str) -> None:
        if self._stops != stops:
            msg = f"The table was stopped at {deg(state.angle_rad)} during {what}."
            raise DeviceFaultError(msg, STOPPED)

    @asynccontextmanager
    async def _speed_of_one_move(self, speed_rad_s: float | None) -> AsyncIterator[None]:
        """Have the table's own speed again afterwards; what ended the move is told first."""
        try:
            yield
        except BaseException:
            if speed_rad_s is not None:
                with contextlib.suppress(DriverError):
                    await self._forget_speed()
            raise
        if speed_rad_s is not None:
            await self._forget_speed()

    def _check_speed(self, speed_rad_s: float | None) -> None:
        highest_rad_s = self.limits.speed_rad_s
        if speed_rad_s is not None and not 0.0 < speed_rad_s <= highest_rad_s:
            msg = (
                f"a speed of {speed_rad_s:g} rad/s is not above 0 and at most the table's "
                f"{highest_rad_s:g} rad/s"
            )
            raise ValueError(msg)

    def _duration_s(self, distance_rad: float, given_rad_s: float | None) -> float:
        speed_rad_s = None if given_rad_s is None else given_rad_s / _ROUNDED
        return self.limits.move_s(distance_rad, speed_rad_s)

    def _not_open(self) -> RuntimeError:
        return RuntimeError(f"the table on {self._link_name} is not open yet")


def _wait_s(left_s: float) -> float:
    """Return how long to wait before asking again, the arrival being expected so far ahead."""
    if left_s > 0.0:
        return min(left_s, _POLL_S)
    return _ARRIVING_POLL_S if left_s > -_ARRIVING_S else _POLL_S


def deg(angle_rad: float) -> str:
    """Write an angle as people read it."""
    return f"{round(math.degrees(angle_rad), 2) + 0.0:g} deg"  # + 0.0: no "-0 deg"


def _require_reference(state: TableState) -> None:
    """Refuse a table whose angle is not known.

    Raises:
        DeviceFaultError: It has lost its reference.
    """
    if not state.homed:
        msg = (
            "The table has lost its reference, so its angle is not known: it was restarted or"
            " lost power. Home it, then resume."
        )
        raise DeviceFaultError(msg, NO_REFERENCE)


def _missed(start_rad: float, target_rad: float, end_rad: float) -> DeviceFaultError:
    """Say how far from its target a move ended, and on which side."""
    short_rad = (target_rad - end_rad) * math.copysign(1.0, target_rad - start_rad)
    side = "short of" if short_rad > 0 else "beyond"
    msg = f"The table stopped {deg(abs(short_rad))} {side} {deg(target_rad)}."
    return DeviceFaultError(f"{msg} Check for an obstruction, then resume.", SHORT)
