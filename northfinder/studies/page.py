"""One printable HTML page of a study, complete in itself; the certificate's sibling."""

import re
from functools import cache
from pathlib import Path
from typing import Final

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

import northfinder.report
from northfinder.report import canvas
from northfinder.software import version
from northfinder.studies.drawing import ORANGE, draw
from northfinder.studies.study import Study
from northfinder.studies.wording import written

#: Colours of the drawings, and the names that the page has for them in its two lights.
_VARIABLES: Final = {
    canvas.INK: "ink",
    canvas.INK2: "ink2",
    canvas.INK3: "ink3",
    canvas.EDGE: "edge",
    canvas.HAIRLINE: "hairline",
    canvas.BLUE: "blue",
    ORANGE: "orange",
    "#ffffff": "paper",
}


def study_page(study: Study) -> str:
    """Return the page as one HTML document: no script, no font, no picture from elsewhere."""
    figures = [(chart, Markup(_themed(draw(chart)))) for chart in study.charts]  # noqa: S704 (our own drawing escapes its texts)
    template = _templates().get_template("study.html")
    return template.render(study=study, figures=figures, version=version())


def _themed(svg: str) -> str:
    """Let the page's light decide the colours; a file of its own keeps them."""
    pattern = "|".join(_VARIABLES)
    return re.sub(pattern, lambda found: f"var(--{_VARIABLES[found[0]]}, {found[0]})", svg)


@cache
def _templates() -> Environment:
    ours, certificate = Path(__file__).parent, Path(northfinder.report.__path__[0])
    templates = Environment(
        loader=FileSystemLoader([ours / "templates", certificate / "templates"]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["written"] = written
    templates.filters["css_string"] = str  # the footer is made of plain words
    return templates
