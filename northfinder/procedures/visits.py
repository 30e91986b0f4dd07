"""The order of visits, and what one visit brought."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise, takewhile
from typing import Final, Literal

import numpy as np

from northfinder.samples import Samples, Stream

#: "spread" and "rotation" follow from the plan's target and its modulation; nobody asks for them.
Order = Literal["sequential", "out-and-back", "opposite", "spread", "rotation"]
AnyOrder = Literal["sequential", "out-and-back", "opposite", "auto"]
Direction = Literal["out", "back"]


@dataclass(frozen=True, slots=True)
class PlannedVisit:
    """One stop of the table."""

    index: int
    angle_rad: float
    direction: Direction
    dwell_s: float


@dataclass(frozen=True)
class Visit:
    """One measurement at one angle.

    Attributes:
        index: Place in time order, from 0, through all segments.
        segment: Between interruptions the gyro's bias is taken as one; each has its own R.
        direction: On the way out or back.
        angle_rad: The table's, counter-clockwise from the index mark.
        start_s: From the start of the run to the first sample.
        turned_rad: How far the gyro saw the table turn on the way here, counter-clockwise;
            None where it cannot tell.
        gyro: rad/s.
        accelerometer: Standard gravities.
        repeats: Index of the earlier visit whose angle this one measures again, to see that
            nothing moved; None for a visit of the plan.
    """

    index: int
    segment: int
    direction: Direction
    angle_rad: float
    start_s: float
    turned_rad: float | None
    gyro: Samples
    accelerometer: Samples
    repeats: int | None = None

    @property
    def streams(self) -> Mapping[Stream, Samples]:
        """Return the samples as they are kept."""
        return {"gyro": self.gyro, "accelerometer": self.accelerometer}

    @cached_property
    def time_s(self) -> float:
        """Return the middle of the visit, from the start of the run.

        The samples' own times will not do: they begin anew with every process.
        """
        return self.start_s + float(np.mean(self.gyro.time_s - self.gyro.time_s[0]))

    @cached_property
    def duration_s(self) -> float:
        """Return its length by the gyro's clock, lost samples included."""
        return duration_s(self.gyro)


def duration_s(samples: Samples) -> float:
    """Return how long samples were collected by the device's clock, lost ones included."""
    ticks = int(samples.tick[-1] - samples.tick[0])
    return float(samples.time_s[-1] - samples.time_s[0]) / ticks * samples.expected


def legs(visits: Sequence[PlannedVisit]) -> list[int]:
    """Number the passages, from 0: one ends where the direction changes."""
    ways = [visit.direction for visit in visits]
    turns = [before != after for before, after in pairwise(ways)]
    return list(accumulate(turns, initial=0))


def rest_of_passage(visits: Sequence[PlannedVisit], done: int) -> list[PlannedVisit]:
    """Return the visits from the first that is not done to where the direction changes."""
    way = visits[done].direction
    return list(takewhile(lambda visit: visit.direction == way, visits[done:]))


def schedule(positions: int, dwell_s: float, order: Order, revolutions: int) -> list[PlannedVisit]:
    """Return the visits in time order; every angle gets ``dwell_s`` in all, in equal shares.

    ``sequential`` goes round once a revolution, as the paper `levelling` does. ``out-and-back``
    returns over the same angles, which is orthogonal to a drift linear in time. ``opposite``
    takes each angle together with the one half a turn away, and returns: what both share (bias
    that wanders slowly) drops out before it has wandered. ``spread`` does so too, each pair far
    from those before it, so that the run may end after any. ``rotation`` passes the middles of
    the sectors out and back, without a stop.

    Angles stay within one turn, so that cables do not wind up.
    """
    steps = _STEPS.get(order, range)(positions)
    leg_out: list[tuple[int, Direction]] = [(step, "out") for step in steps]
    leg_back: list[tuple[int, Direction]] = [(step, "back") for step in reversed(steps)]
    legs = leg_out if order == "sequential" else leg_out + leg_back
    share_s = dwell_s / (revolutions * (1 if order == "sequential" else 2))
    first_rad = math.pi / positions if order == "rotation" else 0.0
    return [
        PlannedVisit(index, first_rad + 2 * math.pi * step / positions, direction, share_s)
        for index, (step, direction) in enumerate(legs * revolutions)
    ]


def _opposite_pairs(positions: int) -> list[int]:
    """0, n/2, 1, n/2 + 1, ...; with an odd n the last stands alone."""
    half = positions // 2
    pairs = [step for first in range(half) for step in (first, first + half)]
    return [*pairs, positions - 1] if positions % 2 else pairs


def _spread_pairs(positions: int) -> list[int]:
    """Opposite pairs, their first angles in van der Corput's order (0, n/4, n/8, 3n/8, ...).

    Every second pair begins at its far end, which lies nearer to the one before.
    """
    half = positions // 2
    bits = (half - 1).bit_length()
    reversed_bits = (int(f"{k:0{bits + 1}b}"[:0:-1] or "0", 2) for k in range(2**bits))
    steps: list[int] = []
    for place, first in enumerate(step for step in reversed_bits if step < half):
        pair = (first, first + half)
        steps += pair if place % 2 == 0 else pair[::-1]
    return [*steps, positions - 1] if positions % 2 else steps


_STEPS: Final[Mapping[Order, Callable[[int], Sequence[int]]]] = {
    "opposite": _opposite_pairs,
    "spread": _spread_pairs,
}
