"""Segments: what an interruption parts a run into, and which of them the reduction uses."""

from collections.abc import Sequence

from northfinder.procedures.visits import Visit


def planned_visits(visits: Sequence[Visit]) -> list[Visit]:
    """Return the visits of the plan, without those that only measured again."""
    return [visit for visit in visits if visit.repeats is None]


def taking_part(visits: Sequence[Visit]) -> list[Visit]:
    """Return the visits that the result is computed from.

    A segment begins with repeats, and goes on to the plan only when they have shown that nothing
    moved. One that holds repeats alone was refused, or ended before its proof was of use: it
    takes no part.
    """
    proved = {visit.segment for visit in planned_visits(visits)}
    return [visit for visit in visits if visit.segment in proved]


def next_segment(visits: Sequence[Visit]) -> int:
    """Return the label of the segment to open after these."""
    return max((visit.segment for visit in visits), default=-1) + 1
