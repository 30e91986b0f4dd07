"""The gyro's readings over the table's angle: the fit, and what it leaves."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from northfinder.estimators.arrays import BoolArray, FloatArray
from northfinder.formatting import azimuth, decimals_of
from northfinder.report.canvas import (
    BLUE,
    EDGE,
    INK,
    INK2,
    Sheet,
    add_axes,
    add_plane,
    label,
    render,
    segments,
)
from northfinder.report.readings import Harmonic, Readings, gyro_mount_deg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_PT, _LEFT_PT, _RIGHT_PT = 504.0, 30.0, 10.0
_AXES_WIDTH_PT = _WIDTH_PT - _LEFT_PT - _RIGHT_PT
#: Shape, size and face of each kind; a ring fits around the disc of the same angle.
_MARKS = {
    "out": ("o", 3.0, BLUE),
    "back": ("o", 5.2, "none"),
    "again": ("D", 5.4, "none"),
    "left out": ("x", 4.0, "none"),
}
_WORDS = {
    "out": "out",
    "back": "back",
    "again": "measured again",
    "left out": "left out of the fit",
}
_BESIDE_DEG = {
    "out": -1.0,
    "back": 1.0,
    "again": 3.0,
    "left out": 0.0,
}  # residuals of one angle, side by side


def draw_fit(result: Mapping[str, Any]) -> str:
    """Draw rate over table angle with its curve, and the residuals below.

    Args:
        result: A north-seek's; of one without a result its ``visits`` alone, as they are.
    """
    readings = Readings.of(result)

    bottom_pt = 24.0 if readings.fit is None else 86.0

    def paint(figure: "Figure") -> None:
        axes = _table_axes(figure, (bottom_pt, 92.0), "rate, °/h")
        _whiskers(axes, readings, readings.angle_deg, readings.rate_deg_h)
        for kind in _MARKS:
            own = readings.of_kind(kind)
            _marks(axes, readings.angle_deg[own], readings.rate_deg_h[own], kind)
        everything = np.ones(len(readings.kind), dtype=np.bool_)
        axes.set_ylim(*_with_whiskers(readings, readings.rate_deg_h, everything))
        legend_end_pt = _legend(figure, bottom_pt + 98.5, readings)
        if readings.fit is None:
            _name_table_angle(figure)
        else:
            axes.set_xticklabels([])
            _curve(axes, readings.fit)
            _north(axes, result)
            _words_of_curve(figure, legend_end_pt, result)
            _residuals(figure, 42.0, readings)

    title = "Gyro rate against table angle, with the fit and its residuals"
    sheet = Sheet("fit", title, _WIDTH_PT, bottom_pt + 108.0, _in_words(readings))
    return render(sheet, paint)


def draw_residuals(result: Mapping[str, Any]) -> str:
    """Draw the residuals alone, larger."""
    readings = Readings.of(result)

    def paint(figure: "Figure") -> None:
        _residuals(figure, 104.0, readings)
        _legend(figure, 134.5, readings)

    title = "Residuals of the gyro's fit against table angle"
    return render(Sheet("residuals", title, _WIDTH_PT, 144.0, _in_words(readings)), paint)


def _in_words(readings: Readings) -> str:
    said = (
        f"{len(readings.rate_deg_h)} readings from {readings.rate_deg_h.min():.2f} to "
        f"{readings.rate_deg_h.max():.2f} degrees an hour"
    )
    if readings.fit is None:
        return f"{said}, without a fit."
    left_deg_h = readings.rate_deg_h - readings.fit.rate_deg_h(readings.angle_deg)
    decimals = decimals_of(float(np.median(readings.sigma_deg_h)))
    return (
        f"{said}; the largest residual is {np.abs(left_deg_h).max():.{decimals}f} degrees an hour."
    )


def _table_axes(figure: "Figure", bottom_and_height_pt: tuple[float, float], what: str) -> "Axes":
    bottom_pt, height_pt = bottom_and_height_pt
    axes = add_axes(figure, (_LEFT_PT, bottom_pt, _AXES_WIDTH_PT, height_pt), what)
    axes.set_xlim(-6.0, 366.0)
    axes.set_xticks(range(0, 361, 30))
    axes.set_xticks(range(0, 361, 15), minor=True)
    axes.locator_params(axis="y", nbins=5)
    return axes


def _residuals(figure: "Figure", height_pt: float, readings: Readings) -> None:
    if readings.fit is None:
        return
    axes = _table_axes(figure, (24.0, height_pt), "residual, °/h, ±2σ")
    residual_deg_h = readings.rate_deg_h - readings.fit.rate_deg_h(readings.angle_deg)
    beside_deg = readings.angle_deg + np.array([_BESIDE_DEG[kind] for kind in readings.kind])
    axes.axhline(0.0, color=EDGE, linewidth=0.5)
    _whiskers(axes, readings, beside_deg, residual_deg_h)
    for kind in _MARKS:
        own = readings.of_kind(kind)
        _marks(axes, beside_deg[own], residual_deg_h[own], kind)
    low, high = _with_whiskers(readings, residual_deg_h, readings.fitted)
    limit = max(-low, high)
    axes.set_ylim(-limit, limit)
    _name_table_angle(figure)


def _name_table_angle(figure: "Figure") -> None:
    label(add_plane(figure), (_LEFT_PT + _AXES_WIDTH_PT, 3.0), "table angle, °", align="right")


def _whiskers(axes: "Axes", readings: Readings, x: FloatArray, y: FloatArray) -> None:
    two_sigma = 2.0 * readings.sigma_deg_h
    lines = segments(x, y - two_sigma, x, y + two_sigma)
    axes.plot(*lines, color=BLUE, linewidth=0.5, zorder=2)


def _marks(axes: "Axes", x: FloatArray, y: FloatArray, kind: str) -> None:
    shape, size_pt, face = _MARKS[kind]
    axes.plot(
        x,
        y,
        linestyle="none",
        marker=shape,
        markersize=size_pt,
        markerfacecolor=face,
        markeredgecolor=BLUE,
        markeredgewidth=0.7 if face == "none" else 0.0,
        zorder=3,
        clip_on=False,
    )


def _with_whiskers(readings: Readings, y: FloatArray, shown: BoolArray) -> tuple[float, float]:
    """Return limits that clip no whisker of those that have to be shown."""
    low = float(np.min((y - 2.0 * readings.sigma_deg_h)[shown]))
    high = float(np.max((y + 2.0 * readings.sigma_deg_h)[shown]))
    room = 0.06 * (high - low) or 1.0
    return low - room, high + room


def _curve(axes: "Axes", fit: Harmonic) -> None:
    angle_deg = np.linspace(0.0, 360.0, 181)
    axes.plot(angle_deg, fit.rate_deg_h(angle_deg), color=INK, linewidth=0.8, zorder=1)
    axes.axhline(fit.R_deg_h, color=EDGE, linewidth=0.5, linestyle=(0, (4, 3)), zorder=0)
    label(axes, (366.0, fit.R_deg_h), "R", shift_pt=(2.0, -2.0), color=INK2)


def _north(axes: "Axes", result: Mapping[str, Any]) -> None:
    """Mark where the gyro faces north: table angle and mounting turn against the azimuth."""
    azimuth_deg, sigma_deg = result["azimuth_deg"], result["azimuth_sigma_deg"]
    at_deg = (azimuth_deg - gyro_mount_deg(result)) % 360.0
    axes.axvline(at_deg, color=BLUE, linewidth=0.8, linestyle=(0, (1, 2)), zorder=0)
    words = f"gyro faces north at {azimuth(at_deg, decimals_of(2.0 * sigma_deg))}°"
    right = at_deg < 240.0
    label(
        axes,
        (at_deg, 0.0),
        words,
        axes.get_xaxis_transform(),
        shift_pt=(4.0 if right else -4.0, 4.0),
        align="left" if right else "right",
        color=INK2,
    )


def _legend(figure: "Figure", baseline_pt: float, readings: Readings) -> float:
    """Name the shapes; return where the words end."""
    plane, x_pt = add_plane(figure), 110.0
    for kind in (kind for kind in _MARKS if kind in readings.kind):
        at = (np.array([x_pt]), np.array([baseline_pt + 2.2]))
        _marks(plane, *at, kind)
        label(plane, (x_pt + 6.0, baseline_pt), _WORDS[kind], color=INK2)
        x_pt += 18.0 + 3.4 * len(_WORDS[kind])
    return x_pt


def _words_of_curve(figure: "Figure", x_pt: float, result: Mapping[str, Any]) -> None:
    """Name the curve; where the bias changes, say that the points are drawn without that."""
    plane, baseline_pt = add_plane(figure), 184.5
    plane.plot([x_pt - 2.0, x_pt + 12.0], [baseline_pt + 2.2] * 2, color=INK, linewidth=0.8)
    terms = result["segments"]
    words = "R + a cos T + b sin T"
    if len(terms) > 1 or terms[0]["drift_deg_h_h"] is not None:
        words += "; rates reduced to the first segment's R"
    label(plane, (x_pt + 16.0, baseline_pt), words, color=INK2)
