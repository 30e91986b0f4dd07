"""A sheet to draw on: matplotlib without its looks, and SVG that is the same every time.

Text stays text (``svg.fonttype: none``): it can be searched, copied and read aloud, is set in
the fonts of the page, and a figure is a third of the size that outlines would make it. The
labels are anchored, so that another font than the one measured here moves nothing.
"""

import io
import math
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The page's light colours. Blue is what was measured; shapes and words say it too, for a
#: printer without colour.
INK, INK2, INK3 = "#15171a", "#4b5056", "#676c72"
EDGE, HAIRLINE, GREY = "#8d9297", "#d8d8d4", "#bfc3c7"
BLUE, WEDGE = "#0b5cd5", "#d6e4fa"
SMALL_PT, LABEL_PT = 6.5, 7.5

_STYLE: dict[str, Any] = {
    "svg.fonttype": "none",
    "path.simplify": False,
    "font.family": ["sans-serif"],
    "font.sans-serif": [
        *("Segoe UI", "Roboto", "Helvetica Neue", "Arial", "Liberation Sans"),
        "DejaVu Sans",  # comes with matplotlib
    ],
    "font.size": LABEL_PT,
    "text.color": INK2,
    "text.parse_math": False,  # a name from a configuration may contain a dollar sign
    "axes.edgecolor": INK3,
    "axes.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "xtick.color": INK3,
    "ytick.color": INK3,
    "xtick.labelcolor": INK2,
    "ytick.labelcolor": INK2,
    "xtick.labelsize": SMALL_PT,
    "ytick.labelsize": SMALL_PT,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.minor.width": 0.5,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "xtick.minor.size": 1.5,
    "lines.linewidth": 0.9,
    "lines.solid_capstyle": "butt",
}
#: The style is global in matplotlib, and its caches are nobody's: one figure at a time. And all of
#: them in one thread: each that draws keeps fonts and pieces of memory of its own, for ever.
_PAINTER = ThreadPoolExecutor(1, "figures")


@dataclass(frozen=True, slots=True)
class Sheet:
    """A figure's size, and its name and what it shows for those who cannot see it."""

    name: str
    title: str
    width_pt: float
    height_pt: float
    description: str = ""


def render(sheet: Sheet, paint: Callable[["Figure"], None]) -> str:
    """Draw one figure.

    matplotlib is imported here, at the first figure: the service's start must not pay for it.

    Args:
        sheet: Its size and name.
        paint: Draws on the empty figure.

    Returns:
        An ``<svg>`` element without declarations: a file as it is, or a part of an HTML page.
        The same drawing gives the same text.
    """
    svg = _embeddable(_PAINTER.submit(_painted, sheet, paint).result())
    if not sheet.description:
        return svg
    return svg.replace("</title>", f"</title>\n <desc>{escape(sheet.description)}</desc>", 1)


def _painted(sheet: Sheet, paint: Callable[["Figure"], None]) -> str:
    from matplotlib import rc_context  # noqa: PLC0415 (see above)
    from matplotlib.figure import Figure  # noqa: PLC0415

    written = io.StringIO()
    style: Any = {**_STYLE, "svg.hashsalt": sheet.name}  # its type names every key there is
    with rc_context(style):
        figure = Figure(figsize=(sheet.width_pt / 72, sheet.height_pt / 72), facecolor="white")
        paint(figure)
        figure.savefig(written, format="svg", metadata={"Date": None, "Title": sheet.title})
    return written.getvalue()


def _embeddable(svg: str) -> str:
    """Keep the picture alone: its style and the ids of its groups would leak into a page."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"\s*<defs>\s*<style.*?</style>\s*</defs>", "", svg, flags=re.DOTALL)  # of "*"
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)
    svg = re.sub(r' (?:d|x|y)="[^"]*"', _to_hundredths, svg)
    return svg.replace("<svg ", '<svg role="img" stroke-linejoin="round" ', 1)


def _to_hundredths(coordinates: re.Match[str]) -> str:
    """Drop digits that no printer resolves: of a point's millionths a hundredth is enough."""
    return re.sub(r"(\.\d\d)\d+", r"\1", coordinates[0])


def add_axes(figure: "Figure", box_pt: tuple[float, float, float, float], heading: str) -> "Axes":
    """Add two thin axes, the quantity and its unit above them.

    Args:
        figure: To add them to.
        box_pt: Left, bottom, width, height.
        heading: What goes upwards, with its unit.
    """
    width_pt, height_pt = figure.get_size_inches() * 72
    left, bottom, width, height = box_pt
    axes = figure.add_axes(
        (left / width_pt, bottom / height_pt, width / width_pt, height / height_pt)
    )
    label(axes, (0.0, 1.0), heading, axes.transAxes, shift_pt=(-18.0, 5.0))
    return axes


def add_plane(figure: "Figure") -> "Axes":
    """Add a plane without axes over the whole figure, its unit the point."""
    width_pt, height_pt = figure.get_size_inches() * 72
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, width_pt)
    axes.set_ylim(0.0, height_pt)
    return axes


def label(  # noqa: PLR0913 (a text has this many properties)
    axes: "Axes",
    at: tuple[float, float],
    text: str,
    transform: Any = None,  # noqa: ANN401 (matplotlib's)
    *,
    shift_pt: tuple[float, float] = (0.0, 0.0),
    align: str = "left",
    color: str = INK3,
    size_pt: float = SMALL_PT,
    weight: str = "normal",
) -> None:
    """Write beside a point, by default of the data."""
    axes.annotate(
        text,
        at,
        xytext=shift_pt,
        xycoords=axes.transData if transform is None else transform,
        textcoords="offset points",
        ha=align,
        va="baseline",
        color=color,
        fontsize=size_pt,
        fontweight=weight,
        annotation_clip=False,
    )


def segments(
    x0: ArrayLike, y0: ArrayLike, x1: ArrayLike, y1: ArrayLike
) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return many separate lines as one path, which keeps the SVG small."""
    first, second = np.broadcast_arrays(x0, x1), np.broadcast_arrays(y0, y1)
    gap = np.full(np.shape(first[0]), math.nan)
    x = np.stack([first[0], first[1], gap], axis=-1).ravel()
    y = np.stack([second[0], second[1], gap], axis=-1).ravel()
    return x, y
