"""The static figures of a north-seek, by name, as SVG."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from northfinder.errors import NorthfinderError
from northfinder.report.budget import draw_budget
from northfinder.report.convergence import draw_convergence
from northfinder.report.dial import draw_dial
from northfinder.report.harmonic_figures import draw_fit, draw_residuals

Result = Mapping[str, Any]
Estimates = Sequence[Mapping[str, Any]]


class UnknownFigureError(NorthfinderError, LookupError):
    """There is no figure of that name, or this run cannot fill it."""


#: Each draws from a run's result and the data of its ``estimate`` events.
FIGURES: Mapping[str, Callable[[Result, Estimates], str]] = MappingProxyType(
    {
        "fit": lambda result, _: draw_fit(result),
        "residuals": lambda result, _: draw_residuals(result),
        "dial": lambda result, _: draw_dial(result),
        "convergence": draw_convergence,
        "budget": lambda result, _: draw_budget(result),
    }
)


def draw(name: str, result: Result, estimates: Estimates = ()) -> str:
    """Draw one figure of a north-seek as an ``<svg>`` element, the same for the same record.

    Safe from any thread; the first figure imports matplotlib, which takes a second.

    Args:
        name: One of :data:`FIGURES`.
        result: As recorded; of a run without a result, ``{"visits": [...]}``, which ``fit``
            draws without a curve.
        estimates: Data of the run's ``estimate`` events in time order, for ``convergence``.

    Raises:
        UnknownFigureError: No such figure, or the run lacks what it shows.
    """
    if name not in FIGURES:
        msg = f"there is no figure {name!r}; there are {', '.join(FIGURES)}"
        raise UnknownFigureError(msg)
    lacking = _lacking(name, result, estimates)
    if lacking:
        msg = f"the figure {name!r} cannot be drawn: the run has no {lacking}"
        raise UnknownFigureError(msg)
    return FIGURES[name](result, estimates)


def can_draw(name: str, result: Result, estimates: Estimates = ()) -> bool:
    """Say whether the run has what a figure shows."""
    return name in FIGURES and _lacking(name, result, estimates) is None


def _lacking(name: str, result: Result, estimates: Estimates) -> str | None:
    if not result.get("visits"):
        return "completed visits"
    if name == "convergence":
        return None if estimates else "recorded estimates of the azimuth so far"
    return None if name == "fit" or "azimuth_deg" in result else "result"
