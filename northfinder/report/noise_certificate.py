"""What a noise record's certificate shows; with ``certificate``, implements ``Room``."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from northfinder.formatting import decimals_of, duration
from northfinder.records import Run
from northfinder.report import outcome
from northfinder.report.facts import Fact, recorded, site, stretches_in_words
from northfinder.report.figures import Estimates, Result
from northfinder.report.frame import Values, Visits, drawings, unfinished_drawings
from northfinder.report.wording import minus, plural, quantity, unit_of

_SENSORS = ("gyro", "accelerometer")


def facts(run: Run, visits: Visits) -> list[Fact]:
    """Describe measurand, method, readings, site and time."""
    return [
        Fact(
            "Measurand",
            "Random errors of one gyro and one accelerometer axis while the table stands still: "
            "the coefficients of the Allan variance as IEEE Std 952 defines them.",
        ),
        Fact("Method", _method(run)),
        Fact("Readings", stretches_in_words(run, visits)),
        site(run, None),
        recorded(run),
    ]


def completed(run: Run, result: Result, estimates: Estimates) -> Values:
    """Return the figures of both sensors, and the dwell that follows from them."""
    del run
    suggestion = result["suggestion"]
    return {
        "walk": _row(result["gyro"]["figures"][0]),
        "verdict": outcome.verdict(result),
        "checks": outcome.checks(result),
        "dwell": None if suggestion is None else f"{suggestion['dwell_s']:.3g}",
        "reason": None if suggestion is None else _sentence(suggestion["reason"]),
        "sensors": [_sensor(name, result[name]) for name in _SENSORS],
        "figures": drawings(("allan-gyro", "allan-accelerometer"), result, estimates),
    }


def unfinished(run: Run, visits: Visits, estimates: Estimates) -> Values:
    """Return the noise so far."""
    headings = {f"allan-{name}": (f"Noise of the {name} so far", "not a result")
                for name in _SENSORS}  # fmt: skip
    return {
        "subtitle": "A noise record without a result: no figure is stated",
        "so_far": _so_far(estimates),
        "figures": unfinished_drawings(headings, run, visits, estimates),
    }


@dataclass(frozen=True, slots=True)
class Row:
    """One figure of a sensor; what was not seen has a bound in place of an interval."""

    name: str
    value: str
    interval: str
    unit: str


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor's axis, what its record was, and its figures."""

    title: str
    record: str
    rows: list[Row]


def _method(run: Run) -> str:
    return (
        f"Static record of {duration(run.plan.get('duration_s', 0.0))}: overlapping Allan "
        f"deviation with its 95 % band, a drift taken out; the figures by maximum likelihood over "
        f"all scales, each with its 95 % interval, or a bound where zero lies in it."
    )


def _sensor(name: str, sensor: Mapping[str, Any]) -> Sensor:
    filled = f", {sensor['filled']} of them filled in" if sensor["filled"] else ""
    unit = unit_of(sensor["unit"])
    mean = minus(f"{sensor['mean'] * unit.scale:.6g}")
    return Sensor(
        f"{name}, axis {sensor['axis']}",
        f"{plural(sensor['samples'], 'sample')}{filled}, one every "
        f"{sensor['sample_period_s'] * 1e3:.6g} ms; mean {mean} {unit.name}",
        [*(_row(figure) for figure in sensor["figures"]), _drift(sensor["drift"])],
    )


def _row(figure: Mapping[str, Any]) -> Row:
    unit, value, upper = unit_of(figure["unit"]), figure["value"], figure["upper"]
    if value is None:
        bound = "nothing can be said" if upper is None else f"below {upper * unit.scale:.2g}"
        return Row(figure["name"], "not seen", bound, unit.name)
    ends = [value if upper is None else upper, figure["lower"]]
    decimals = decimals_of(0.5 * unit.scale * abs(ends[0] - ends[1]))
    value, lower = (f"{each * unit.scale:.{decimals}f}" for each in (value, figure["lower"]))
    until = "" if upper is None else f" to {upper * unit.scale:.{decimals}f}"
    return Row(figure["name"], value, f"{lower}{until}" if until else f"from {lower}", unit.name)


def _drift(drift: Mapping[str, Any]) -> Row:
    unit = unit_of(drift["unit"])
    row = quantity("drift", drift["value"], drift["sigma"], unit.name, scale=unit.scale)
    if drift["seen"]:
        return Row(row.name, row.value, f"{row.uncertainty} (2σ)", row.unit)
    return Row(row.name, "not seen", f"{row.value} {row.uncertainty} (2σ)", row.unit)


def _so_far(estimates: Estimates) -> str | None:
    if not estimates:
        return None
    walk = _row(estimates[-1]["gyro"]["figures"][0])
    return f"So far the gyro's {walk.name} was {walk.value}, {walk.interval} {walk.unit} (95 %)"


def _sentence(reason: str) -> str:
    return f"{reason[:1].upper()}{reason[1:]}."
