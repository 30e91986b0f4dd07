"""The Allan deviation of a static record: what was measured, its 95 % band, and the model."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np

from northfinder.estimators.arrays import FloatArray
from northfinder.report.canvas import (
    BLUE,
    HAIRLINE,
    INK2,
    WEDGE,
    Sheet,
    add_axes,
    add_plane,
    label,
    render,
)
from northfinder.report.scales import make_logarithmic
from northfinder.report.wording import unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Sensor = Literal["gyro", "accelerometer"]

_WIDTH_PT, _HEIGHT_PT = 248.0, 168.0
_LEFT_PT, _BOTTOM_PT, _RIGHT_PT, _ABOVE_PT = 32.0, 22.0, 8.0, 28.0
_ROOM: Final = 1.3  # beyond the outermost values


class _Curve(NamedTuple):
    """The deviation in the unit that it is drawn in, ``(n,)`` each; an open band ends in NaN."""

    tau_s: FloatArray
    deviation: FloatArray
    low: FloatArray
    high: FloatArray
    model: FloatArray


def draw_allan(result: Mapping[str, Any], sensor: Sensor) -> str:
    """Draw Allan deviation over averaging time, both in decades.

    Args:
        result: A noise run's, or what one told on its way.
        sensor: Whose.
    """
    unit = unit_of(result[sensor]["unit"])
    curve = _curve(result[sensor]["allan"], unit.scale)
    limits = _limits(curve)

    def paint(figure: "Figure") -> None:
        wide_pt = _WIDTH_PT - _LEFT_PT - _RIGHT_PT
        tall_pt = _HEIGHT_PT - _BOTTOM_PT - _ABOVE_PT
        axes = add_axes(figure, (_LEFT_PT, _BOTTOM_PT, wide_pt, tall_pt), "")
        heading = f"Allan deviation of the {sensor}, {unit.name}"
        label(axes, (0.0, 1.0), heading, axes.transAxes, shift_pt=(-18.0, 16.0))
        make_logarithmic(axes, "x", (curve.tau_s[0] / _ROOM, curve.tau_s[-1] * _ROOM))
        make_logarithmic(axes, "y", limits)
        _paint(axes, curve, limits[1])
        _legend(figure)
        label(add_plane(figure), (_WIDTH_PT - _RIGHT_PT, 3.0), "averaging time τ, s", align="right")

    title = f"Allan deviation of the {sensor} over averaging time"
    sheet = Sheet(f"allan-{sensor}", title, _WIDTH_PT, _HEIGHT_PT, _in_words(curve, unit.name))
    return render(sheet, paint)


def _curve(allan: Mapping[str, Any], scale: float) -> _Curve:
    tau_s, deviation, low, high, model = (
        np.array(allan[key], dtype=np.float64)
        for key in ("tau_s", "deviation", "low95", "high95", "model")
    )
    return _Curve(tau_s, deviation * scale, low * scale, high * scale, model * scale)


def _limits(curve: _Curve) -> tuple[float, float]:
    """Return a scale for what was measured; a band without an upper end runs out of it."""
    values = np.concatenate([curve.deviation, curve.low, curve.high])
    positive = values[np.isfinite(values) & (values > 0.0)]
    return float(positive.min()) / _ROOM, float(positive.max()) * _ROOM


def _paint(axes: "Axes", curve: _Curve, top: float) -> None:
    axes.grid(visible=True, color=HAIRLINE, linewidth=0.4)
    axes.set_axisbelow(True)
    high = np.where(np.isfinite(curve.high), curve.high, top)
    axes.fill_between(curve.tau_s, curve.low, high, facecolor=WEDGE, edgecolor="none")
    seen = curve.model > 0.0
    axes.plot(curve.tau_s[seen], curve.model[seen], color=INK2, linestyle=(0, (4, 2)))
    axes.plot(curve.tau_s, curve.deviation, color=BLUE, marker="o", markersize=1.8, linewidth=0.6)


def _legend(figure: "Figure") -> None:
    plane, y_pt = add_plane(figure), _HEIGHT_PT - 21.0
    plane.fill_between([_LEFT_PT, _LEFT_PT + 14.0], y_pt - 1.0, y_pt + 5.0, facecolor=WEDGE)
    plane.plot([_LEFT_PT, _LEFT_PT + 14.0], [y_pt + 2.0] * 2, color=BLUE, linewidth=0.6)
    plane.plot(_LEFT_PT + 7.0, y_pt + 2.0, "o", color=BLUE, markersize=1.8)
    label(plane, (_LEFT_PT + 18.0, y_pt), "measured, 95 % band", color=INK2)
    start_pt = _LEFT_PT + 98.0
    plane.plot([start_pt, start_pt + 14.0], [y_pt + 2.0] * 2, color=INK2, linestyle=(0, (4, 2)))
    label(plane, (start_pt + 18.0, y_pt), "model of what was seen", color=INK2)


def _in_words(curve: _Curve, unit: str) -> str:
    lowest = int(np.argmin(curve.deviation))
    return (
        f"From {curve.deviation[0]:.3g} {unit} at {curve.tau_s[0]:.3g} s to "
        f"{curve.deviation[-1]:.3g} {unit} at {curve.tau_s[-1]:.3g} s; the lowest value is "
        f"{curve.deviation[lowest]:.3g} {unit} at {curve.tau_s[lowest]:.3g} s."
    )
