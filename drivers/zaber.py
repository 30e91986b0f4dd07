"""A Zaber rotary stage (X-RST, X-RSW) as turntable, by the Zaber ASCII Protocol Manual."""

import asyncio
import contextlib
import math
from dataclasses import replace
from typing import ClassVar, Self

from drivers.codecs.zaber import (
    ACCELERATION_DATA,
    NO_REFERENCE,
    NO_WARNING,
    SPEED_DATA,
    Rejection,
    Reply,
)
from drivers.errors import DeviceFaultError, DriverError, LinkTimeoutError, ProtocolError
from drivers.interfaces import Counters, Identity, Link, MotionLimits, Role, TableState
from drivers.zaber_dialogue import ZaberDialogue
from drivers.zaber_faults import LATE, STOPPED, deg, fault_of, missed, require_reference

_POLL_S = 0.05
_MARGIN_S = 3.0
_STOP_S = 10.0
_HOMING_SHARE = 0.1  # of the full speed; the approach to the reference is slower
_TOLERANCE_RAD = math.radians(0.01)


class Zaber:
    """One rotary stage; implements ``Turntable``.

    While it is open, the stage adds checksums to its replies (``comm.checksum``), where its
    firmware can.

    Args:
        link: The port that the stage, or the chain it begins, is on.
    """

    roles: ClassVar[frozenset[Role]] = frozenset({"turntable"})
    baudrate: ClassVar[int] = 115_200

    def __init__(self, link: Link) -> None:
        self._link_name = link.name
        self._dialogue = ZaberDialogue(link)
        self._identity: Identity | None = None
        self._limits: MotionLimits | None = None
        self._microsteps_per_rad = math.nan
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
    def counters(self) -> Counters:
        """Return the counters: replies, damaged ones, and those that did not come."""
        return self._dialogue.counters

    @property
    def limits(self) -> MotionLimits:
        """Return the speed and acceleration of moves; known once open."""
        if self._limits is None:
            raise self._not_open()
        return self._limits

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

    async def state(self) -> TableState:
        """Ask where the table is.

        Raises:
            LinkTimeoutError: No answer.
            DeviceFaultError: It reports a fault.
        """
        reply, state = await self._ask()
        await self._raise_fault(reply, state)
        return state

    async def observe(self) -> TableState:
        """Look where the table is, at any time, also while a move is awaited.

        A fault is reported, and neither raised nor acknowledged: it is the move's to tell.

        Raises:
            LinkTimeoutError: No answer.
            TransportError: The link was cut.
            ProtocolError: The answer is no number, however often asked.
        """
        reply, state = await self._ask()
        return replace(state, fault=fault_of(reply.warning, state))

    async def home(self) -> TableState:
        """Find the reference; returns when at rest.

        Raises:
            LinkTimeoutError: No answer.
            DeviceFaultError: The table stalled, was stopped, or did not find it.
        """
        stops = self._stops
        await self._begin("home", stops)
        turn_s = 2 * math.pi / (_HOMING_SHARE * self.limits.speed_rad_s)
        state = await self._rest("homing", turn_s + _MARGIN_S)
        self._check_not_stopped(stops, state, "homing")
        if not state.homed:
            msg = (
                "The table came to rest without its reference. Check its home sensor, then resume."
            )
            raise DeviceFaultError(msg, NO_REFERENCE)
        return state

    async def move_to(self, angle_rad: float) -> TableState:
        """Turn to an absolute angle, no wrap; returns when at rest there.

        Raises:
            LinkTimeoutError: No answer.
            DeviceFaultError: The table stalled, was stopped, lost its reference or stopped
                short; the message says where.
        """
        stops = self._stops
        start = await self.state()
        require_reference(start)
        what = f"the move to {deg(angle_rad)}"
        await self._begin(f"move abs {round(angle_rad * self._microsteps_per_rad)}", stops)
        state = await self._rest(what, self._duration_s(abs(angle_rad - start.angle_rad)))
        require_reference(state)
        if abs(state.angle_rad - angle_rad) > _TOLERANCE_RAD:
            self._check_not_stopped(stops, state, what)
            raise missed(start.angle_rad, angle_rad, state.angle_rad)
        return state

    async def stop(self) -> None:
        """Stop now, whatever else is being asked; a move awaited, or about to begin, fails.

        Raises:
            LinkTimeoutError: The table did not confirm that it stands.
        """
        self._stops += 1
        await self._dialogue.urge("stop")
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + _STOP_S
        while (await self._dialogue.request("")).busy:
            if loop.time() >= deadline_s:
                msg = (
                    f"The table on {self._link_name} still turns {_STOP_S:g} s after it was told"
                    " to stop. Cut its power."
                )
                raise LinkTimeoutError(msg)
            await asyncio.sleep(_POLL_S)

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

    async def _begin(self, motion: str, stops: int) -> None:
        """Send a motion command, unless a stop has been asked for since ``stops`` was read.

        Repeating it is checked too: its reply may have been lost while the stop came in.
        """

        def check() -> None:
            if self._stops != stops:
                msg = f"The table was told to stop, so '{motion}' was given up."
                raise DeviceFaultError(msg, STOPPED)

        await self._dialogue.request(motion, check=check)

    async def _rest(self, what: str, timeout_s: float) -> TableState:
        """Poll until the table stands, and look what it reports."""
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + timeout_s
        reply, state = await self._ask()
        while reply.busy:
            if loop.time() >= deadline_s:
                await self.stop()
                msg = (
                    f"The table still turned at {deg(state.angle_rad)}, {timeout_s:.1f} s after"
                    f" {what} began, so it was stopped. Check its load and its speed settings."
                )
                raise DeviceFaultError(msg, LATE)
            await asyncio.sleep(_POLL_S)
            reply, state = await self._ask()
        await self._raise_fault(reply, state)
        return state

    async def _ask(self) -> tuple[Reply, TableState]:
        reply, position = await self._dialogue.number("get pos")
        homed = await self._has_reference(reply)
        return reply, TableState(position / self._microsteps_per_rad, reply.busy, homed)

    async def _has_reference(self, reply: Reply) -> bool:
        """Tell whether ``WR`` holds; a graver flag hides it, so only ``--`` is a proof."""
        if reply.warning in (NO_WARNING, NO_REFERENCE):
            return reply.warning == NO_WARNING
        return NO_REFERENCE not in (await self._dialogue.request("warnings")).data.split()

    async def _raise_fault(self, reply: Reply, state: TableState) -> None:
        """Acknowledge a fault flag, so that the operator may resume, and raise it."""
        fault = fault_of(reply.warning, state)
        if fault is not None:
            await self._dialogue.request("warnings clear")
            raise DeviceFaultError(fault, reply.warning)

    def _check_not_stopped(self, stops: int, state: TableState, what: str) -> None:
        if self._stops != stops:
            msg = f"The table was stopped at {deg(state.angle_rad)} during {what}."
            raise DeviceFaultError(msg, STOPPED)

    def _duration_s(self, distance_rad: float) -> float:
        """Return how long a move may take: a trapezoid's time bounds a triangle's too."""
        ramp_s = self.limits.speed_rad_s / self.limits.acceleration_rad_s2
        return distance_rad / self.limits.speed_rad_s + 2 * ramp_s + _MARGIN_S

    async def _release(self) -> None:
        with contextlib.suppress(DriverError):
            await self._dialogue.close()

    def _not_open(self) -> RuntimeError:
        return RuntimeError(f"the table on {self._link_name} is not open yet")
