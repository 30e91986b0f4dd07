"""What a running procedure tells whoever watches it."""

from dataclasses import dataclass

from northfinder.procedures.visits import Visit


@dataclass(frozen=True, slots=True)
class Progress:
    """How far the run is, 0 to 1, in time; and what it does now, in words."""

    fraction: float
    left_s: float
    doing: str


@dataclass(frozen=True, slots=True)
class VisitCompleted:
    """A visit with its raw samples; to be kept before the next one begins."""

    visit: Visit


@dataclass(frozen=True, slots=True)
class Estimate:
    """North so far."""

    azimuth_rad: float
    sigma_rad: float
    visits: int


Event = Progress | VisitCompleted | Estimate
