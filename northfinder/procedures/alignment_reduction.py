"""From the samples of an alignment to its result: live, and again from the records."""

import math
from collections.abc import Sequence

from northfinder.config import RigConfig
from northfinder.estimators.checks import Check, check_latitude, check_lost_samples
from northfinder.procedures.alignment_plan import Plan
from northfinder.procedures.alignment_result import Aligned, AlignmentRun
from northfinder.procedures.alignment_track import AlignmentTrack
from northfinder.procedures.plain_json import counts_of
from northfinder.procedures.tracking import follow_again, recorded_instrument
from northfinder.procedures.visits import Visit
from northfinder.rig import JsonObject
from northfinder.units import ARCMIN, DEG

_FORCE_TOLERANCE = 5e-4  # of gravity: scale factors and the anomalies of a site that is not known
_LIMITED_BY_BIAS_RAD = 1.0 * DEG


def reduce_visits(visits: Sequence[Visit], plan: Plan, config: RigConfig) -> AlignmentRun:
    """Align again from recorded samples, as the live alignment did.

    Raises:
        EstimationError: There is too little of them.
    """
    instrument = recorded_instrument(visits, plan.sample_period_s)
    track = AlignmentTrack(plan, config, instrument)
    kept = follow_again(track, visits, instrument.period_s)
    return concluded(track, kept, plan, config)


def concluded(
    track: AlignmentTrack, visits: Sequence[JsonObject], plan: Plan, config: RigConfig
) -> AlignmentRun:
    """Return the result of an alignment at its end.

    Raises:
        EstimationError: There is too little of it.
    """
    aligned = track.aligned()
    checks = [
        _check_gravity(aligned, plan, config),
        _check_sway(aligned),
        _check_bias(aligned),
        _check_gaps(aligned),
        check_lost_samples(*counts_of(visits)),
        check_latitude(plan.latitude_rad(config)),
    ]
    return AlignmentRun(aligned, visits, checks, config.site.reference_offset_deg * DEG)


def _check_gravity(aligned: Aligned, plan: Plan, config: RigConfig) -> Check:
    """Compare the size of the specific force with gravity: blind to tilt and heading."""
    expected_g = config.site.gravity_g
    bias_g = 0.0 if plan.sensors is None else plan.sensors.accel_bias_g
    limit_g = 3.0 * bias_g + _FORCE_TOLERANCE * expected_g
    off_g = aligned.mean_force_g - expected_g
    text = (
        f"The accelerometers read {aligned.mean_force_g:.5f} g on the whole, "
        f"{off_g * 1000:+.2f} mg off local gravity (limit {limit_g * 1000:.2f} mg)"
    )
    if abs(off_g) <= limit_g:
        return Check("gravity", "pass", f"{text}.")
    advice = "look at their scale factors, and whether the base was at rest on the whole."
    return Check("gravity", "warn" if abs(off_g) <= 4.0 * limit_g else "fail", f"{text}; {advice}")


def _check_sway(aligned: Aligned) -> Check:
    """Say how much of the uncertainty the base's own motion makes."""
    lines = {line.source: line.heading_rad for line in aligned.alignment.limits.lines}
    sway_rad = lines.pop("sway of the base")
    others_rad = math.hypot(*lines.values())
    text = (
        f"The base's sway makes {sway_rad / ARCMIN:.2f}' of the heading uncertain, the sensors "
        f"{others_rad / ARCMIN:.2f}'"
    )
    if sway_rad <= others_rad:
        return Check("sway", "pass", f"{text}.")
    return Check("sway", "warn", f"{text}; align longer, or by quest-taper, or at a calmer time.")


def _check_bias(aligned: Aligned) -> Check:
    """Say where no duration helps: an East bias passes for a heading."""
    bias_rad = next(
        line.heading_rad for line in aligned.alignment.limits.lines if line.source == "gyro bias"
    )
    text = f"What may be left of the gyros' biases turns the heading by {bias_rad / DEG:.3f} deg"
    if bias_rad <= _LIMITED_BY_BIAS_RAD:
        return Check("gyro bias", "pass", f"{text}; a longer alignment would not tell.")
    advice = "find north on the turning table, or state a smaller [gyro] bias_sigma_deg_h."
    return Check("gyro bias", "warn", f"{text}; {advice}")


def _check_gaps(aligned: Aligned) -> Check:
    text = (
        f"The alignment began anew {aligned.restarts} times, and {aligned.bridged} samples were "
        f"bridged"
    )
    if aligned.restarts:
        return Check("gaps", "warn", f"{text}; check the cable and the load of this computer.")
    return Check("gaps", "pass", f"{text}.")
