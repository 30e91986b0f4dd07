"""What an alignment's certificate shows; with ``certificate``, implements ``Room``."""

from typing import Final

from northfinder.formatting import duration
from northfinder.records import Run
from northfinder.report import outcome
from northfinder.report.facts import Fact, recorded, site, stretches_in_words
from northfinder.report.figures import Estimates, Result
from northfinder.report.frame import Values, Visits, drawings, unfinished_drawings
from northfinder.report.wording import Quantity, plural, quantity, significant

_METHODS: Final = {
    "quest-taper": "QUEST over all observations, weighted t²(T − t)²",
    "quest": "QUEST over low-passed observations",
    "quest-raw": "QUEST over all observations, weighted alike",
    "quest-velocity": "QUEST over velocities, the integrals of the specific force",
    "triad": "TRIAD of two low-passed observations, at T/2 and T",
    "optimized-triad": "Optimized TRIAD of two low-passed observations, at T/2 and T",
}


def facts(run: Run, visits: Visits) -> list[Fact]:
    """Describe measurand, method, readings, site and time."""
    return [
        Fact(
            "Measurand",
            "Azimuth of the table's index mark, clockwise from true north, its elevation (pitch) "
            "and the table's roll about it, right side down, at the last moment of the record: "
            "the base may move. North is astronomic, the level that of the plumb line.",
        ),
        Fact("Method", _method(run)),
        Fact("Readings", stretches_in_words(run, visits)),
        site(run, run.plan.get("latitude_deg")),
        recorded(run),
    ]


def completed(run: Run, result: Result, estimates: Estimates) -> Values:
    """Return heading and level with what limits them."""
    return {
        **outcome.heading(run, result),
        "attitude": [*_level(result), *_stream(result)],
        "level_combined": significant(result["level_sigma_deg"]),
        "level_expanded": significant(2.0 * result["level_sigma_deg"]),
        "figures": drawings(("dial", "heading", "level", "budget"), result, estimates),
    }


def unfinished(run: Run, visits: Visits, estimates: Estimates) -> Values:
    """Return the heading so far."""
    headings = {
        "heading": ("Heading so far", "not a result"),
        "level": ("Pitch and roll so far", "not a result"),
    }
    return {
        "subtitle": "An alignment without a result: no azimuth is stated",
        "so_far": outcome.heading_so_far("At its last moment", estimates),
        "figures": unfinished_drawings(headings, run, visits, estimates),
    }


def _method(run: Run) -> str:
    name, warm_s = str(run.plan.get("method")), run.plan.get("warm_s", 0.0)
    warmed = f", the filter warmed for {duration(warm_s)} before" if warm_s else ""
    return (
        f"Alignment on a base that may rock, over {duration(run.plan.get('duration_s', 0.0))}"
        f"{warmed}: gravity turns with the Earth in inertial space, and the gyros carry the "
        f"accelerometers' readings there. {_METHODS.get(name, name)} ({name})."
    )


def _level(result: Result) -> list[Quantity]:
    sigma_deg = result["level_sigma_deg"]
    return [quantity(name, result[f"{name}_deg"], sigma_deg, "°") for name in ("pitch", "roll")]


def _stream(result: Result) -> list[Quantity]:
    bridged = plural(result["bridged_samples"], "sample")
    return [
        Quantity("aligned over", duration(result["duration_s"]), "", ""),
        Quantity("began anew", plural(result["restarts"], "time"), "", "", "after a long gap"),
        Quantity("bridged", bridged, "", "", "a straight line stands for them"),
    ]
