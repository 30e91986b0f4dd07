"""Holds promises against what was run, and says in few words what was measured."""

import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from northfinder.proof.document_evidence import Evidence, TestResult
from northfinder.proof.figure import Figure, readable
from northfinder.proof.promises import Promise, Source

State = Literal["met", "NOT MET", "not measured"]
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_TOLD_SINGLY = 4


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a promise, or of one of the things that show it.

    Attributes:
        state: Whether it holds.
        words: What was measured; empty where that is no more than whether it holds.
    """

    state: State
    words: str


def judge(promise: Promise, evidence: Evidence) -> Verdict:
    """Hold one promise against what was run: all that shows it, and all it asks for, must hold."""
    found = [_shown(source, promise, evidence) for source in promise.shown_by]
    if all(verdict.state == "not measured" for verdict in found):
        return Verdict("not measured", "")
    absent = [Verdict("not measured", part) for part in _absent(promise, evidence)]
    named = [
        Verdict(verdict.state, source.words if verdict.state == "not measured" else verdict.words)
        for source, verdict in zip(promise.shown_by, found, strict=True)
    ] + absent
    states = {verdict.state for verdict in named}
    state: State = next((s for s in ("NOT MET", "not measured") if s in states), "met")
    said = [v.words + ": not measured" * (v.state == "not measured") for v in named if v.words]
    return Verdict(state, "; ".join(dict.fromkeys(said)))


def together(measured: Sequence[str]) -> list[str]:
    """Put together what many runs of one test measured.

    Words that differ in their numbers alone become one, each number a range, where they are more
    than four.
    """
    kinds: dict[str, list[str]] = {}
    for words in measured:
        kinds.setdefault(_NUMBER.sub("#", words), []).append(words)
    return [told for alike in kinds.values() for told in _singly_or_as_range(alike)]


def _singly_or_as_range(alike: Sequence[str]) -> Iterable[str]:
    different = dict.fromkeys(alike)
    if len(different) <= _TOLD_SINGLY:
        return different
    return [f"{_ranges(alike)} ({len(alike)} values)"]


def _ranges(alike: Sequence[str]) -> str:
    """Write words that differ in their numbers alone, each number as a range."""
    columns = zip(*(_NUMBER.findall(words) for words in alike), strict=True)
    ends = [dict.fromkeys((min(c, key=float), max(c, key=float))) for c in columns]
    parts = _NUMBER.split(alike[0])
    between = [*(" .. ".join(each) for each in ends), ""]
    return "".join(part for pair in zip(parts, between, strict=True) for part in pair)


def _shown(source: Source, promise: Promise, evidence: Evidence) -> Verdict:
    by = _by_tests if source.is_test else _by_figures
    return by(source, promise, evidence)


def _absent(promise: Promise, evidence: Evidence) -> list[str]:
    """Return what the row asks for and nothing that was run has in its words."""
    there = [figure.name for s in promise.shown_by for figure in _figures_of(s, evidence)]
    there += [words for s in promise.shown_by for t in _ran(s, evidence) for words in t.measured]
    return [part for part in promise.of if not any(part in words for words in there)]


def _ran(source: Source, evidence: Evidence) -> list[TestResult]:
    """Return the tests that belong to a source and were not skipped."""
    tests = evidence.tests if source.is_test else ()
    return [test for test in tests if test.outcome != "skipped" and source.covers(test.node_id)]


def _figures_of(source: Source, evidence: Evidence) -> Sequence[Figure]:
    return evidence.figures.get(source.measurement, ())


def _by_tests(source: Source, promise: Promise, evidence: Evidence) -> Verdict:
    if not (ran := _ran(source, evidence)):
        return Verdict("not measured", "")
    failed = [f"`{test.node_id}` failed" for test in ran if test.outcome == "failed"]
    measured = [words for test in ran for words in test.measured if promise.asks_for(words)]
    words = "; ".join([*failed, *together(measured)])
    return Verdict("NOT MET" if failed else "met", words)


def _by_figures(source: Source, promise: Promise, evidence: Evidence) -> Verdict:
    figures = [f for f in _figures_of(source, evidence) if promise.asks_for(f.name)]
    if not figures:
        return Verdict("not measured", "")
    state: State = "met" if all(figure.met for figure in figures) else "NOT MET"
    return Verdict(state, "; ".join(_told(figures)))


def _told(figures: Sequence[Figure]) -> Iterator[str]:
    """Tell figures of one kind together, as a range: those whose names end alike."""
    kinds: dict[tuple[str, str], list[Figure]] = {}
    for figure in figures:
        kinds.setdefault((figure.name.rpartition(": ")[2], figure.unit), []).append(figure)
    common = _common_words([label for label, _ in kinds])
    for (label, unit), some in kinds.items():
        heading = f"{label.removeprefix(common)}: " if len(kinds) > 1 else ""
        missed = dict.fromkeys(f"{each.required} is promised" for each in some if not each.met)
        promised = f" where {', '.join(missed)}" if missed else ""
        yield f"{heading}{_range([each.value for each in some], unit)}{promised}"


def _common_words(labels: Sequence[str]) -> str:
    """Return the whole words that all labels begin with, the space after them included."""
    alike = itertools.takewhile(
        lambda words: len(set(words)) == 1, zip(*map(str.split, labels), strict=False)
    )
    return "".join(f"{words[0]} " for words in alike)


def _range(values: Sequence[float], unit: str) -> str:
    ends = dict.fromkeys((readable(min(values)), readable(max(values))))
    return f"{' .. '.join(ends)} {unit}".strip()
