"""The compass: where the index mark points, and how surely."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from northfinder.estimators.arrays import FloatArray
from northfinder.formatting import azimuth_with_uncertainty
from northfinder.report.canvas import (
    BLUE,
    EDGE,
    INK,
    INK2,
    INK3,
    WEDGE,
    Sheet,
    add_plane,
    label,
    render,
    segments,
)
from northfinder.report.readings import Readings, gyro_mount_deg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE_PT, _CAPTION_PT = 146.0, 12.0
_CENTRE_PT = (_SIZE_PT / 2.0, _SIZE_PT / 2.0 + _CAPTION_PT)
_RADIUS_PT = _SIZE_PT / 2.0 - 14.0
_WIDEST_DEG = 10.0  # what the drawn half wedge is kept below


def draw_dial(result: Mapping[str, Any]) -> str:
    """Draw north up, the index mark's line, and the wedge of 2 sigma, widened as it says."""
    azimuth_deg, two_sigma_deg = result["azimuth_deg"], 2.0 * result["azimuth_sigma_deg"]
    factor = exaggeration(two_sigma_deg)
    turned = "gyro_fit" in result  # a table; what stands still has no directions to dot

    def paint(figure: "Figure") -> None:
        plane = add_plane(figure)
        _wedge(plane, azimuth_deg, factor * two_sigma_deg)
        _rose(plane)
        if turned:
            _measured(plane, result)
        _line(plane, azimuth_deg, BLUE, "solid")
        reference_deg = result["reference_azimuth_deg"]
        if reference_deg != azimuth_deg:
            _line(plane, reference_deg, INK2, (0, (4, 2)))
        label(
            plane, (_CENTRE_PT[0], 3.0), _caption(factor, dashed=reference_deg != azimuth_deg,
            dotted=turned), align="center",
        )  # fmt: skip

    title = "Compass: the azimuth of the table's index mark, with its uncertainty"
    north = azimuth_with_uncertainty(azimuth_deg, two_sigma_deg)
    words = f"It points to {north} degrees, 2 sigma, clockwise from north."
    return render(Sheet("dial", title, _SIZE_PT, _SIZE_PT + _CAPTION_PT, words), paint)


def exaggeration(two_sigma_deg: float) -> float:
    """Return the factor of 1, 2, 5, 10, ... that draws the half wedge at 4 to 10 degrees."""
    factor = 1.0
    for step in (2.0, 2.5, 2.0) * 12:
        if factor * step * two_sigma_deg > _WIDEST_DEG:
            break
        factor *= step
    return factor


def _caption(factor: float, *, dashed: bool, dotted: bool) -> str:
    words = "wedge ±2σ" if factor == 1.0 else f"wedge ±2σ, drawn ×{factor:.0f}"
    if dashed:
        return f"{words}; dashed: reference"
    return f"{words}; dots: measured" if dotted else words


def _at(azimuth_deg: FloatArray, radius_pt: float) -> tuple[FloatArray, FloatArray]:
    azimuth_rad = np.deg2rad(azimuth_deg)
    x0, y0 = _CENTRE_PT
    return x0 + radius_pt * np.sin(azimuth_rad), y0 + radius_pt * np.cos(azimuth_rad)


def _rose(plane: "Axes") -> None:
    for every_deg, length_pt, width_pt, color in (
        (2, 3.0, 0.4, EDGE),
        (10, 5.5, 0.6, INK3),
        (30, 8.0, 0.9, INK),
    ):
        around_deg = np.arange(0.0, 360.0, every_deg)
        inner, outer = _at(around_deg, _RADIUS_PT - length_pt), _at(around_deg, _RADIUS_PT)
        plane.plot(*segments(*inner, *outer), color=color, linewidth=width_pt)
    for azimuth_deg in range(0, 360, 30):
        x, y = _at(np.array(float(azimuth_deg)), _RADIUS_PT - 17.0)
        letter = {0: "N", 90: "E", 180: "S", 270: "W"}.get(azimuth_deg)
        at = (float(x), float(y) - (3.2 if letter else 2.2))
        if letter:
            label(plane, at, letter, align="center", color=INK, size_pt=9.5, weight="bold")
        else:
            label(plane, at, str(azimuth_deg), align="center", size_pt=6.0)


def _wedge(plane: "Axes", azimuth_deg: float, half_angle_deg: float) -> None:
    half_deg = min(half_angle_deg, 180.0)
    around_deg = azimuth_deg + np.linspace(-half_deg, half_deg, 91)
    x, y = _at(around_deg, _RADIUS_PT)
    if half_deg < 180.0:
        x, y = np.append(x, _CENTRE_PT[0]), np.append(y, _CENTRE_PT[1])
    plane.fill(x, y, facecolor=WEDGE, edgecolor=BLUE, linewidth=0.3)


def _line(plane: "Axes", azimuth_deg: float, color: str, style: Any) -> None:  # noqa: ANN401
    x, y = _at(np.array(azimuth_deg), _RADIUS_PT)
    line = segments(*_CENTRE_PT, x, y)
    plane.plot(*line, color=color, linestyle=style, linewidth=1.4)
    plane.plot(*_CENTRE_PT, marker="o", markersize=5.0, markerfacecolor="white",
               markeredgecolor=BLUE, markeredgewidth=1.2)  # fmt: skip


def _measured(plane: "Axes", result: Mapping[str, Any]) -> None:
    """Dot every direction that the gyro was turned to."""
    angle_deg = np.unique(np.round(Readings.of(result).angle_deg, 6))
    facing_deg = result["azimuth_deg"] - angle_deg - gyro_mount_deg(result)
    plane.plot(*_at(facing_deg, _RADIUS_PT + 6.0), linestyle="none", marker="o", markersize=2.4,
               markerfacecolor=BLUE, markeredgewidth=0.0)  # fmt: skip
