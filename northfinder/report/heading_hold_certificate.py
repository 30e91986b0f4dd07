"""What a heading hold's certificate shows; with ``certificate``, implements ``Room``."""

import math

from northfinder.formatting import azimuth_with_uncertainty, duration
from northfinder.records import Run
from northfinder.report import outcome
from northfinder.report.facts import Fact, recorded, site, stretches_in_words
from northfinder.report.figures import Estimates, Result
from northfinder.report.frame import Values, Visits, drawings, unfinished_drawings
from northfinder.report.wording import KINDS, UNDETERMINED, Quantity, minus, plural, quantity


def facts(run: Run, visits: Visits) -> list[Fact]:
    """Describe measurand, start, method, readings, site and time."""
    return [
        Fact(
            "Measurand",
            "Azimuth of the table's index mark, clockwise from true north, at the end of the hold; "
            "true north is that of the run that it starts from.",
        ),
        Fact("Start", _start(run)),
        Fact("Method", _method(run)),
        Fact("Readings", stretches_in_words(run, visits)),
        site(run, (run.plan.get("start") or {}).get("latitude_deg")),
        recorded(run),
    ]


def completed(run: Run, result: Result, estimates: Estimates) -> Values:
    """Return the heading at the end, how far it turned, and how its uncertainty grew."""
    return {
        **outcome.heading(run, result),
        "start": result["start"],
        "rest_s": run.plan.get("rest_s") or 0.0,
        "attitude": [_turned(result), *_level(result), *_biases(run, result), _bridged(result)],
        "figures": drawings(("dial", "heading", "level", "budget"), result, estimates),
    }


def unfinished(run: Run, visits: Visits, estimates: Estimates) -> Values:
    """Return the heading so far."""
    headings = {
        "heading": ("Heading so far", "not a result"),
        "level": ("Pitch and roll so far", "not a result"),
    }
    return {
        "subtitle": "A heading hold without a result: no azimuth is stated",
        "so_far": outcome.heading_so_far("At its last moment", estimates),
        "figures": unfinished_drawings(headings, run, visits, estimates),
    }


def _start(run: Run) -> str:
    start = run.plan.get("start")
    if start is None:
        return "No heading to start from was found."
    north = azimuth_with_uncertainty(start["azimuth_deg"], 2.0 * start["azimuth_sigma_deg"])
    kind = KINDS.get(start["kind"], start["kind"])
    return f"{north}° (2σ), by run {start['run_id']}, {kind}."


def _method(run: Run) -> str:
    plan = run.plan
    rest_s = plan.get("rest_s")
    rest = (
        f"At rest for {duration(rest_s)} to measure the gyros' biases, then held"
        if rest_s
        else "Without a rest to measure the gyros' biases, held"
    )
    return (
        f"{rest} for {duration(plan.get('duration_s', 0.0))} from the gyros alone, by the "
        f"integrator {plan.get('method')}; the turn of the Earth is taken off."
    )


def _turned(result: Result) -> Quantity:
    """Return the turn since the start; whole turns cannot be told from none."""
    budget = {line["source"]: line["u_deg"] for line in result["budget"]}
    budget.pop("heading at the start", None)
    turned_deg = math.remainder(result["azimuth_deg"] - result["start"]["azimuth_deg"], 360.0)
    return quantity("turned", turned_deg, math.hypot(*budget.values()), "°", "less whole turns")


def _level(result: Result) -> list[Quantity]:
    return [
        Quantity(name, minus(f"{result[f'{name}_deg']:.4f}"), "not stated", "°")
        for name in ("pitch", "roll")
    ]


def _biases(run: Run, result: Result) -> list[Quantity]:
    """Return what the rest showed; its noise is what the gyro's random walk leaves of a mean."""
    rest_s, names = run.plan.get("rest_s"), [f"gyro bias {axis}" for axis in "xyz"]
    if not rest_s:
        return [Quantity(name, UNDETERMINED, "", "") for name in names]
    walk = run.plan["sensors"]["gyro_noise_deg_sqrt_h"]
    sigma_deg_h = walk / math.sqrt(rest_s / 3600.0)
    return [
        quantity(name, bias, sigma_deg_h, "°/h", "from noise alone")
        for name, bias in zip(names, result["gyro_bias_deg_h"], strict=True)
    ]


def _bridged(result: Result) -> Quantity:
    bridged = plural(result["bridged_samples"], "sample")
    return Quantity("bridged", bridged, "", "", "a straight line stands for them")
