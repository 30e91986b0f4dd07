"""The motor of a simulated CiA 402 drive: its motions, its position counter, its reference."""

import asyncio
import math
from enum import Enum, auto

from drivers.codecs.cia402 import FEED, FEED_SHAFT_TURNS, HOMING_METHOD, HOMING_SPEED_ZERO
from drivers.codecs.sdo import Entry
from sim.canopen.dictionary import ObjectDictionary
from sim.interfaces import TableMechanism

HOMING_ACCELERATION = Entry(0x609A)
#: Homing on the index mark, turning down or up, and on the present position (CiA 402-2, 9.4).
INDEX_BELOW, INDEX_ABOVE, HERE = 33, 34, frozenset({35, 37})

_AT_MARK_RAD = math.radians(0.5)  # so close, the index pulse is seen at once
_COASTING_RAD_S2 = math.radians(240.0)  # the gear's friction, without the motor's torque
_STEP_S = 0.001  # of the velocity's difference quotient
#: The encoder sits on the motor: it does not see what the gearing adds behind it.
_IN_POSITION_RAD = math.radians(0.02)


class Motion(Enum):
    """What the motor is doing."""

    NONE = auto()
    MOVE = auto()
    HOMING = auto()
    ENDING = auto()  # decelerating, and nothing follows


class Motor:
    """Turns the mechanism and counts position units, from 0 where it stood at power-up.

    Args:
        objects: Where its speeds and accelerations stand.
        mechanism: The plate; homing turns it to its reference mark, its angle 0 modulo a turn.

    Attributes:
        motion: What it is doing, as of the last call of :meth:`ended`.
    """

    def __init__(self, objects: ObjectDictionary, mechanism: TableMechanism) -> None:
        self._objects, self._mechanism = objects, mechanism
        turn_units = objects.number(FEED) / objects.number(FEED_SHAFT_TURNS)
        self._rad_per_unit = 2 * math.pi / turn_units
        self._zero_rad = mechanism.angle_at(mechanism.end_s)
        self._target_rad = math.nan
        self.motion = Motion.NONE

    @property
    def moving(self) -> bool:
        """Return whether a motion was under way when last looked at."""
        return self.motion is not Motion.NONE

    @property
    def stalled(self) -> bool:
        """Return whether the last motion was blocked."""
        return self._mechanism.stalled

    def restart(self) -> None:
        """Begin as at power-up: the plate coasts to a stop, and the counter is 0 here."""
        self.coast()
        self.motion, self._target_rad = Motion.NONE, math.nan
        self._zero_rad = self._mechanism.angle_at(_now_s())

    def ended(self) -> Motion:
        """Return the motion that has just come to its end, once; ``NONE`` if none has."""
        if not self.moving or _now_s() < self._mechanism.end_s:
            return Motion.NONE
        homed = self.motion is Motion.HOMING and not self.stalled
        if homed and abs(off_rad := self._mark_moved_rad()) > _IN_POSITION_RAD:
            # The plate has slipped meanwhile: back to where the mark was seen, or on to it.
            mark_rad = self._target_rad + off_rad
            self._turn(Motion.HOMING, mark_rad, HOMING_SPEED_ZERO, HOMING_ACCELERATION)
            return Motion.NONE
        motion, self.motion = self.motion, Motion.NONE
        if homed:
            self._zero_rad = self._target_rad
        return motion

    def position(self) -> int:
        """Return 6064h: at rest near its target, the servo holds the encoder there."""
        return round((self._angle_rad() - self._zero_rad) / self._rad_per_unit)

    def velocity(self) -> int:
        """Return 606Ch, position units per second."""
        now_s = _now_s()
        if now_s >= self._mechanism.end_s:
            return 0
        angle_at = self._mechanism.angle_at
        return round((angle_at(now_s) - angle_at(now_s - _STEP_S)) / _STEP_S / self._rad_per_unit)

    def move_to(self, position: int, speed: Entry, acceleration: Entry) -> None:
        """Begin to turn to a position."""
        target_rad = self._zero_rad + position * self._rad_per_unit
        self._turn(Motion.MOVE, target_rad, speed, acceleration)

    def home(self) -> bool:
        """Begin homing; return whether that was all, for the reference is the present position."""
        method = self._objects.number(HOMING_METHOD)
        if method in HERE:
            self._zero_rad = self._angle_rad()
            return True
        here_rad = self._mechanism.angle_at(_now_s())
        above_rad = self._mechanism.past_mark_rad(_now_s())
        if abs(above_rad) > _AT_MARK_RAD:
            above_rad %= 2 * math.pi
            above_rad -= 2 * math.pi if method == INDEX_ABOVE else 0.0
        mark_rad = here_rad - above_rad
        self._turn(Motion.HOMING, mark_rad, HOMING_SPEED_ZERO, HOMING_ACCELERATION)
        return False

    def decelerate(self, ramp: Entry) -> None:
        """Break the motion off on a ramp."""
        self._stop(self._rad_s(ramp))

    def coast(self) -> None:
        """Break the motion off by taking the torque away."""
        self._stop(_COASTING_RAD_S2)

    def _stop(self, acceleration_rad_s2: float) -> None:
        if self.moving:
            self.motion = Motion.ENDING
            self._mechanism.stop(acceleration_rad_s2, _now_s())

    def _turn(self, motion: Motion, target_rad: float, speed: Entry, acceleration: Entry) -> None:
        self.motion, self._target_rad = motion, target_rad
        speed_rad_s, acceleration_rad_s2 = self._rad_s(speed), self._rad_s(acceleration)
        self._mechanism.move_to(target_rad, speed_rad_s, acceleration_rad_s2, _now_s())

    def _mark_moved_rad(self) -> float:
        now_s = _now_s()
        mark_rad = self._mechanism.angle_at(now_s) - self._mechanism.past_mark_rad(now_s)
        return math.remainder(mark_rad - self._target_rad, 2 * math.pi)

    def _angle_rad(self) -> float:
        now_s = _now_s()
        angle_rad = self._mechanism.angle_at(now_s)
        near = abs(angle_rad - self._target_rad) < _IN_POSITION_RAD
        return self._target_rad if near and now_s >= self._mechanism.end_s else angle_rad

    def _rad_s(self, entry: Entry) -> float:
        """Return a speed in rad/s, or an acceleration in rad/s^2."""
        return self._objects.number(entry) * self._rad_per_unit


def _now_s() -> float:
    return asyncio.get_running_loop().time()
