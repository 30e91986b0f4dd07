"""Charts as SVG, in the manner of the certificate's figures."""

from html import escape
from typing import TYPE_CHECKING, Any, Final

from northfinder.report.canvas import (
    BLUE,
    EDGE,
    HAIRLINE,
    INK,
    INK2,
    INK3,
    SMALL_PT,
    Sheet,
    add_axes,
    label,
    render,
)
from northfinder.studies.chart import Chart, Curve, Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ORANGE: Final = "#d67200"
_WIDTH_PT, _LEFT_PT, _RIGHT_PT, _GAP_PT = 504.0, 34.0, 12.0, 44.0
_TALL_PT, _ABOVE_PT, _BELOW_PT = 104.0, 27.0, 25.0
_STYLES: Final[dict[str, dict[str, Any]]] = {
    "ours": {"color": BLUE, "linewidth": 1.2},
    "printed": {"color": INK, "linestyle": "none", "marker": "D", "markersize": 3.4},
    "second": {"color": ORANGE, "linewidth": 1.1, "dashes": (5, 1.6)},
    "third": {"color": INK2, "linewidth": 0.9, "dashes": (1.2, 1.4)},
    "fourth": {"color": INK3, "linewidth": 0.9, "dashes": (6, 1.4, 1.2, 1.4)},
    "dots": {"color": BLUE, "linestyle": "none", "marker": "o", "markersize": 2.2},
    "rings": {
        "color": ORANGE,
        "linestyle": "none",
        "marker": "o",
        "markersize": 4.0,
        "markerfacecolor": "none",
        "markeredgewidth": 0.9,
    },
}


def draw(chart: Chart) -> str:
    """Draw a chart as an ``<svg>`` element with title and description; equal data, equal text."""
    rows = -(-len(chart.panels) // chart.columns)
    height_pt = rows * (_ABOVE_PT + _TALL_PT + _BELOW_PT)
    wide_pt = _WIDTH_PT - _LEFT_PT - _RIGHT_PT - (chart.columns - 1) * _GAP_PT
    wide_pt /= chart.columns

    def paint(figure: "Figure") -> None:
        for index, panel in enumerate(chart.panels):
            row, column = divmod(index, chart.columns)
            left_pt = _LEFT_PT + column * (wide_pt + _GAP_PT)
            bottom_pt = height_pt - (row + 1) * (_ABOVE_PT + _TALL_PT + _BELOW_PT) + _BELOW_PT
            _panel(figure, panel, (left_pt, bottom_pt, wide_pt, _TALL_PT))

    svg = render(Sheet(chart.name, chart.title, _WIDTH_PT, height_pt), paint)
    said = f"</title>\n <desc>{escape(chart.description)}</desc>"
    return svg.replace("</title>", said, 1)


def _panel(figure: "Figure", panel: Panel, box_pt: tuple[float, float, float, float]) -> None:
    axes = add_axes(figure, box_pt, "")
    named = any(curve.name for curve in panel.curves)
    shift_pt = (-18.0, 15.0 if named else 6.0)
    label(axes, (0.0, 1.0), panel.upwards, axes.transAxes, shift_pt=shift_pt, color=INK2)
    label(axes, (1.0, 0.0), panel.across, axes.transAxes, shift_pt=(0.0, -19.0), align="right")
    _scales(axes, panel)
    for curve in panel.curves:
        _curve(axes, curve)
    for height, name in panel.levels:
        axes.axhline(height, color=EDGE, linewidth=0.6, dashes=(2, 2), zorder=0.5)
        label(axes, (1.0, height), name, axes.get_yaxis_transform(), shift_pt=(0, 2), align="right")
    if named:
        axes.legend(
            loc="lower left",
            bbox_to_anchor=(-0.015, 0.99),
            ncols=len(panel.curves),
            frameon=False,
            fontsize=SMALL_PT,
            handlelength=1.9,
            columnspacing=1.3,
            handletextpad=0.5,
            borderaxespad=0.0,
            borderpad=0.1,
        )


def _scales(axes: "Axes", panel: Panel) -> None:
    axes.grid(visible=True, axis="y", color=HAIRLINE, linewidth=0.4)
    axes.set_axisbelow(True)
    for axis, logarithmic in (("x", panel.log_x), ("y", panel.log_y)):
        if logarithmic:
            _decades(axes, axis)
    if not panel.log_y:
        axes.locator_params(axis="y", nbins=5)
    if panel.ticks:
        axes.set_xticks([place for place, _ in panel.ticks], [name for _, name in panel.ticks])
    axes.margins(x=0.01 if panel.across else 0.15)


def _decades(axes: "Axes", which: str) -> None:
    """Make an axis logarithmic, its numbers plain: the canvas reads no mathematics."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: PLC0415 (late)

    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if which == "x" else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _power(value)))
    axis.set_minor_formatter(NullFormatter())


def _power(value: float) -> str:
    """Write ``100``, ``0.01``, ``1e-5``."""
    return f"{value:g}" if value >= 1e-4 else f"{value:.0e}".replace("e-0", "e-")


def _curve(axes: "Axes", curve: Curve) -> None:
    x, y = curve.points()
    axes.plot(x, y, label=curve.name or None, **_STYLES[curve.style])
