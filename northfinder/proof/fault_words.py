"""The fault matrix in words: what to call a cell, and what a user is told of each fault."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from statistics import median

from northfinder.proof.fault_cells import MOMENTS, WRONG_SIGMAS, Outcome
from northfinder.proof.fault_kinds import FAULTS, RigName
from northfinder.proof.fault_matrix import Matrix

LEGEND = (
    f"`·` north within {WRONG_SIGMAS:g} stated sigma; `○` the same, and a check warns or fails; "
    "`▲` north is wrong and that check fails; `■` the run fails in its own words, so long after "
    "the fault; `✗` wrong and not told; `‼` a defect. Of several seeds the gravest is shown."
)
_FOLDER = re.compile(r"sqlite:\S*/")
_LONGEST = 240


def rows(matrix: Matrix, rig: RigName) -> Iterator[list[str]]:
    """Yield a row a fault of a rig: its name, its size, and a word for each moment."""
    for fault in FAULTS:
        groups = [matrix.get((fault.name, rig, moment), ()) for moment in MOMENTS]
        if any(groups):
            yield [fault.name, fault.size, *(word_of(group) for group in groups)]


def sentences(matrix: Matrix) -> Iterator[tuple[str, str]]:
    """Yield each fault that is told somewhere, and what the user is told: the gravest example."""
    for fault in FAULTS:
        told = [
            outcome
            for (name, _, _), group in matrix.items()
            if name == fault.name
            for outcome in group
            if outcome.said
        ]
        if told:
            yield fault.name, _shortened(max(told, key=_gravity).said)


def word_of(group: Sequence[Outcome]) -> str:
    """Return a symbol and a short word for the gravest outcome of all seeds."""
    if not group:
        return ""
    gravest = max(map(_gravity, group))
    alike = [outcome for outcome in group if _gravity(outcome) == gravest]
    match gravest:
        case 0:
            return "·"
        case 1 | 2:
            (remark, _), *_ = Counter(check for one in alike for check in one.checks).most_common()
            return f"{'○' if gravest == 1 else '▲'} {remark}"
        case 3:
            return f"■ {median(outcome.noticed_s for outcome in alike):.1f} s"
        case 4:
            return f"✗ {max(outcome.sigmas for outcome in alike):.1f} sigma, {len(alike)} times"
        case _:
            return f"‼ {alike[0].said}"


def _gravity(outcome: Outcome) -> int:
    """Rank an outcome: harmless, remarked, told by a check, failed in words, silent, defect."""
    if outcome.verdict == "harmless":
        return 1 if outcome.checks else 0
    if outcome.verdict == "told":
        return 2 if outcome.checks else 3
    return 4 if outcome.verdict == "silent" else 5


def _shortened(said: str) -> str:
    """Leave out where a database happened to be, and all after some sentences."""
    said = _FOLDER.sub("", said)
    if len(said) <= _LONGEST:
        return said
    return f"{said[:_LONGEST].rpartition(' ')[0]} …"
