"""What the certificates of all kinds of run share: the sheet, its templates, its figures."""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from northfinder.records import Run, VisitStatistics
from northfinder.report.facts import Fact
from northfinder.report.figures import Estimates, Result, can_draw, draw, drawn_from

Values = Mapping[str, Any]
Visits = Sequence[VisitStatistics]


class Room(Protocol):
    """What a kind of run puts into the frame; its modules implement it."""

    def facts(self, run: Run, visits: Visits) -> list[Fact]:
        """Say what was measured, and how."""

    def completed(self, run: Run, result: Result, estimates: Estimates) -> Values:
        """Return what the kind's own template shows."""

    def unfinished(self, run: Run, visits: Visits, estimates: Estimates) -> Values:
        """Return what the record of an unfinished run shows."""


def drawings(
    names: Sequence[str], result: Result, estimates: Estimates
) -> dict[str, Markup | None]:
    """Draw what a run has the numbers for; the drawing escapes its own texts."""
    return {
        name: Markup(draw(name, result, estimates)) if can_draw(name, result, estimates) else None  # noqa: S704
        for name in names
    }


def unfinished_drawings(
    headings: Mapping[str, tuple[str, str]], run: Run, visits: Visits, estimates: Estimates
) -> list[tuple[str, str, Markup]]:
    """Return heading, remark and drawing of each figure that an unfinished run can fill."""
    found = drawings([*headings], drawn_from(run, visits), estimates)
    return [(*headings[name], drawing) for name, drawing in found.items() if drawing is not None]


def render(template: str, values: Values) -> str:
    """Fill a template; every value is escaped."""
    return _templates().get_template(template).render(values)


@cache
def _templates() -> Environment:
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["css_string"] = _css_string
    return templates


def _css_string(text: str) -> Markup:
    """Escape for a string in CSS (Syntax 3, 4.3.7), where HTML's escapes mean nothing."""
    plain = "".join(c if c.isalnum() and c.isascii() else f"\\{ord(c):x} " for c in text)
    return Markup(plain)  # noqa: S704 (letters, digits, and escapes of anything else)
