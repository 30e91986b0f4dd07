"""One claim of a paper, what was measured of it, and the verdict."""

import re
from dataclasses import dataclass
from enum import StrEnum

from northfinder.errors import NorthfinderError


class StudyError(NorthfinderError):
    """The figures measured now do not bear a verdict out: it is not stated."""


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    NOT_REPRODUCED = "not reproduced"
    MISPRINT = "misprint"
    BEYOND = "beyond the paper"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A figure and how it is written.

    Attributes:
        value: In ``unit``.
        unit: As in a name: ``deg``, ``arcmin``, ``arcsec``, ``deg/h``, ``m``; empty for a number.
        form: Format of the value, with the digits that every machine gives.
        below: Where the value is rounding error or chance: the limit that is written instead.
    """

    value: float
    unit: str = ""
    form: str = ".3g"
    below: float | None = None

    def __post_init__(self) -> None:
        if self.below is not None and not abs(self.value) < self.below:
            msg = f"{self.value:g} {self.unit} was measured where it stays below {self.below:g}"
            raise StudyError(msg)

    @property
    def number(self) -> str:
        """The value without its unit."""
        written = f"{self.value:{self.form}}" if self.below is None else f"< {self.below:g}"
        return re.sub(r"e([-+])0*(?=\d)", r"e\1", written)

    def __str__(self) -> str:
        return f"{self.number} {self.unit}".strip()


@dataclass(frozen=True, slots=True)
class Claim:
    """One line of a study.

    Attributes:
        where: In the paper: an equation, a figure, a table.
        says: What it says there, in our words.
        conditions: Under which; empty where the study's own hold.
        printed: The figure in print; None where there is none.
        ours: The figure measured.
        verdict: What became of it.
        reason: Why, in a sentence.
        holds: Whether what was measured bears the verdict out.

    Raises:
        StudyError: It does not.
    """

    where: str
    says: str
    conditions: str
    printed: Quantity | None
    ours: Quantity
    verdict: Verdict
    reason: str
    holds: bool

    def __post_init__(self) -> None:
        if not self.holds:
            msg = f"{self.where}: {self.ours} does not bear out the verdict {self.verdict.value!r}"
            raise StudyError(msg)


def agrees(ours: float, printed: float, within: float) -> bool:
    """Say whether a figure agrees with the printed one within a share of it."""
    return abs(ours - printed) <= within * abs(printed)
