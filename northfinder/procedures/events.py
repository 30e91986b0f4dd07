"""What a running procedure tells whoever watches it."""

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from northfinder.estimators.checks import Check
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.tilt import TiltEstimate
from northfinder.procedures.fits import Search
from northfinder.procedures.visits import Visit
from northfinder.units import DEG

Phase = Literal["homing", "proving", "measuring", "solving", "recording", "aligning", "holding"]

_STANDING: Final = {
    "homing": "finding the table's reference",
    "solving": "solving for north",
    "recording": "recording while everything stands still",
    "aligning": "aligning",
    "holding": "holding the heading",
}


@dataclass(frozen=True, slots=True)
class Progress:
    """How far the run is in time, and what it does now.

    Attributes:
        fraction: Of the plan, 0 to 1.
        left_s: Until the end.
        phase: What it does now; "proving" is measuring again, to see that nothing moved.
        visit: Which visit of the plan is under way or comes next, from 1.
        visits: How many the plan has.
        angle_rad: Where the table is measured; None where it is not turned.
    """

    fraction: float
    left_s: float
    phase: Phase
    visit: int
    visits: int
    angle_rad: float | None

    def sentence(self) -> str:
        """Return what it does now, in words."""
        if self.angle_rad is None:
            return _STANDING[self.phase]
        where = f"{self.angle_rad / DEG:g} deg"
        if self.phase == "proving":
            return f"measuring {where} again, to see that nothing moved"
        return f"measuring at {where}"


@dataclass(frozen=True, slots=True)
class VisitCompleted:
    """A visit with its raw samples; to be kept before the next one begins."""

    visit: Visit


@dataclass(frozen=True, slots=True)
class Estimate:
    """North so far, told after each visit of the plan once three angles determine it.

    Attributes:
        azimuth_rad: Of the index mark, [0, 2 pi).
        sigma_rad: Its standard uncertainty, by the scatter within the visits.
        visits: How many it was computed from.
        searches: Which were left out, by sensor.
        gyro: Fit of the rate, rad/s.
        tilt: Of the table.
        checks: Those that can be judged before the end.
    """

    azimuth_rad: float
    sigma_rad: float
    visits: int
    searches: Sequence[Search]
    gyro: HarmonicFit
    tilt: TiltEstimate
    checks: Sequence[Check]


@dataclass(frozen=True, slots=True)
class SoFar:
    """What another procedure knows so far, in its result's own names."""

    numbers: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Warned:
    """Something that whoever watches should know, as a sentence."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Paused:
    """The table stands and the run waits at its gate."""


@dataclass(frozen=True, slots=True)
class Resumed:
    """The gate has opened after so long; what follows may open a segment."""

    paused_s: float


@dataclass(frozen=True, slots=True)
class SegmentOpened:
    """After an interruption the bench was found where it was, as far as could be seen.

    Attributes:
        segment: The new one.
        proof: What was compared, and how large a turn and a tilt would have shown.
    """

    segment: int
    proof: str

    def sentence(self) -> str:
        """Return it in words."""
        return f"After an interruption the gyro's bias is taken anew. {self.proof}"


Event = Progress | VisitCompleted | Estimate | SoFar | Warned | Paused | Resumed | SegmentOpened

#: Awaited for every event.
Emit = Callable[[Event], Awaitable[None]]
