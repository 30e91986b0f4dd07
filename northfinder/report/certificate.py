"""The certificate: one printable HTML file of a run, complete in itself.

No script, no font, no picture from elsewhere: it reads the same in ten years, from a disk
without a network, and under any Content-Security-Policy that allows inline style.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from northfinder.errors import NorthfinderError
from northfinder.formatting import azimuth_with_uncertainty
from northfinder.records import Run, VisitStatistics
from northfinder.records.export import visit_json
from northfinder.report import facts, numbers
from northfinder.report.figures import can_draw, draw
from northfinder.report.wording import minus, quantity, significant, utc

Estimates = Sequence[Mapping[str, Any]]

_STATES = {
    "queued": "not begun",
    "running": "still running",
    "paused": "paused",
    "failed": "stopped by a failure",
    "aborted": "aborted",
    "interrupted": "interrupted",
}
_MOST_ROWS = 200  # of visits on paper; the whole table can be exported


class NoCertificateError(NorthfinderError):
    """This kind of run has no certificate."""


def certificate(
    run: Run, visits: Sequence[VisitStatistics], estimates: Estimates, samples_sha256: str
) -> str:
    """Return a north-seek's certificate; of a run without a result, the record of what it did.

    Args:
        run: As recorded.
        visits: Its completed visits in time order.
        estimates: Data of its ``estimate`` events in time order; none in old records.
        samples_sha256: Hash of its raw samples, hexadecimal.

    Raises:
        NoCertificateError: The run is no north-seek.
    """
    if run.kind != "north-seek":
        msg = f"run {run.id} is of the kind {run.kind}: only a north-seek has a certificate"
        raise NoCertificateError(msg)
    common = {
        "run": run,
        "footer": f"northfinder, run {run.id}{', SIMULATED' if run.simulation else ''}",
        "created": utc(run.created_utc),
        "facts": facts.how_it_was_measured(run, visits),
        "instruments": facts.instruments((run.result or {}).get("rig", run.rig)),
        "configuration": facts.configuration(run),
        "simulation": facts.simulation(run),
        "samples_sha256": samples_sha256,
    }
    if run.result is None:
        return _render("unfinished.html", common | _unfinished(run, visits, estimates))
    return _render("certificate.html", common | _completed(run, run.result, estimates))


def _completed(run: Run, result: Mapping[str, Any], estimates: Estimates) -> dict[str, Any]:
    has_reference = result["reference_azimuth_deg"] != result["azimuth_deg"]
    return {
        "north": numbers.north(result),
        "reference": numbers.north(result, "reference_azimuth_deg") if has_reference else None,
        "predicted": run.prediction and significant(2.0 * run.prediction["azimuth_sigma_deg"]),
        "repeated": any(visit.get("repeats") is not None for visit in result["visits"]),
        "verdict": numbers.verdict(result),
        "miss": None if result["simulation"] is None else numbers.miss(result),
        "solvers": numbers.solutions(result, ("coordinate_transform", "vector", "two_vector")),
        "comparisons": numbers.solutions(
            result, ("vector_published", "vector_uncorrected", "uncompensated")
        ),
        "budget": numbers.budget(result),
        "combined": significant(result["azimuth_sigma_deg"]),
        "exact": numbers.taken_as_exact(result),
        "gyro": numbers.gyro(result),
        "segments": numbers.segments(result),
        "accelerometer": numbers.accelerometer(result),
        "checks": numbers.checks(result),
        "figures": _figures(("dial", "fit", "budget", "convergence"), result, estimates),
    }


def _unfinished(
    run: Run, visits: Sequence[VisitStatistics], estimates: Estimates
) -> dict[str, Any]:
    rows = [visit_json(visit) for visit in visits]
    return {
        "state": _STATES.get(run.state, run.state),
        "so_far": _so_far(estimates[-1]) if estimates else None,
        "visits": [_row(visit) for visit in rows[:_MOST_ROWS]],
        "left_out": max(0, len(visits) - _MOST_ROWS),
        "figures": _figures(("fit", "convergence"), {"visits": rows}, estimates),
    }


def _figures(
    names: Sequence[str], result: Mapping[str, Any], estimates: Estimates
) -> dict[str, Markup | None]:
    """Draw what this run has the numbers for; the drawing escapes its own texts."""
    return {
        name: Markup(draw(name, result, estimates)) if can_draw(name, result, estimates) else None  # noqa: S704
        for name in names
    }


def _so_far(estimate: Mapping[str, Any]) -> str:
    return azimuth_with_uncertainty(estimate["azimuth_deg"], 2.0 * estimate["azimuth_sigma_deg"])


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


@cache
def _templates() -> Environment:
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["css_string"] = _css_string
    return templates


def _css_string(text: str) -> Markup:
    """Escape for a string in CSS (Syntax 3, 4.3.7), where HTML's escapes mean nothing."""
    plain = "".join(c if c.isalnum() and c.isascii() else f"\\{ord(c):x} " for c in text)
    return Markup(plain)  # noqa: S704 (letters, digits, and escapes of anything else)


def _render(template: str, values: Mapping[str, Any]) -> str:
    return _templates().get_template(template).render(values)
