"""``docs/proof.md`` as a function of promises and evidence."""

from collections.abc import Iterable, Iterator, Sequence

from northfinder.proof.document_evidence import Evidence
from northfinder.proof.document_verdicts import Verdict, judge
from northfinder.proof.figure import readable
from northfinder.proof.promises import COMMANDS, Promise, Section, Source

_INTRODUCTION = (
    "What is promised, what was measured, and what shows it. `make proof` measures all of it and"
    " writes this page; `make test` holds a short form of each. The rows stand in"
    " `northfinder/proof/promises.toml`."
)


def page(sections: Sequence[Section], evidence: Evidence, circumstances: str) -> str:
    """Return the whole page.

    Args:
        sections: What is promised.
        evidence: What was run.
        circumstances: When, on what and with what, a sentence or two.
    """
    lines = ["# Proof", "", _INTRODUCTION, "", circumstances, "", _summary(sections, evidence), ""]
    for section in sections:
        lines += _section(section, evidence)
    lines += _every_figure(evidence)
    return "\n".join(lines).rstrip("\n") + "\n"


def cell(verdict: Verdict) -> str:
    """Write a verdict as the table shows it."""
    match verdict:
        case Verdict("NOT MET", words):
            return f"**NOT MET**: {words}"
        case Verdict("not measured", ""):
            return "not measured"
        case Verdict(_, words):
            return words or "pass"


def shown_by(promise: Promise) -> str:
    """Write what shows a promise as the table shows it."""
    return ", ".join(source.words for source in promise.shown_by)


def _summary(sections: Sequence[Section], evidence: Evidence) -> str:
    states = [judge(promise, evidence).state for each in sections for promise in each.promises]
    counts = ", ".join(f"{states.count(s)} {s}" for s in ("met", "NOT MET", "not measured"))
    return f"{len(states)} promises: {counts}."


def _section(section: Section, evidence: Evidence) -> Iterator[str]:
    if section.title:
        yield from (f"## {section.title}", "")
    if section.before:
        yield from (section.before, "")
    yield from _table(
        ("promise", "measured", "shown by"),
        ((p.words, cell(judge(p, evidence)), shown_by(p)) for p in section.promises),
    )
    if section.after:
        yield from (section.after, "")


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(headings)} |"
    yield "|" + "---|" * len(headings)
    for row in rows:
        yield f"| {' | '.join(text.replace('|', '/') for text in row)} |"
    yield ""


def _every_figure(evidence: Evidence) -> Iterator[str]:
    if not evidence.figures:
        return
    yield from ("## Every figure", "")
    yield from ("With what physics or the machine allows at most, where that is known.", "")
    headings = ("figure", "measured", "required", "limit", "command")
    yield from _table(headings, _figure_rows(evidence))


def _figure_rows(evidence: Evidence) -> Iterator[Sequence[str]]:
    for measurement, figures in evidence.figures.items():
        source = Source(measurement if measurement in COMMANDS else f"bench {measurement}")
        for figure in figures:
            value = f"{readable(figure.value)} {figure.unit}".strip()
            measured = value if figure.met else f"**NOT MET**: {value}"
            yield figure.name, measured, figure.required, figure.limit, source.words
