"""The fault matrix: every fault at every moment on both rigs, and what became of it.

``northfinder bench faults`` shows it, ``python -m northfinder.proof.fault_report`` writes it down.
"""

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from northfinder.proof.fault_cells import MOMENTS, Cell, Moment, Outcome, live
from northfinder.proof.fault_kinds import FAULTS, RigName
from northfinder.proof.figure import Figure

SEEDS = 5
_STANDS_WITHIN_S = 1.0  # of the end of the run: a stop from full speed takes a third of that
_CHUNK = 8

#: Fault, rig, moment: the outcomes of all seeds.
Matrix = Mapping[tuple[str, RigName, Moment], Sequence[Outcome]]
Place = tuple[str, RigName, Moment, int]


def cells(seeds: int = SEEDS) -> list[Place]:
    """Return every cell of the matrix, by what tells it apart."""
    return [
        (fault.name, rig, moment, seed)
        for fault in FAULTS
        for rig in fault.rigs
        for moment in MOMENTS
        for seed in range(1, seeds + 1)
    ]


def carry_out(place: Place) -> Outcome:
    """Carry one cell out; a process of a pool is handed names, for functions do not travel."""
    name, rig, moment, seed = place
    (fault,) = (fault for fault in FAULTS if fault.name == name)
    return live(Cell(fault, moment, rig, seed))


def measure(places: Sequence[Place], processes: int | None = None) -> Matrix:
    """Carry cells out on all cores; equal cells give equal outcomes.

    Args:
        places: Which ones.
        processes: How many at a time; by default one a core, and 1 is this one.
    """
    if processes == 1:
        return _gathered(zip(places, map(carry_out, places), strict=True))
    # spawn: a fork would take the parent's threads' locks along.
    with ProcessPoolExecutor(processes or os.cpu_count(), get_context("spawn")) as pool:
        outcomes = pool.map(carry_out, places, chunksize=_CHUNK)
        return _gathered(zip(places, outcomes, strict=True))


def figures(matrix: Matrix) -> Iterator[Figure]:
    """Hold the matrix against what is promised."""
    outcomes = [outcome for group in matrix.values() for outcome in group]
    silent = sum(outcome.verdict == "silent" for outcome in outcomes)
    known = sum(outcome.verdict in ("harmless", "told") for outcome in outcomes)
    stood = sum(stands(name, outcome) for (name, _, _), g in matrix.items() for outcome in g)
    count = len(outcomes)
    of = f"fault matrix, {count} runs"
    yield Figure(f"{of}: silent wrong azimuths", float(silent), "runs", None, 0.0)
    yield Figure(f"{of}: told or harmless", 100.0 * known / count, "%", 100.0, None)
    yield Figure(f"{of}: table stopped", 100.0 * stood / count, "%", 100.0, None)
    lost = sum(outcome.lost for outcome in outcomes)
    yield Figure(f"{of}: completed visits lost", float(lost), "visits", None, 0.0)


def stands(name: str, outcome: Outcome) -> bool:
    """Say whether the table was stopped; one that nobody can reach ends its move, no more."""
    (fault,) = (fault for fault in FAULTS if fault.name == name)
    within_s = math.inf if fault.cuts_off else _STANDS_WITHIN_S
    return math.isfinite(outcome.stood_after_s) and outcome.stood_after_s <= within_s


def _gathered(pairs: Iterable[tuple[Place, Outcome]]) -> Matrix:
    gathered: dict[tuple[str, RigName, Moment], list[Outcome]] = {}
    for (name, rig, moment, _), outcome in pairs:
        gathered.setdefault((name, rig, moment), []).append(outcome)
    return gathered
