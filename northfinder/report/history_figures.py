"""Heading and level over time, with what is not known of them: of an alignment, of a hold."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from northfinder.estimators.arrays import FloatArray
from northfinder.formatting import azimuth_with_uncertainty, decimals_of
from northfinder.report.canvas import (
    BLUE,
    EDGE,
    INK3,
    WEDGE,
    Sheet,
    add_axes,
    add_plane,
    label,
    render,
)
from northfinder.report.history import Estimates, History
from northfinder.report.scales import fix_ticks, make_logarithmic
from northfinder.report.wording import minus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_PT, _HEIGHT_PT, _BOTTOM_PT, _TALL_PT = 504.0, 118.0, 22.0, 80.0
_LEFT_PT, _GAP_PT, _RIGHT_PT = 32.0, 44.0, 10.0
_STEEP: Final = 20.0  # an uncertainty that changes by more is drawn in decades


class _Clock(NamedTuple):
    """What the time is counted in."""

    unit: str
    second: float


def draw_heading(result: Mapping[str, Any], estimates: Estimates) -> str:
    """Draw the azimuth with its band of 2 sigma, and beside it how the 2 sigma fell or grew.

    Args:
        result: With or without a ``history``; the ``plan`` tells a hold's start and rest.
        estimates: Data of the run's ``estimate`` events, at least one where there is no history.
    """
    history = History.of(result, estimates)
    clock, grows = _clock(history), "start" in result.get("plan", {})
    two_sigma_deg = 2.0 * (_added(history, result) if grows else history.azimuth_sigma_deg)

    def paint(figure: "Figure") -> None:
        wide_pt = _WIDTH_PT - _LEFT_PT - _GAP_PT - _RIGHT_PT
        axes = _axes(figure, (_LEFT_PT, 0.62 * wide_pt), "azimuth, °, ±2σ", history, clock)
        _line(axes, history, clock, history.azimuth_deg, history.azimuth_sigma_deg)
        fix_ticks(axes, wrap_deg=360.0)
        _rest(axes, result, clock)
        place_pt = (_LEFT_PT + 0.62 * wide_pt + _GAP_PT, 0.38 * wide_pt)
        what = "2σ that the hold has added, °" if grows else "2σ of the azimuth, °"
        axes = _axes(figure, place_pt, what, history, clock)
        axes.plot(history.time_s * clock.second, two_sigma_deg, color=BLUE)
        _scale_of_uncertainty(axes, two_sigma_deg)
        _rest(axes, result, clock)

    title = "Azimuth of the index mark over time, with its uncertainty"
    return render(Sheet("heading", title, _WIDTH_PT, _HEIGHT_PT, _heading_in_words(history)), paint)


def draw_level(result: Mapping[str, Any], estimates: Estimates) -> str:
    """Draw pitch and roll over time, with their 2 sigma where it is stated."""
    history = History.of(result, estimates)
    clock, stated = _clock(history), bool(np.isfinite(history.level_sigma_deg).any())
    band = ", ±2σ" if stated else " (no uncertainty stated)"

    def paint(figure: "Figure") -> None:
        wide_pt = (_WIDTH_PT - _LEFT_PT - _GAP_PT - _RIGHT_PT) / 2.0
        for place, name, angle_deg in (
            (0, "pitch", history.pitch_deg),
            (1, "roll", history.roll_deg),
        ):
            left_pt = _LEFT_PT + place * (wide_pt + _GAP_PT)
            axes = _axes(figure, (left_pt, wide_pt), f"{name}, °{band}", history, clock)
            _line(axes, history, clock, angle_deg, history.level_sigma_deg)
            fix_ticks(axes)

    title = "Pitch and roll of the table over time"
    return render(Sheet("level", title, _WIDTH_PT, _HEIGHT_PT, _level_in_words(history)), paint)


def _clock(history: History) -> _Clock:
    lasted_s = history.time_s[-1]
    if lasted_s > 3.0 * 3600.0:
        return _Clock("h", 1.0 / 3600.0)
    return _Clock("min", 1.0 / 60.0) if lasted_s > 600.0 else _Clock("s", 1.0)


def _axes(
    figure: "Figure", place_pt: tuple[float, float], what: str, history: History, clock: _Clock
) -> "Axes":
    left_pt, wide_pt = place_pt
    axes = add_axes(figure, (left_pt, _BOTTOM_PT, wide_pt, _TALL_PT), what)
    axes.set_xlim(0.0, float(history.time_s[-1]) * clock.second)
    axes.locator_params(axis="x", nbins=6)
    end_pt = (left_pt + wide_pt, 3.0)
    label(add_plane(figure), end_pt, f"time, {clock.unit}", align="right")
    return axes


def _line(
    axes: "Axes", history: History, clock: _Clock, angle_deg: FloatArray, sigma_deg: FloatArray
) -> None:
    """Draw an angle with its band, on a scale for what has settled; its end is the result."""
    time, two_sigma_deg = history.time_s * clock.second, 2.0 * sigma_deg
    low, high = angle_deg - two_sigma_deg, angle_deg + two_sigma_deg
    axes.fill_between(time, low, high, facecolor=WEDGE, edgecolor="none")
    axes.axhline(angle_deg[-1], color=EDGE, linewidth=0.5)
    axes.plot(time, angle_deg, color=BLUE)
    axes.errorbar(time[-1:], angle_deg[-1:], yerr=np.nan_to_num(two_sigma_deg[-1:]), fmt="o",
                  color=BLUE, markersize=3.0, elinewidth=0.7, clip_on=False)  # fmt: skip
    shown = np.concatenate([each[history.settled] for each in (angle_deg, low, high)])
    middle, half = (np.nanmax(shown) + np.nanmin(shown)) / 2.0, np.ptp(shown[np.isfinite(shown)])
    half = 0.525 * float(half) or 0.001
    axes.set_ylim(middle - half, middle + half)


def _added(history: History, result: Mapping[str, Any]) -> FloatArray:
    """Return what a hold has added to the sigma that it began with: that may hide it."""
    began_deg = result["plan"]["start"]["azimuth_sigma_deg"]
    added: FloatArray = np.sqrt(np.maximum(0.0, history.azimuth_sigma_deg**2 - began_deg**2))
    return added


def _scale_of_uncertainty(axes: "Axes", two_sigma_deg: FloatArray) -> None:
    least, most = float(np.min(two_sigma_deg)), float(np.max(two_sigma_deg))
    if least > 0.0 and most > _STEEP * least:
        make_logarithmic(axes, "y", (0.8 * least, 1.25 * most))
    else:
        axes.set_ylim(0.0, 1.1 * most or 1.0)
        fix_ticks(axes)


def _rest(axes: "Axes", result: Mapping[str, Any], clock: _Clock) -> None:
    """Mark where a hold began to carry the heading on, after its rest."""
    rest_s = result.get("plan", {}).get("rest_s")
    if not rest_s:
        return
    at = rest_s * clock.second
    axes.axvline(at, color=EDGE, linewidth=0.5, linestyle=(0, (1, 2)))
    label(axes, (at, 1.0), "held", axes.get_xaxis_transform(), shift_pt=(4.0, -5.0), color=INK3)


def _heading_in_words(history: History) -> str:
    (first_s, last_s), (first_deg, last_deg), (first_sigma, last_sigma) = (
        (column[0], column[-1])
        for column in (history.time_s, history.azimuth_deg, history.azimuth_sigma_deg)
    )
    return (
        f"From {azimuth_with_uncertainty(first_deg, 2.0 * first_sigma)} degrees after "
        f"{first_s:.0f} s to {azimuth_with_uncertainty(last_deg, 2.0 * last_sigma)} degrees after "
        f"{last_s:.0f} s, each with 2 sigma."
    )


def _level_in_words(history: History) -> str:
    decimals = decimals_of(float(np.nan_to_num(2.0 * history.level_sigma_deg[-1], nan=0.001)))
    ends = [
        f"{name} from {minus(f'{column.min():.{decimals}f}')} to "
        f"{minus(f'{column.max():.{decimals}f}')} degrees, {minus(f'{column[-1]:.{decimals}f}')} "
        f"at the end"
        for name, column in (
            ("pitch", history.pitch_deg[history.settled]),
            ("roll", history.roll_deg[history.settled]),
        )
    ]
    return f"Once settled, {ends[0]}; {ends[1]}."
