"""Figures as people read them on paper: signs of the field instead of the names of units."""

import re
from typing import Final

from northfinder.studies.claim import Quantity

_SIGNS: Final = {"deg": "°", "arcmin": "′", "arcsec": "″", "deg/h": "°/h"}
_CLOSE = ("°", "′", "″")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def written(quantity: Quantity | str | None) -> str:
    """Write ``8.55°``, ``0.067 °/h``, ``9 009 m``; a dash where there is none."""
    if quantity is None:
        return "–"
    if isinstance(quantity, str):
        return quantity
    number = _scientific(quantity.number).replace("-", "−")
    unit = _SIGNS.get(quantity.unit, quantity.unit)
    return f"{number}{unit}" if unit in _CLOSE else f"{number} {unit}".strip()


def _scientific(number: str) -> str:
    """Write ``1.97e-3`` as in print, ``1.97 × 10⁻³``."""
    return re.sub(r"e\+?(-?\d+)", lambda power: f" × 10{power[1].translate(_RAISED)}", number)
