"""Scales of a figure: round numbers in equal decimals, and decades."""

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from northfinder.report.wording import minus, power_of_ten

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TICKS = 4


def fix_ticks(axes: "Axes", wrap_deg: float | None = None) -> None:
    """Write the upward scale in round numbers of equal decimals.

    Args:
        axes: Its limits are set.
        wrap_deg: 360 where the scale counts on beyond north, and its numbers shall not.
    """
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 (late, as in the canvas)

    low, high = axes.get_ylim()
    ticks = np.array(MaxNLocator(_TICKS, steps=[1, 2, 5, 10]).tick_values(low, high))
    decimals = max(0, -math.floor(math.log10(ticks[1] - ticks[0]) + 1e-9))
    ticks = ticks[(ticks >= low) & (ticks <= high)]
    shown = np.round(ticks, decimals)
    if wrap_deg is not None:
        shown = np.round(shown % wrap_deg, decimals) % wrap_deg
    axes.set_yticks(ticks, [minus(f"{value + 0.0:.{decimals}f}") for value in shown])


def make_logarithmic(axes: "Axes", which: Literal["x", "y"], limits: tuple[float, float]) -> None:
    """Make a scale logarithmic, its decades in plain text: the canvas reads no mathematics.

    Args:
        axes: To be scaled.
        which: Of its two scales.
        limits: Of that scale, above 0.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: PLC0415

    axes.set(**{f"{which}scale": "log", f"{which}lim": limits})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1.0,) if limits[1] > 30.0 * limits[0] else (1, 2, 5)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
    axis.set_minor_formatter(NullFormatter())
