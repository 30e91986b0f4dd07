"""The static figures of a run, by its kind and their names, as SVG."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from northfinder.errors import NorthfinderError
from northfinder.records import Run, VisitStatistics
from northfinder.records.export import visit_json
from northfinder.report.allan_figure import draw_allan
from northfinder.report.budget import draw_budget
from northfinder.report.convergence import draw_convergence
from northfinder.report.dial import draw_dial
from northfinder.report.harmonic_figures import draw_fit, draw_residuals
from northfinder.report.history_figures import draw_heading, draw_level
from northfinder.report.wording import KINDS

Result = Mapping[str, Any]
Estimates = Sequence[Mapping[str, Any]]


class UnknownFigureError(NorthfinderError, LookupError):
    """There is no figure of that name, or this run cannot fill it."""


class _Figure(NamedTuple):
    """A drawing, and what a run lacks that cannot fill it; None where it can."""

    draw: Callable[[Result, Estimates], str]
    lacking: Callable[[Result, Estimates], str | None]


def _visits(result: Result, _: Estimates) -> str | None:
    return None if result.get("visits") else "completed visits"


def _outcome(result: Result, estimates: Estimates) -> str | None:
    return _visits(result, estimates) or (None if "azimuth_deg" in result else "result")


def _so_far(result: Result, estimates: Estimates) -> str | None:
    told = None if estimates else "recorded estimates of the azimuth so far"
    return _visits(result, estimates) or told


def _history(result: Result, estimates: Estimates) -> str | None:
    return None if estimates or "history" in result else "recorded heading"


def _deviations(result: Result, estimates: Estimates) -> str | None:
    return None if estimates or "gyro" in result else "noise determined"


def _newest(result: Result, estimates: Estimates) -> Result:
    return result if "gyro" in result else estimates[-1]


_HEADINGS = {
    "dial": _Figure(lambda result, _: draw_dial(result), _outcome),
    "heading": _Figure(draw_heading, _history),
    "level": _Figure(draw_level, _history),
    "budget": _Figure(lambda result, _: draw_budget(result), _outcome),
}
#: Each draws from a run's result and the data of its ``estimate`` events.
FIGURES: Mapping[str, Mapping[str, _Figure]] = MappingProxyType(
    {
        "north-seek": {
            "fit": _Figure(lambda result, _: draw_fit(result), _visits),
            "residuals": _Figure(lambda result, _: draw_residuals(result), _outcome),
            "dial": _HEADINGS["dial"],
            "convergence": _Figure(draw_convergence, _so_far),
            "budget": _HEADINGS["budget"],
        },
        "alignment": _HEADINGS,
        "heading-hold": _HEADINGS,
        "noise": {
            "allan-gyro": _Figure(lambda r, e: draw_allan(_newest(r, e), "gyro"), _deviations),
            "allan-accelerometer": _Figure(
                lambda r, e: draw_allan(_newest(r, e), "accelerometer"), _deviations
            ),
        },
    }
)


def drawn_from(run: Run, visits: Sequence[VisitStatistics]) -> Result:
    """Return what a run's figures are drawn from: its result, or as much as it has without one."""
    if run.result is not None:
        return run.result
    rows = [visit_json(visit) for visit in visits]
    return {"kind": run.kind, "plan": run.plan, "rig": run.rig, "visits": rows}


def draw(name: str, result: Result, estimates: Estimates = ()) -> str:
    """Draw one figure of a run as an ``<svg>`` element, the same for the same record.

    Safe from any thread; the first figure imports matplotlib, which takes a second.

    Args:
        name: One of those that :data:`FIGURES` has for the kind of run.
        result: As recorded; of a run without a result, what :func:`drawn_from` makes of it.
        estimates: Data of the run's ``estimate`` events in time order.

    Raises:
        UnknownFigureError: No such figure, or the run lacks what it shows.
    """
    kind = _kind(result)
    figures = FIGURES[kind]
    if name not in figures:
        msg = f"{KINDS[kind]} has no figure {name!r}; it has {', '.join(figures)}"
        raise UnknownFigureError(msg)
    lacking = figures[name].lacking(result, estimates)
    if lacking:
        msg = f"the figure {name!r} cannot be drawn: the run has no {lacking}"
        raise UnknownFigureError(msg)
    return figures[name].draw(result, estimates)


def can_draw(name: str, result: Result, estimates: Estimates = ()) -> bool:
    """Say whether the run has what a figure shows."""
    figure = FIGURES[_kind(result)].get(name)
    return figure is not None and figure.lacking(result, estimates) is None


def _kind(result: Result) -> str:
    return str(result.get("kind", "north-seek"))
