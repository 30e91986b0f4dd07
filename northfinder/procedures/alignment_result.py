"""What an alignment found, of the table that its instrument stands on."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from northfinder.alignment import Alignment
from northfinder.estimators.checks import Check
from northfinder.procedures.mounting import TableAttitude
from northfinder.rig import JsonObject


class Moment(NamedTuple):
    """What was known at one moment: how the table stood then, and the sigma of its azimuth."""

    time_s: float
    table: TableAttitude
    azimuth_sigma_rad: float
    level_sigma_rad: float


@dataclass(frozen=True, slots=True)
class Aligned:
    """An alignment that has come to its end.

    Attributes:
        alignment: Of the instrument.
        table: How the table stands at the end.
        history: Second by second.
        restarts: How often it began anew, after a gap in the samples.
        bridged: Samples that a straight line stands for.
        mean_force_g: Size of what the accelerometers read on the whole.
    """

    alignment: Alignment
    table: TableAttitude
    history: Sequence[Moment]
    restarts: int
    bridged: int
    mean_force_g: float


@dataclass(frozen=True, slots=True)
class AlignmentRun:
    """Everything that an alignment's samples tell.

    Attributes:
        aligned: The result.
        visits: What was kept, five seconds each, as the record lists it.
        checks: Verdicts in words.
        reference_offset_rad: From the index mark to the line whose azimuth is wanted.
    """

    aligned: Aligned
    visits: Sequence[JsonObject]
    checks: list[Check]
    reference_offset_rad: float
