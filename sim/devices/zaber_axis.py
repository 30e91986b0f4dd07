"""The axis of a simulated Zaber stage: its motor, its position counter, its warning flags."""

import asyncio
import math
from collections.abc import Iterator

from drivers.codecs.zaber import ACCELERATION_DATA, NO_REFERENCE, SPEED_DATA, WARNINGS
from sim.interfaces import TableMechanism

#: 200 steps of 64 microsteps, geared 120:1: the data sheet's 0.000234375 deg per microstep.
MICROSTEPS_PER_TURN = 1_536_000
_RAD_PER_MICROSTEP = 2 * math.pi / MICROSTEPS_PER_TURN
_STALLED, _INTERRUPTED = "FS", "NI"
_ESTOP_RAD_S2 = 500.0

#: The encoder sits on the motor: it does not see what the gearing adds behind it.
_IN_POSITION_RAD = math.radians(0.02)


def _speed_data(speed_deg_s: float) -> int:
    return round(speed_deg_s / 360 * MICROSTEPS_PER_TURN * SPEED_DATA)


def _acceleration_data(acceleration_deg_s2: float) -> int:
    return round(acceleration_deg_s2 / 360 * MICROSTEPS_PER_TURN * ACCELERATION_DATA)


class Axis:
    """Turns the mechanism, counts microsteps and remembers what went wrong.

    At power-up the counter reads 0 wherever the plate stands, and ``WR`` says so; homing turns
    the shortest way to the plate's reference mark, its angle 0 modulo a turn.

    Attributes:
        settings: What ``get`` and ``set`` reach, in device units.
    """

    def __init__(self, mechanism: TableMechanism) -> None:
        self.settings = {
            "accel": _acceleration_data(360),
            "limit.approach.maxspeed": _speed_data(60),
            "limit.cycle.dist": MICROSTEPS_PER_TURN,
            "limit.max": 1_000_000_000,  # a rotary stage turns as often as its counter allows
            "limit.min": -1_000_000_000,
            "maxspeed": _speed_data(120),
            "motion.index.dist": MICROSTEPS_PER_TURN // 12,
        }
        self._mechanism = mechanism
        self._moving = False
        self._homing = False
        self._target_rad: float | None = None
        self._zero_rad = mechanism.angle_at(mechanism.end_s)
        self._warnings = {NO_REFERENCE}

    @property
    def moving(self) -> bool:
        """Return whether a motion was under way when last noticed."""
        return self._moving

    @property
    def end_s(self) -> float:
        """Return the loop time at which the present motion ends."""
        return self._mechanism.end_s

    @property
    def position(self) -> int:
        """Return the counter, microsteps."""
        angle_rad = self._mechanism.angle_at(_now_s())
        if not self._moving and self._target_rad is not None:
            arrived = abs(angle_rad - self._target_rad) < _IN_POSITION_RAD
            angle_rad = self._target_rad if arrived else angle_rad
        return round((angle_rad - self._zero_rad) / _RAD_PER_MICROSTEP)

    def warnings(self) -> Iterator[str]:
        """Yield the flags that hold, the gravest first."""
        return (flag for flag in WARNINGS if flag in self._warnings)

    def acknowledge(self) -> None:
        """Clear the flags that can be cleared: a stall and an interruption."""
        self._warnings -= {_STALLED, _INTERRUPTED}

    def turn_to(self, position: int, speed_data: int | None = None) -> None:
        """Begin a motion; without a reference it is no faster than an approach."""
        speed_data = speed_data or self.settings["maxspeed"]
        if NO_REFERENCE in self._warnings:
            speed_data = min(speed_data, self.settings["limit.approach.maxspeed"])
        self._homing = False
        self._begin(self._zero_rad + position * _RAD_PER_MICROSTEP, speed_data)

    def home(self) -> None:
        """Begin to turn to the reference mark."""
        here_rad = self._mechanism.angle_at(_now_s())
        self._homing = True
        reference_rad = here_rad - self._mechanism.past_mark_rad(_now_s())
        self._begin(reference_rad, self.settings["limit.approach.maxspeed"])

    def stop(self) -> None:
        """Begin to decelerate."""
        self._decelerate(self._acceleration_rad_s2())

    def emergency_stop(self) -> None:
        """Stop as hard as the motor can."""
        self._decelerate(_ESTOP_RAD_S2)

    def restart(self) -> None:
        """Begin as at power-up: the motion is broken off and the counter is 0 here."""
        self._decelerate(self._acceleration_rad_s2())
        self._target_rad = None
        self._zero_rad = self._mechanism.angle_at(_now_s())
        self._warnings = {NO_REFERENCE}

    def notice_end(self) -> bool:
        """Draw the consequences once a motion has ended; return whether one just has."""
        if not self._moving or _now_s() < self._mechanism.end_s:
            return False
        if self._homing and not self._mechanism.stalled and self._mark_has_moved():
            self.home()  # the plate has slipped meanwhile: the mark is still to come
            return False
        self._moving = False
        if self._mechanism.stalled:
            self._warnings.add(_STALLED)
        elif self._homing and self._target_rad is not None:
            self._zero_rad = self._target_rad
            self._warnings.discard(NO_REFERENCE)
        self._homing = False
        return True

    def _mark_has_moved(self) -> bool:
        now_s = _now_s()
        mark_rad = self._mechanism.angle_at(now_s) - self._mechanism.past_mark_rad(now_s)
        off_rad = math.remainder(mark_rad - (self._target_rad or 0.0), 2 * math.pi)
        return abs(off_rad) > _IN_POSITION_RAD

    def _begin(self, target_rad: float, speed_data: int) -> None:
        self._warnings.discard(_INTERRUPTED)
        self._mark_interruption()
        self._target_rad, self._moving = target_rad, True
        speed_rad_s = speed_data / SPEED_DATA * _RAD_PER_MICROSTEP
        acceleration_rad_s2 = self._acceleration_rad_s2()
        self._mechanism.move_to(target_rad, speed_rad_s, acceleration_rad_s2, _now_s())

    def _decelerate(self, acceleration_rad_s2: float) -> None:
        self._mark_interruption()
        self._homing = False
        if self._moving:
            self._target_rad = None
        self._mechanism.stop(acceleration_rad_s2, _now_s())

    def _mark_interruption(self) -> None:
        if self._moving:
            self._warnings.add(_INTERRUPTED)

    def _acceleration_rad_s2(self) -> float:
        return self.settings["accel"] / ACCELERATION_DATA * _RAD_PER_MICROSTEP


def _now_s() -> float:
    return asyncio.get_running_loop().time()
