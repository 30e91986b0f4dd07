"""``docs/papers.md``, written from the studies themselves."""

from collections.abc import Iterable, Sequence
from typing import Final

from northfinder.studies.claim import Claim, Quantity, Verdict
from northfinder.studies.study import Study, Table
from northfinder.studies.wording import written

_HEADINGS: Final = {
    Verdict.REPRODUCED: "What holds",
    Verdict.NOT_REPRODUCED: "What does not",
    Verdict.MISPRINT: "What is misprinted",
    Verdict.BEYOND: "What we do better, or found",
}
_OPENING: Final = """\
# The papers

What each paper claims, what holds, what is misprinted, and what we do better. Every line was \
measured by the command beside it; `--json` gives the same for programs, `--figures DIR` the \
papers' figures with our curves. This page is written by `python -m northfinder.studies`, and a \
test compares it with a fresh run: do not edit it.

- **reproduced**: our figure keeps the printed bound, or agrees with the printed figure to the \
digits that it is given to; where it is a round one or says "about", to 15 %.
- **not reproduced**: it does not, under the conditions stated.
- **misprint**: the print contradicts itself or its own formulas; the right form is named.
- **beyond the paper**: ours, or something about the paper's method that it does not say.
"""


def papers_markdown(studies: Sequence[Study]) -> str:
    """Return the whole document; the same figures give the same text."""
    parts = [_OPENING, _overview(studies), *(_study(study) for study in studies)]
    return "\n".join(parts)


def _overview(studies: Sequence[Study]) -> str:
    rows = [
        (
            f"[`{study.name}`](#{study.name})",
            *(str(sum(c.verdict is verdict for c in study.claims)) for verdict in Verdict),
        )
        for study in studies
    ]
    return _table(("study", *(verdict.value for verdict in Verdict)), rows)


def _study(study: Study) -> str:
    parts = [
        f"## {study.name}\n",
        f"**{study.title}.** {study.paper}.\n",
        f"{study.summary}\n",
        f"Measured by `{study.command}`: {study.conditions}.\n",
    ]
    for verdict, heading in _HEADINGS.items():
        claims = [claim for claim in study.claims if claim.verdict is verdict]
        if claims:
            parts.append(f"### {heading}\n")
            parts.append(_claims(claims, study.command))
    parts += [_figures(table) for table in study.tables if table.repeatable]
    return "\n".join(parts)


def _claims(claims: Iterable[Claim], command: str) -> str:
    columns = ("where", "what it says", "printed", "ours", "verdict, and why", "shown by")
    rows = [
        (
            claim.where,
            f"{claim.says} ({claim.conditions})" if claim.conditions else claim.says,
            written(claim.printed),
            written(claim.ours),
            f"**{claim.verdict.value}**: {claim.reason}",
            f"`{command}`",
        )
        for claim in claims
    ]
    return _table(columns, rows)


def _figures(table: Table) -> str:
    rows = [[written(cell) for cell in row] for row in table.rows]
    numbers = [any(isinstance(row[i], Quantity) for row in table.rows) for i in range(len(rows[0]))]
    return f"### {table.title}\n\n{_table(table.columns, rows, numbers)}"


def _table(
    columns: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[bool] | None = None
) -> str:
    right = numbers or [False] * len(columns)
    rule = ["---:" if to_right else "---" for to_right in right]
    lines = [columns, rule, *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
