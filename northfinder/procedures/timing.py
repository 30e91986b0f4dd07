"""How long moves and visits take, by the table's speed."""

import math
from collections.abc import Sequence

from drivers.interfaces import MotionLimits
from northfinder.procedures.visits import PlannedVisit

_SETTLING_S = 0.3  # at least: so much of the rate is compared
_LATE_S = 0.05  # commands, polls, and samples that come in bursts
_REST_S = 0.5  # before a steady turn: the gyro settles, and tells what it reads at rest
_STEADY_S = 0.5  # until the polled positions make a line
_TURN_RAD = 2 * math.pi


def homing_s(limits: MotionLimits) -> float:
    """Return the time to set aside for finding the table's reference: up to a turn."""
    return limits.move_s(_TURN_RAD)


def ends_s(
    visits: Sequence[PlannedVisit], settle_s: float, limits: MotionLimits, begin_s: float
) -> list[float]:
    """Return when each visit will be over, in s from the start of the run.

    Args:
        visits: In time order.
        settle_s: The plan's least wait after each move.
        limits: How fast the table turns.
        begin_s: When the table is homed, at angle zero.
    """
    now_s, angle_rad, ends = begin_s, 0.0, []
    for visit in visits:
        now_s += limits.move_s(abs(visit.angle_rad - angle_rad))
        now_s += max(settle_s, _SETTLING_S) + _LATE_S + visit.dwell_s
        angle_rad = visit.angle_rad
        ends.append(now_s)
    return ends


def lead_s(settle_s: float) -> float:
    """Return for how long a table that turns steadily turns before its first sector."""
    return max(settle_s, _SETTLING_S) + _STEADY_S


def lead_rad(speed_rad_s: float, settle_s: float, limits: MotionLimits) -> float:
    """Return how far it turns meanwhile, from rest."""
    return speed_rad_s * lead_s(settle_s) + speed_rad_s**2 / (2 * limits.acceleration_rad_s2)


def passage_ends_s(
    visits: Sequence[PlannedVisit], settle_s: float, limits: MotionLimits, begin_s: float
) -> list[float]:
    """Return when each sector will be past, of a table that turns out and back steadily."""
    width_rad = visits[1].angle_rad - visits[0].angle_rad
    lead = lead_rad(width_rad / visits[0].dwell_s, settle_s, limits)
    waiting_s = max(settle_s, _SETTLING_S) + _REST_S + lead_s(settle_s)
    now_s, way, ends = begin_s, None, []
    for visit in visits:
        if visit.direction != way:  # on from the end of the last passage, beyond its last sector
            now_s += waiting_s + (limits.move_s(lead) if way is None else lead_s(settle_s))
            way = visit.direction
        now_s += visit.dwell_s
        ends.append(now_s)
    return ends
