"""A paper worked through."""

from collections.abc import Sequence
from dataclasses import dataclass

from northfinder.studies.chart import Chart
from northfinder.studies.claim import Claim, Quantity
from northfinder.studies.papers import PAPERS

Cell = str | Quantity | None


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of figures.

    Attributes:
        title: What they are.
        columns: Their headings.
        rows: Each with a cell for every column; the first names the row.
        repeatable: Whether every machine finds the same: durations are not.
    """

    title: str
    columns: tuple[str, ...]
    rows: Sequence[Sequence[Cell]]
    repeatable: bool = True


@dataclass(frozen=True, slots=True)
class Study:
    """One paper: its claims with their verdicts, tables and figures.

    Attributes:
        name: As the command has it, one of ``PAPERS``.
        summary: What holds and what does not, in a few sentences.
        conditions: Under which everything was measured, where a claim names no others.
        claims: In the paper's order, ours at the end.
        tables: Beside them.
        charts: The paper's figures with our curves, and ours.
    """

    name: str
    summary: str
    conditions: str
    claims: tuple[Claim, ...]
    tables: tuple[Table, ...]
    charts: tuple[Chart, ...]

    @property
    def title(self) -> str:
        """What the paper is about."""
        return PAPERS[self.name].title

    @property
    def paper(self) -> str:
        """Citation."""
        return PAPERS[self.name].citation

    @property
    def command(self) -> str:
        """The command that measures all this."""
        return f"northfinder study {self.name}"
