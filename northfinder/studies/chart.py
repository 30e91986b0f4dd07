"""What a figure shows, as data: the same for SVG and for whoever draws it again."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: The looks of a curve, told apart by dashes too, for a printer without colour.
Style = Literal["ours", "printed", "second", "third", "fourth", "dots", "rings"]


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A line or a row of marks; a name begins with the line's kind only where it must."""

    name: str
    x: ArrayLike
    y: ArrayLike
    style: Style = "ours"

    def points(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return x and y as arrays."""
        return np.asarray(self.x, dtype=np.float64), np.asarray(self.y, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Panel:
    """Two axes and their curves.

    Attributes:
        across: What goes to the right, with its unit.
        upwards: What goes upwards, with its unit.
        curves: Drawn in this order.
        levels: Horizontal lines: a height and its name, such as a printed figure.
        log_x: Whether the axis to the right is logarithmic.
        log_y: Whether the axis upwards is logarithmic.
        ticks: Places to the right that are named, and how; by default round numbers.
    """

    across: str
    upwards: str
    curves: tuple[Curve, ...]
    levels: tuple[tuple[float, str], ...] = ()
    log_x: bool = False
    log_y: bool = False
    ticks: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Chart:
    """One figure.

    Attributes:
        name: Of its file.
        title: What it is.
        description: What is to be seen in it, for those who cannot.
        panels: One or two to a row.
        columns: Panels in a row.
    """

    name: str
    title: str
    description: str
    panels: tuple[Panel, ...]
    columns: int = 1
