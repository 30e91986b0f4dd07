"""What a north-seek's certificate shows; with ``certificate``, implements ``Room``."""

from collections.abc import Mapping
from typing import Any

from northfinder.records import Run
from northfinder.records.export import visit_json
from northfinder.report import numbers, outcome
from northfinder.report.facts import Fact, recorded, site, visits_in_words
from northfinder.report.figures import Estimates, Result
from northfinder.report.frame import Values, Visits, drawings, unfinished_drawings
from northfinder.report.wording import ORDERS, minus, quantity

_MOST_ROWS = 200  # of visits on paper; the whole table can be exported


def facts(run: Run, visits: Visits) -> list[Fact]:
    """Describe measurand, method, readings, site and time."""
    return [
        Fact(
            "Measurand",
            "Azimuth of the table's index mark (its angle zero): the horizontal angle from true "
            "north, clockwise. North is astronomic, by the Earth's rotation and the plumb line.",
        ),
        Fact("Method", _method(run.plan)),
        Fact("Readings", _readings(run.plan, visits)),
        site(run, run.plan.get("latitude_deg")),
        recorded(run),
    ]


def completed(run: Run, result: Result, estimates: Estimates) -> Values:
    """Return the azimuth with everything that speaks for it, and against it."""
    return {
        **outcome.heading(run, result),
        "repeated": any(visit.get("repeats") is not None for visit in result["visits"]),
        "solvers": numbers.solutions(result, ("coordinate_transform", "vector", "two_vector")),
        "comparisons": numbers.solutions(
            result, ("vector_published", "vector_uncorrected", "uncompensated")
        ),
        "gyro": numbers.gyro(result),
        "segments": numbers.segments(result),
        "accelerometer": numbers.accelerometer(result),
        "figures": drawings(("dial", "fit", "budget", "convergence"), result, estimates),
    }


def unfinished(run: Run, visits: Visits, estimates: Estimates) -> Values:
    """Return the visits that were completed, and the azimuth so far."""
    headings = {
        "fit": ("Readings", "no fit: the run has no result"),
        "convergence": ("Azimuth so far", "not a result"),
    }
    return {
        "subtitle": "A north-seek without a result: no azimuth is stated",
        "so_far": outcome.heading_so_far("After its last completed visit", estimates),
        "figures": unfinished_drawings(headings, run, visits, estimates),
        "visits": [_row(visit_json(visit)) for visit in visits[:_MOST_ROWS]],
        "left_out": max(0, len(visits) - _MOST_ROWS),
    }


def _method(plan: Mapping[str, Any]) -> str:
    revolutions, order = plan.get("revolutions", 1), str(plan.get("order"))
    turns = "one revolution" if revolutions == 1 else f"{revolutions} revolutions"
    return (
        f"Gyrocompassing: rotation rate and specific force along a horizontal axis at "
        f"{plan.get('positions', '?')} table angles of {turns}, {ORDERS.get(order, order)}; "
        "R + a cos T + b sin T fitted to each; azimuth by coordinate transform with the tilt."
    )


def _readings(plan: Mapping[str, Any], visits: Visits) -> str:
    dwell_s, settle_s = plan.get("dwell_s", 0.0), plan.get("settle_s", 0.0)
    return visits_in_words(
        visits,
        f"{dwell_s:g} s at each angle in all, each visit after {settle_s:g} s of settling; ",
    )


def _row(visit: Mapping[str, Any]) -> dict[str, str]:
    rate = quantity("", visit["gyro_mean_deg_h"], visit["gyro_sigma_deg_h"], "")
    force = quantity("", visit["accel_mean_g"], visit["accel_sigma_g"], "", scale=1e3)
    return {
        "number": str(visit["index"] + 1),
        "segment": str(visit["segment"] + 1),
        "direction": visit["direction"],
        "angle": minus(f"{visit['angle_deg']:.4f}"),
        "start": f"{visit['start_s']:.1f}",
        "rate": f"{rate.value} {rate.uncertainty}",
        "force": f"{force.value} {force.uncertainty}",
        "samples": str(visit["samples"]),
        "lost": str(visit["lost"]),
    }
