"""The fault matrix as a table on the terminal, and as the measured part of ``docs/faults.md``.

``python -m northfinder.proof.fault_report docs/faults.md`` measures it and writes it there.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.table import Table

from northfinder.proof.fault_cells import MOMENTS
from northfinder.proof.fault_kinds import RigName
from northfinder.proof.fault_matrix import SEEDS, Matrix, cells, figures, measure
from northfinder.proof.fault_words import LEGEND, rows, sentences
from northfinder.proof.figure import Figure

_RIGS: Final[dict[RigName, str]] = {
    "serial": "Serial rig (Zaber, KVH 1750, STIM300)",
    "can": "CAN rig (CiA 402, DBC gyro, CiA 410)",
}
_BEGIN, _END = "<!-- measured -->\n", "<!-- end -->\n"


def faults() -> Iterator[Figure]:
    """Whole runs with every fault at every moment, on both rigs; the matrix is shown first."""
    matrix = measure(cells(SEEDS))
    print_matrix(Console(), matrix)
    yield from figures(matrix)


def print_matrix(console: Console, matrix: Matrix) -> None:
    """Show the matrix, a table a rig, and then what a user is told of each fault."""
    for rig, title in _RIGS.items():
        table = Table(title=title, box=None, pad_edge=False, header_style="dim")
        for heading in ("fault", "size", *MOMENTS):
            table.add_column(heading)
        for row in rows(matrix, rig):
            table.add_row(*row)
        console.print(table, "")
    console.print(LEGEND.replace("`", ""), "")
    told = Table("fault", "what the user is told", box=None, pad_edge=False, header_style="dim")
    for name, sentence in sentences(matrix):
        told.add_row(name, sentence)
    console.print(told, "")


def markdown(matrix: Matrix) -> str:
    """Return the same as Markdown, with the figures."""
    return "\n".join(_lines(matrix)) + "\n"


def _lines(matrix: Matrix) -> Iterator[str]:
    yield from ("", LEGEND, "")
    for rig, title in _RIGS.items():
        yield from (f"### {title}", "")
        yield from _table(["fault", "size", *MOMENTS], rows(matrix, rig))
    yield from ("### What the user is told", "")
    yield from _table(["fault", "for example"], map(list, sentences(matrix)))
    yield from ("### Figures", "")
    held = ([f.name, f"{f.value:g} {f.unit}", f.required] for f in figures(matrix))
    yield from _table(["figure", "measured", "required"], held)


def _table(headings: list[str], body: Iterator[list[str]]) -> Iterator[str]:
    yield f"| {' | '.join(headings)} |"
    yield f"|{'---|' * len(headings)}"
    for row in body:
        yield f"| {' | '.join(cell.replace('|', '/') for cell in row)} |"
    yield ""


def _write(path: Path) -> None:
    before, begin, rest = path.read_text(encoding="utf-8").partition(_BEGIN)
    _, end, after = rest.partition(_END)
    if not (begin and end):
        sys.exit(f"{path} has no lines {_BEGIN.strip()} and {_END.strip()} to write between")
    measured = markdown(measure(cells(SEEDS)))
    path.write_text(f"{before}{begin}{measured}{end}{after}", encoding="utf-8")


if __name__ == "__main__":
    _write(Path(*sys.argv[1:]))
