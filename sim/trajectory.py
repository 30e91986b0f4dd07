"""The course of a motor: trapezoidal moves and decelerations, from any angle and speed."""

import math
from dataclasses import dataclass, replace

CONTACT_RAD = 1e-9  # touching; a stalled plate rests twice as far off, on the side it came from


@dataclass(frozen=True, slots=True)
class Segment:
    """From ``start_s`` on: constant acceleration, or rest with a deflection being released."""

    start_s: float
    angle_rad: float
    rate_rad_s: float = 0.0
    acceleration_rad_s2: float = 0.0
    released_rad: float = 0.0


def trapezoid(
    here: Segment,
    target_rad: float,
    speed_rad_s: float,
    acceleration_rad_s2: float,
    deflection_rad: float,
) -> list[Segment]:
    """Plan the quickest way to rest at a target, from any angle and speed.

    Speed up (or down, or first back) to the peak, cruise, decelerate; then the plate's lead over
    the motor is released, so the deceleration ends that much beyond the target (but never more
    than the braking distance of a small triangle: half its length). With v the present speed
    towards it, the peak speed p of a triangle over the distance D is ``p^2 = a D + v^2/2``.
    """
    braking_rad = here.rate_rad_s * abs(here.rate_rad_s) / (2 * acceleration_rad_s2)
    ahead_rad = target_rad - here.angle_rad - braking_rad
    if abs(ahead_rad) < CONTACT_RAD:
        return deceleration(here, acceleration_rad_s2, deflection_rad)
    sign = math.copysign(1.0, ahead_rad)
    deflection_rad = min(deflection_rad, abs(ahead_rad) / 2)
    distance_rad = sign * (target_rad - here.angle_rad) + deflection_rad
    v, a = sign * here.rate_rad_s, acceleration_rad_s2
    peak = min(speed_rad_s, math.sqrt(a * distance_rad + v * v / 2))
    ramp_s = abs(peak - v) / a
    cruise_rad = distance_rad - (v + peak) / 2 * ramp_s - peak * peak / (2 * a)
    cruise_s = max(0.0, cruise_rad / peak)

    accelerating = replace(here, acceleration_rad_s2=sign * math.copysign(a, peak - v))
    cruising = _next(accelerating, ramp_s, 0.0)
    braking = _next(cruising, cruise_s, -sign * a)
    return [accelerating, cruising, *_rest(braking, -sign * deflection_rad, peak / a)]


def deceleration(here: Segment, acceleration_rad_s2: float, deflection_rad: float) -> list[Segment]:
    """Plan the quickest way to rest; the deflection released is that of the deceleration."""
    if here.rate_rad_s == 0:
        return [replace(here, acceleration_rad_s2=0.0)]
    sign = math.copysign(1.0, here.rate_rad_s)
    braking = replace(here, acceleration_rad_s2=-sign * acceleration_rad_s2)
    duration_s = abs(here.rate_rad_s) / acceleration_rad_s2
    released_rad = min(deflection_rad, abs(here.rate_rad_s) * duration_s / 2)
    return _rest(braking, -sign * released_rad, duration_s)


def _next(segment: Segment, duration_s: float, acceleration_rad_s2: float) -> Segment:
    rate_rad_s = segment.rate_rad_s + segment.acceleration_rad_s2 * duration_s
    angle_rad = segment.angle_rad + (segment.rate_rad_s + rate_rad_s) / 2 * duration_s
    return Segment(segment.start_s + duration_s, angle_rad, rate_rad_s, acceleration_rad_s2)


def _rest(braking: Segment, released_rad: float, duration_s: float) -> list[Segment]:
    end = _next(braking, duration_s, 0.0)
    return [braking, replace(end, rate_rad_s=0.0, released_rad=released_rad)]


def crossings(segment: Segment, limit_rad: float, duration_s: float) -> list[float]:
    """Return when a segment passes an angle, seconds after its start, while it lasts."""
    half, rate = segment.acceleration_rad_s2 / 2, segment.rate_rad_s
    offset = segment.angle_rad - limit_rad
    discriminant = rate * rate - 4 * half * offset
    if discriminant < 0 or (half == 0 and rate == 0):
        return []
    # The numerically stable pair of roots; the linear case is the second with half = 0.
    q = -(rate + math.copysign(math.sqrt(discriminant), rate)) / 2
    roots = [q / half] if half else []
    roots += [offset / q] if q else []
    return [root for root in roots if 0 <= root <= duration_s]
