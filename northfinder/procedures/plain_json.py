"""What the results of several procedures have in common as JSON: degrees, null for no number."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from northfinder.estimators.checks import Check
from northfinder.procedures.events import Progress
from northfinder.procedures.mounting import TableAttitude
from northfinder.procedures.visits import Visit
from northfinder.rig import JsonObject
from northfinder.units import DEG, DEG_PER_HOUR

_MOST_MOMENTS = 2000


def headline(numbers: Mapping[str, Any]) -> JsonObject:
    """Return what a list of runs shows of a result, or of north so far."""
    checks = numbers["checks"]
    statuses = [check["status"] for check in checks]
    return {
        "azimuth_deg": numbers["azimuth_deg"],
        "azimuth_sigma_deg": numbers["azimuth_sigma_deg"],
        "checks": {status: statuses.count(status) for status in ("pass", "warn", "fail")},
        "attention": [check["name"] for check in checks if check["status"] != "pass"],
    }


def progress_json(progress: Progress) -> JsonObject:
    """Return how far a run is, and what it does now."""
    angle_rad = progress.angle_rad
    return {
        "progress": progress.fraction,
        "left_s": progress.left_s,
        "phase": progress.phase,
        "doing": progress.sentence(),
        "visit": progress.visit,
        "visits": progress.visits,
        "angle_deg": None if angle_rad is None else angle_rad / DEG,
    }


def visit_json(visit: Visit) -> JsonObject:
    """Return one row of the record."""
    return {
        "index": visit.index,
        "segment": visit.segment,
        "repeats": visit.repeats,
        "direction": visit.direction,
        "angle_deg": visit.angle_rad / DEG,
        "gyro_mean_deg_h": visit.gyro.mean / DEG_PER_HOUR,
        "gyro_sigma_deg_h": visit.gyro.sigma / DEG_PER_HOUR,
        "accel_mean_g": visit.accelerometer.mean,
        "accel_sigma_g": visit.accelerometer.sigma,
        "samples": len(visit.gyro),
        "lost": visit.gyro.lost + visit.accelerometer.lost,
        "start_s": visit.start_s,
        "turned_deg": None if visit.turned_rad is None else visit.turned_rad / DEG,
    }


def counts_of(visits: Sequence[Mapping[str, Any]]) -> tuple[list[int], list[int]]:
    """Return how many gyro samples arrived in each visit, and how many were lost."""
    return [visit["samples"] for visit in visits], [visit["lost"] for visit in visits]


def checks_json(checks: Sequence[Check]) -> list[JsonObject]:
    """Return verdicts in words."""
    return [
        {"name": check.name, "status": check.status, "detail": check.detail} for check in checks
    ]


def wrapped_deg(angle_deg: float) -> float:
    """Return it in [0, 360): of a tiny negative angle, Python's remainder is 360 itself."""
    wrapped = angle_deg % 360.0
    return wrapped if wrapped < 360.0 else 0.0


def or_null(value: Any) -> float | None:  # noqa: ANN401 - a number in any of numpy's guises
    """Return a number; None where it is not finite, which JSON cannot say."""
    number = float(value)
    return number if math.isfinite(number) else None


def history_json(
    time_s: Sequence[float], tables: Sequence[TableAttitude], sigma_rad: Sequence[float]
) -> JsonObject:
    """Return how a table stood moment by moment, and the sigma of its azimuth.

    Of more than two thousand moments some, evenly spaced; the last always.
    """
    step = max(1, math.ceil(len(tables) / _MOST_MOMENTS))
    some = slice((len(tables) - 1) % step, None, step)
    return {
        "time_s": list(time_s[some]),
        "azimuth_deg": [wrapped_deg(table.azimuth_rad / DEG) for table in tables[some]],
        "azimuth_sigma_deg": [sigma / DEG for sigma in sigma_rad[some]],
        "pitch_deg": [table.pitch_rad / DEG for table in tables[some]],
        "roll_deg": [table.roll_rad / DEG for table in tables[some]],
    }
