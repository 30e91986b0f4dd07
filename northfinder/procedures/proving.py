"""After an interruption: which angles to measure again, and whether the bench has moved.

A turn of the bench hides in a segment's new bias and shows in the difference between two angles;
`estimators/stillness.py` has the geometry, `docs/theory.md` what stays unseen.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from northfinder.config import RigConfig
from northfinder.errors import AcquisitionError, EstimationError
from northfinder.estimators.checks import Check
from northfinder.estimators.stillness import Stillness, choose_pair
from northfinder.procedures.fits import Fitted, fit_visits, scatter_within
from northfinder.procedures.plan import Plan
from northfinder.procedures.repeats import Noise, judge_segment, signal_of
from northfinder.procedures.segments import taking_part
from northfinder.procedures.visits import Visit
from northfinder.units import DEG

_TURN_TO_SEE_RAD = 2.0 * DEG
_SIGMAS_TO_SEE_IT = 7.0  # three more than the limit: once in a thousand it is missed
_LONGER = 3.0
_UNSEEN_RAD = 1.0  # a limit beyond this is none


@dataclass(frozen=True, slots=True)
class Witness:
    """A visit whose angle is to be measured again, and for how long."""

    visit: Visit
    dwell_s: float


def choose_witnesses(visits: Sequence[Visit], plan: Plan, config: RigConfig) -> list[Witness]:
    """Choose what to measure again before a new segment: two angles, where there are two.

    Of all visits that take part, the two of one segment whose difference a turn of the bench
    moves most against its noise; three times as long as the plan's where that would leave a
    turn of 2 deg in doubt. While north is not determined, the outermost two: so little is lost
    then that any two will do. One visit alone can show a tilt, and its own rate counts for
    nothing in the fit. Before the first visit there is nothing to lose.
    """
    used = taking_part(visits)
    dwell_s = plan.dwell_s / plan.visits_per_angle
    fitted = _fitted(visits, plan, config)
    if fitted is None:
        return [Witness(visit, dwell_s) for visit in _outermost(used)]
    used = list(fitted.used)  # what was disturbed the first time is no witness
    _, slope = signal_of(fitted, used, config)
    first, second = choose_pair(
        np.array([visit.angle_rad for visit in used]),
        np.array([visit.segment for visit in used]),
        slope,
    )
    shift = abs(slope[first] - slope[second]) * _TURN_TO_SEE_RAD
    sigma = 2.0 * Noise.of(used, fitted).rate_sqrt_s / math.sqrt(dwell_s)
    longer = 1.0 if shift >= _SIGMAS_TO_SEE_IT * sigma else _LONGER
    return [Witness(used[i], longer * dwell_s) for i in (first, second)]


def require_stillness(visits: Sequence[Visit], segment: int, plan: Plan, config: RigConfig) -> str:
    """Hold a new segment's repeats against the first time; return what was proved, in words.

    Raises:
        AcquisitionError: The bench has moved; the message says how, and what could be seen.
    """
    stillness = judge_segment(_fitted(visits, plan, config), visits, segment, config)
    again = _angles_in_words(visits, segment)
    if not stillness.moved:
        return f"Measured again at {again}: {_moves(stillness)}. {_limits(stillness)}"
    msg = (
        f"the bench has moved since the visits before the interruption: measured again at {again}, "
        f"{_moves(stillness)}. {_limits(stillness)} The earlier visits no longer hold: make the "
        f"bench stand firmly, and start a new run"
    )
    raise AcquisitionError(msg)


def check_stillness(fitted: Fitted, config: RigConfig) -> list[Check]:
    """Judge every later segment by its repeats once more, with all visits; none, no check."""
    segments = sorted({visit.segment for visit in fitted.used if visit.repeats is not None})
    if not segments:
        return []
    found = [judge_segment(fitted, fitted.visits, segment, config) for segment in segments]
    details = [
        f"Segment {segment + 1} measured again at {_angles_in_words(fitted.visits, segment)}: "
        f"{_moves(stillness)}. {_limits(stillness)}"
        for segment, stillness in zip(segments, found, strict=True)
    ]
    moved = any(stillness.moved for stillness in found)
    return [Check("interruptions", "warn" if moved else "pass", " ".join(details))]


def _fitted(visits: Sequence[Visit], plan: Plan, config: RigConfig) -> Fitted | None:
    try:
        return fit_visits(visits, plan, config, scatter_within)
    except EstimationError:  # too few angles yet: what can be proved without north, is
        return None


def _outermost(used: Sequence[Visit]) -> list[Visit]:
    """Return the longest segment's first visit, and its last at another angle if there is one."""
    counts = Counter(visit.segment for visit in used)
    inside = [visit for visit in used if counts[visit.segment] == max(counts.values())]
    others = [visit for visit in inside if visit.angle_rad != inside[0].angle_rad]
    return [*inside[:1], *others[-1:]]


def _angles_in_words(visits: Sequence[Visit], segment: int) -> str:
    repeats = [v for v in visits if v.segment == segment and v.repeats is not None]
    return " and ".join(f"{visit.angle_rad / DEG:g}" for visit in repeats) + " deg"


def _moves(stillness: Stillness) -> str:
    """Say what was seen to move."""
    seen = []
    if stillness.turned:
        way = "clockwise" if stillness.turned_rad > 0.0 else "counter-clockwise"
        known = math.isfinite(stillness.turned_rad)
        by = f" of about {abs(stillness.turned_rad) / DEG:.2g} deg {way}" if known else ""
        seen.append(f"the gyro shows a turn{by}")
    if stillness.tilted:
        seen.append(f"the accelerometer shows a tilt of about {stillness.tilted_rad / DEG:.2g} deg")
    return " and ".join(seen) or "nothing moved"


def _limits(stillness: Stillness) -> str:
    """Say how large a turn and a tilt would have been seen."""
    turn, tilt = stillness.turn_limit_rad, stillness.tilt_limit_rad
    a_turn, a_tilt = f"a turn of {turn / DEG:.2g} deg", f"a tilt of {tilt / DEG:.2g} deg"
    if max(turn, tilt) < _UNSEEN_RAD:
        return f"{a_turn.capitalize()} or {a_tilt} would have shown."
    if tilt < _UNSEEN_RAD:
        return f"{a_tilt.capitalize()} would have shown, but no turn."
    return "Neither a turn nor a tilt would be sure to have shown."
