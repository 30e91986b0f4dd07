"""How the azimuth settled while the visits came in."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from northfinder.estimators.arrays import FloatArray
from northfinder.formatting import azimuth_with_uncertainty
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

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_PT, _LEFT_PT, _RIGHT_PT = 248.0, 30.0, 10.0
#: The first estimates may be off by half a turn; the scale is for those after this share.
_SETTLING_SHARE = 0.2


def draw_convergence(result: Mapping[str, Any], estimates: Sequence[Mapping[str, Any]]) -> str:
    """Draw the azimuth so far with its band of 2 sigma, after each visit.

    Args:
        result: A north-seek's, or the visits alone of a run that has none.
        estimates: Data of the stored ``estimate`` events, at least one, in time order.
    """
    visits = np.array([estimate["visits"] for estimate in estimates], dtype=np.float64)
    final_deg = result.get("azimuth_deg", estimates[-1]["azimuth_deg"])
    so_far_deg = np.array([estimate["azimuth_deg"] for estimate in estimates])
    # Around the final value, so that a run near north does not jump by a turn.
    azimuth_deg = final_deg + (so_far_deg - final_deg + 180.0) % 360.0 - 180.0
    two_sigma_deg = 2.0 * np.array([estimate["azimuth_sigma_deg"] for estimate in estimates])

    def paint(figure: "Figure") -> None:
        box_pt = (_LEFT_PT, 22.0, _WIDTH_PT - _LEFT_PT - _RIGHT_PT, 67.0)
        axes = add_axes(figure, box_pt, "azimuth so far, °, ±2σ")
        band = (azimuth_deg - two_sigma_deg, azimuth_deg + two_sigma_deg)
        axes.fill_between(visits, *band, facecolor=WEDGE, edgecolor="none")
        axes.axhline(final_deg, color=EDGE, linewidth=0.5)
        axes.plot(visits, azimuth_deg, color=BLUE)
        axes.plot(visits[-1:], azimuth_deg[-1:], "o", color=BLUE, markersize=3.0, clip_on=False)
        axes.set_xlim(0.0, len(result["visits"]))
        axes.set_ylim(*_limits(final_deg, azimuth_deg, two_sigma_deg))
        axes.locator_params(axis="y", nbins=4)
        axes.locator_params(axis="x", integer=True)
        _way_back(axes, result["visits"])
        label(add_plane(figure), (_WIDTH_PT - _RIGHT_PT, 3.0), "visits", align="right")

    title = "Azimuth so far after each visit, with its uncertainty"
    first, last = (
        azimuth_with_uncertainty(azimuth_deg[place], two_sigma_deg[place]) for place in (0, -1)
    )
    words = (
        f"From {first} degrees after {visits[0]:.0f} visits to {last} degrees after "
        f"{visits[-1]:.0f}, each with 2 sigma."
    )
    return render(Sheet("convergence", title, _WIDTH_PT, 105.0, words), paint)


def _limits(
    final_deg: float, azimuth_deg: FloatArray, two_sigma_deg: FloatArray
) -> tuple[float, float]:
    """Return a scale on which the end can be read; the settling may run out of it."""
    settled = min(round(_SETTLING_SHARE * len(azimuth_deg)), len(azimuth_deg) - 1)
    reach_deg = np.abs(azimuth_deg - final_deg) + two_sigma_deg
    half_deg = 1.05 * float(np.max(reach_deg[settled:])) or 1.0
    return final_deg - half_deg, final_deg + half_deg


def _way_back(axes: "Axes", visits: Sequence[Mapping[str, Any]]) -> None:
    """Mark where the way back begins, in a run that went out and back once."""
    directions = [visit["direction"] for visit in visits]
    turns = [n for n in range(1, len(directions)) if directions[n - 1] != directions[n]]
    if len(turns) != 1:
        return
    axes.axvline(turns[0], color=EDGE, linewidth=0.5, linestyle=(0, (1, 2)))
    for words, align, shift_pt in (("out", "right", -4.0), ("back", "left", 4.0)):
        label(axes, (turns[0], 1.0), words, axes.get_xaxis_transform(),
              shift_pt=(shift_pt, -5.0), align=align, color=INK3)  # fmt: skip
