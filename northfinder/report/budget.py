"""The uncertainty budget: where each line comes from, and the bars."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from northfinder.formatting import decimals_of
from northfinder.report.canvas import (
    BLUE,
    EDGE,
    GREY,
    INK2,
    WEDGE,
    Sheet,
    add_axes,
    add_plane,
    label,
    render,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Lines = Sequence[Mapping[str, Any]]
Origin = Literal["this run", "earlier run", "configuration"]
#: The key of a configuration that replaces what a north-seek's own readings would tell. The other
#: kinds take all that their sensors may do as stated, in the plan as it was carried out.
_STATED_BY = {
    "gyro noise": ("gyro", "noise_deg_sqrt_h"),
    "accelerometer noise": ("accelerometer", "noise_g_sqrt_hz"),
    "drift curvature": ("gyro", "drift_curvature_sigma_deg_h3"),
}
_SEEN_BY: Mapping[str, Origin] = {
    "sway of the base": "this run",
    "heading at the start": "earlier run",
}
_FACE: Mapping[Origin, str] = {"this run": BLUE, "earlier run": WEDGE, "configuration": GREY}
_ROW_PT, _LEFT_PT, _RIGHT_PT, _WIDTH_PT = 9.6, 78.0, 34.0, 248.0


def origin(source: str, result: Mapping[str, Any]) -> Origin:
    """Say whether a budget's line comes from readings, of which run, or from what was stated."""
    if source in _SEEN_BY:
        return _SEEN_BY[source]
    if source not in _STATED_BY or result.get("kind", "north-seek") != "north-seek":
        return "configuration"
    section, key = _STATED_BY[source]
    stated = result.get("rig", {}).get("config", {}).get(section, {}).get(key)
    return "this run" if stated is None else "configuration"


def draw_budget(result: Mapping[str, Any]) -> str:
    """Draw each source's standard uncertainty as a bar."""
    lines = result["budget"]
    height_pt = 38.0 + _ROW_PT * len(lines)

    def paint(figure: "Figure") -> None:
        box_pt = (_LEFT_PT, 22.0, _WIDTH_PT - _LEFT_PT - _RIGHT_PT, _ROW_PT * len(lines))
        axes = add_axes(figure, box_pt, "")
        for row, line in enumerate(reversed(lines)):
            _bar(axes, row, line, origin(line["source"], result))
        axes.set_xlim(0.0, 1.05 * max(line["u_deg"] for line in lines) or 1.0)
        axes.set_ylim(-0.6, len(lines) - 0.4)
        axes.set_yticks(range(len(lines)), [line["source"] for line in reversed(lines)])
        axes.tick_params(axis="y", length=0.0)
        axes.locator_params(axis="x", nbins=4)
        _legend(figure, height_pt - 9.0, lines, result)
        label(add_plane(figure), (_WIDTH_PT, 3.0), "standard uncertainty, °", align="right")

    title = "Uncertainty budget: the standard uncertainty of each source"
    words = ", ".join(f"{line['source']} {_in_words(line['u_deg'])}" for line in lines)
    sheet = Sheet("budget", title, _WIDTH_PT, height_pt, f"In degrees: {words}.")
    return render(sheet, paint)


def _bar(axes: Any, row: int, line: Mapping[str, Any], from_: Origin) -> None:  # noqa: ANN401
    u_deg = line["u_deg"]
    edge = EDGE if from_ == "configuration" else BLUE
    axes.barh(row, u_deg, height=0.55, facecolor=_FACE[from_], edgecolor=edge, linewidth=0.5)
    label(axes, (u_deg, row), _in_words(u_deg), shift_pt=(4.0, -2.2), color=INK2)


def _in_words(u_deg: float) -> str:
    return f"{u_deg:.{decimals_of(u_deg)}f}" if u_deg > 0.0 else "none"


def _legend(figure: "Figure", baseline_pt: float, lines: Lines, result: Mapping[str, Any]) -> None:
    plane, x_pt = add_plane(figure), _LEFT_PT
    origins = {origin(line["source"], result) for line in lines}
    for from_ in (each for each in _FACE if each in origins):
        edge = EDGE if from_ == "configuration" else BLUE
        plane.fill([x_pt, x_pt + 6.0, x_pt + 6.0, x_pt],
                   [baseline_pt, baseline_pt, baseline_pt + 5.0, baseline_pt + 5.0],
                   facecolor=_FACE[from_], edgecolor=edge, linewidth=0.5)  # fmt: skip
        label(plane, (x_pt + 10.0, baseline_pt), from_, color=INK2)
        x_pt += 52.0
