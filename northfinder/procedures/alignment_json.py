"""An alignment's result as REST, the records and the command line show it: degrees, plain JSON."""

from northfinder.alignment import Limits
from northfinder.procedures.alignment_result import Aligned, AlignmentRun, Moment
from northfinder.procedures.plain_json import (
    checks_json,
    headline,
    history_json,
    wrapped_deg,
)
from northfinder.rig import JsonObject
from northfinder.units import DEG

__all__ = ["budget_of", "headline", "result_json", "so_far_json"]

_NORMAL_95 = 1.959963984540054


def result_json(run: AlignmentRun) -> JsonObject:
    """Return every number of the result; the 95 % interval alone is not wrapped."""
    aligned = run.aligned
    azimuth_deg = wrapped_deg(aligned.table.azimuth_rad / DEG)
    sigma_deg = aligned.alignment.heading_sigma_rad / DEG
    half_width_deg = _NORMAL_95 * sigma_deg
    return {
        "azimuth_deg": azimuth_deg,
        "azimuth_sigma_deg": sigma_deg,
        "azimuth_interval95_deg": [azimuth_deg - half_width_deg, azimuth_deg + half_width_deg],
        "reference_azimuth_deg": wrapped_deg(azimuth_deg + run.reference_offset_rad / DEG),
        "pitch_deg": aligned.table.pitch_rad / DEG,
        "roll_deg": aligned.table.roll_rad / DEG,
        "level_sigma_deg": aligned.alignment.level_sigma_rad / DEG,
        "attitude_body_to_enu": [float(part) for part in aligned.alignment.q_b_n],
        "method": aligned.alignment.method,
        "duration_s": aligned.alignment.duration_s,
        "restarts": aligned.restarts,
        "bridged_samples": aligned.bridged,
        "budget": budget_of(aligned.alignment.limits),
        "checks": checks_json(run.checks),
        "history": _history_json(aligned),
        "visits": list(run.visits),
    }


def so_far_json(moment: Moment, restarts: int) -> JsonObject:
    """Return the heading so far, in the result's own names."""
    return {
        "time_s": moment.time_s,
        "azimuth_deg": wrapped_deg(moment.table.azimuth_rad / DEG),
        "azimuth_sigma_deg": moment.azimuth_sigma_rad / DEG,
        "pitch_deg": moment.table.pitch_rad / DEG,
        "roll_deg": moment.table.roll_rad / DEG,
        "level_sigma_deg": moment.level_sigma_rad / DEG,
        "restarts": restarts,
        "checks": [],
    }


def budget_of(limits: Limits) -> list[JsonObject]:
    """Return the heading's budget, line by line, and what each does to the level."""
    variance = float(sum(line.heading_rad**2 for line in limits.lines))
    return [
        {
            "source": line.source,
            "u_deg": float(line.heading_rad) / DEG,
            "share": float(line.heading_rad) ** 2 / variance if variance else 0.0,
            "level_u_deg": float(line.level_rad) / DEG,
        }
        for line in limits.lines
    ]


def _history_json(aligned: Aligned) -> JsonObject:
    return history_json(
        [moment.time_s for moment in aligned.history],
        [moment.table for moment in aligned.history],
        [moment.azimuth_sigma_rad for moment in aligned.history],
    )
