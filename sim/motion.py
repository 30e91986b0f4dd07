"""The turning plate: where it is, how it rings after a move, and what can hinder it.

The motor's angle is what its encoder sees; a plate that has slipped stands elsewhere.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from drivers.interfaces import FloatArray
from sim.slipping import Slipping
from sim.trajectory import CONTACT_RAD, Segment, crossings, deceleration, trapezoid

_HISTORY_S = 10.0  # sensors ask about the last burst only, milliseconds ago
_TURN_RAD = 2 * math.pi


@dataclass(frozen=True, slots=True)
class Ringing:
    """How the plate swings on the gearing's spring once the motor stands.

    Under a deceleration a the plate leads the motor by ``a/omega^2``; when the motor stops, that
    deflection is released and dies away as the step response of a damped oscillator.

    Attributes:
        frequency_hz: Undamped natural frequency.
        damping_ratio: Of critical damping, below 1.
        share: How much of the static deflection rings; a drive that rounds its ramps leaves
            little of it.
    """

    frequency_hz: float = 12.0
    damping_ratio: float = 0.2
    share: float = 0.1

    @property
    def omega_rad_s(self) -> float:
        """Return the undamped natural frequency in rad/s."""
        return _TURN_RAD * self.frequency_hz

    @property
    def lasts_s(self) -> float:
        """Return for how long it can be told from standing still, to a double's last bit."""
        return -math.log(math.ulp(1.0) / 8) / (self.damping_ratio * self.omega_rad_s)

    def deflection_rad(self, acceleration_rad_s2: float) -> float:
        """Return the deflection that is released when a deceleration ends."""
        return self.share * acceleration_rad_s2 / self.omega_rad_s**2

    def released(self, elapsed_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the released share of the deflection, and its rate per s.

        The unit step response of a damped oscillator: it begins at 0 with rate 0, ends at 1.
        """
        decay = self.damping_ratio * self.omega_rad_s
        damped = self.omega_rad_s * math.sqrt(1 - self.damping_ratio**2)
        envelope, phase = np.exp(-decay * elapsed_s), damped * elapsed_s
        step = 1 - envelope * (np.cos(phase) + decay / damped * np.sin(phase))
        return step, envelope * (self.omega_rad_s**2 / damped) * np.sin(phase)


_GEARED = Ringing()


class Plate:
    """The table's plate under the motor's control; implements ``TableMechanism``.

    Its past is kept for some seconds, so that sensors may ask where it was when they sampled.

    Args:
        angle_rad: Where it stands at power-up.
        error_sigma_rad: Positioning error of each move, 1 sigma.
        random: Seeded; draws the errors.
        ringing: How it settles.
    """

    def __init__(
        self,
        angle_rad: float,
        error_sigma_rad: float,
        random: Generator,
        ringing: Ringing = _GEARED,
    ) -> None:
        self._error_sigma_rad = error_sigma_rad
        self._random = random
        self._ringing = ringing
        self._target_rad = angle_rad
        self._error_rad = 0.0
        self._short_rad = 0.0
        self._slipping = Slipping()
        self._slip_per_move_rad = 0.0
        self._block_rad: float | None = None
        self._stalled = False
        self._told_s = 0.0
        self._plan = [Segment(0.0, angle_rad)]
        self._keep(self._plan)

    @property
    def end_s(self) -> float:
        """Return the loop time at which the present motion ends, or ended."""
        return self._segments[-1].start_s

    @property
    def stalled(self) -> bool:
        """Return whether the last motion was, or is going to be, blocked where it ends."""
        return self._stalled

    @property
    def blocked_rad(self) -> float | None:
        """Return where an obstacle stands, if one does."""
        return self._block_rad

    @property
    def short_rad(self) -> float:
        """Return how much before its target every move ends."""
        return self._short_rad

    @property
    def slipped_rad(self) -> float:
        """Return how far the plate stands ahead of the motor, counter-clockwise."""
        return self._slipping.total_rad

    @property
    def slip_per_move_rad(self) -> float:
        """Return by how much every move slips."""
        return self._slip_per_move_rad

    def angle_rad(self, time_s: FloatArray) -> FloatArray:
        """Return the plate's angle at each time, counter-clockwise from above, no wrap.

        Args:
            time_s: Loop times, up to now and at most ten seconds old, any shape.
        """
        return self._motor_rad(time_s) + self._slipping.slipped_rad(time_s)

    def _motor_rad(self, time_s: FloatArray) -> FloatArray:
        start, angle, rate, acceleration, released = self._columns(time_s)
        elapsed = np.maximum(time_s - start, 0.0)
        step, _ = self._ringing.released(elapsed)
        turned = angle + elapsed * (rate + elapsed * acceleration / 2)
        settled: FloatArray = turned + released * step
        return settled

    def resting_rad(self, from_s: float) -> float | None:
        """Return the angle at which the plate stands, motionless since that time; else None."""
        rest = self._segments[-1]
        if from_s < max(rest.start_s + self._ringing.lasts_s, self._slipping.end_s):
            return None
        return rest.angle_rad + rest.released_rad + self._slipping.total_rad

    def rate_rad_s(self, time_s: FloatArray) -> FloatArray:
        """Return the motor's rate at each time; a stall ends it abruptly."""
        start, _, rate, acceleration, released = self._columns(time_s)
        elapsed = np.maximum(time_s - start, 0.0)
        _, step_rate = self._ringing.released(elapsed)
        turning: FloatArray = rate + elapsed * acceleration + released * step_rate
        return turning

    def angle_at(self, time_s: float) -> float:
        """Return the motor's angle at one time: what its encoder sees."""
        return float(self._motor_rad(np.array(time_s)))

    def past_mark_rad(self, time_s: float) -> float:
        """Return how far the plate has turned past its reference mark, within half a turn."""
        return math.remainder(float(self.angle_rad(np.array(time_s))), _TURN_RAD)

    def move_to(
        self, angle_rad: float, speed_rad_s: float, acceleration_rad_s2: float, now_s: float
    ) -> None:
        """Begin a trapezoidal move from the present angle and speed.

        Raises:
            ValueError: Speed or acceleration is not positive.
        """
        if speed_rad_s <= 0 or acceleration_rad_s2 <= 0:
            limits = f"{speed_rad_s} rad/s, {acceleration_rad_s2} rad/s^2"
            msg = f"a move needs a positive speed and acceleration, not {limits}"
            raise ValueError(msg)
        if angle_rad != self._target_rad:  # a motor already at its target does not turn again
            self._error_rad = self._error_sigma_rad * self._random.standard_normal()
            if self._slip_per_move_rad:
                way = angle_rad - self.angle_at(now_s)
                self.slip_by(-math.copysign(self._slip_per_move_rad, way), now_s)
        self._target_rad = angle_rad
        here = self._state(now_s)
        target_rad = _short_of(angle_rad + self._error_rad, here.angle_rad, self._short_rad)
        deflection_rad = self._ringing.deflection_rad(acceleration_rad_s2)
        self._follow(trapezoid(here, target_rad, speed_rad_s, acceleration_rad_s2, deflection_rad))

    def stop(self, acceleration_rad_s2: float, now_s: float) -> None:
        """Begin to decelerate; a plate whose motion has ended stays as it is."""
        if now_s >= self.end_s:
            return
        deflection_rad = self._ringing.deflection_rad(acceleration_rad_s2)
        self._target_rad = math.nan  # wherever it comes to rest, the next move is a new one
        self._follow(deceleration(self._state(now_s), acceleration_rad_s2, deflection_rad))

    def block_at(self, angle_rad: float | None) -> None:
        """Put an obstacle where the index mark would pass this angle, modulo a turn; None clears.

        It meets a motion under way too, from the last moment on about which anybody asked.
        """
        self._block_rad = angle_rad
        told_s = self._told_s
        if told_s < self.end_s:
            ahead = (segment for segment in self._plan if segment.start_s > told_s)
            self._follow([self._state(told_s), *ahead])

    def fall_short_by(self, error_rad: float) -> None:
        """Let every move from now on end this much before its target; 0 mends it."""
        self._short_rad = error_rad

    def slip_by(self, angle_rad: float, now_s: float) -> None:
        """Let the plate turn on its motor by so much, within a twentieth of a second."""
        self._slipping.slip_by(angle_rad, now_s)

    def slip_every_move_by(self, angle_rad: float) -> None:
        """Let the plate stay behind by so much whenever the motor sets out; 0 mends it."""
        self._slip_per_move_rad = angle_rad

    def _state(self, time_s: float) -> Segment:
        """Return the motion at a time: a segment that begins there and goes on as it did."""
        now = np.array(time_s)
        acceleration_rad_s2 = float(self._columns(now)[3])
        return Segment(
            time_s, float(self._motor_rad(now)), float(self.rate_rad_s(now)), acceleration_rad_s2
        )

    def _follow(self, plan: list[Segment]) -> None:
        """Replace the future by a plan, cut where an obstacle stands in its way."""
        self._plan, start_s = plan, plan[0].start_s
        self._told_s = start_s
        stall = self._first_contact(plan)
        self._stalled = stall is not None
        if stall is not None:
            plan = [*(segment for segment in plan if segment.start_s < stall.start_s), stall]
        past = [segment for segment in self._segments if segment.start_s < start_s]
        oldest = sum(segment.start_s <= start_s - _HISTORY_S for segment in past)
        self._keep(past[max(0, oldest - 1) :] + plan)

    def _first_contact(self, plan: list[Segment]) -> Segment | None:
        """Return the rest against the obstacle that a plan runs into, if it does."""
        if self._block_rad is None:
            return None
        block_rad = self._block_rad - self._slipping.total_rad
        ahead_rad = (block_rad - plan[0].angle_rad) % _TURN_RAD or _TURN_RAD
        above_rad = plan[0].angle_rad + ahead_rad
        sides = ((above_rad, -CONTACT_RAD), (above_rad - _TURN_RAD, CONTACT_RAD))
        for segment, following in pairwise(plan):
            duration_s = following.start_s - segment.start_s
            contacts = [
                (elapsed_s, obstacle_rad + 2 * gap_rad)
                for obstacle_rad, gap_rad in sides
                for elapsed_s in crossings(segment, obstacle_rad + gap_rad, duration_s)
            ]
            if contacts:
                elapsed_s, rest_rad = min(contacts)
                return Segment(segment.start_s + elapsed_s, rest_rad)
        return None

    def _keep(self, segments: list[Segment]) -> None:
        self._segments = segments
        rows = [
            (s.start_s, s.angle_rad, s.rate_rad_s, s.acceleration_rad_s2, s.released_rad)
            for s in segments
        ]
        self._table: FloatArray = np.array(rows).T

    def _columns(self, time_s: FloatArray) -> FloatArray:
        """Return start, angle, rate, acceleration and release of the segment at each time."""
        self._told_s = max(self._told_s, float(np.max(time_s)))
        index = np.searchsorted(self._table[0], time_s, side="right") - 1
        columns: FloatArray = self._table[:, np.maximum(index, 0)]
        return columns


def _short_of(target_rad: float, here_rad: float, short_rad: float) -> float:
    distance_rad = target_rad - here_rad
    return target_rad - math.copysign(min(short_rad, abs(distance_rad)), distance_rad)
