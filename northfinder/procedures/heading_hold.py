"""The heading hold: keep the heading that a run has found, from the gyro's stream alone."""

from collections.abc import Sequence
from typing import Final

from northfinder.config import RigConfig
from northfinder.estimators.checks import Check, check_lost_samples
from northfinder.procedures.events import Emit
from northfinder.procedures.gate import Gate
from northfinder.procedures.heading_hold_plan import Plan, Start, Wish
from northfinder.procedures.heading_hold_track import HoldRun, HoldTrack, held_json, start_of
from northfinder.procedures.holding import hold_budget
from northfinder.procedures.plain_json import (
    checks_json,
    counts_of,
    headline,
    history_json,
    wrapped_deg,
)
from northfinder.procedures.planning import budget_json
from northfinder.procedures.promise import Promise
from northfinder.procedures.sensor_errors import sensor_errors
from northfinder.procedures.tracking import Stream, follow_again, recorded_instrument
from northfinder.procedures.visits import Visit
from northfinder.rig import JsonObject, Rig
from northfinder.units import DEG, DEG_PER_HOUR

__all__ = [
    "RESUMABLE",
    "HoldRun",
    "Plan",
    "Start",
    "Wish",
    "headline",
    "predict",
    "reduce_visits",
    "result_json",
    "run",
]

RESUMABLE: Final = False
_REST_S: Final = 30.0


def predict(plan: Plan, rig: Rig) -> Promise:
    """Say how uncertain the heading will have become at the end.

    Raises:
        ConfigError: There is no heading to hold, or it is not known how large a bias may be left.
    """
    chosen = _chosen(plan, rig)
    start, rest_s = start_of(chosen), chosen.rest_s or 0.0
    errors = chosen.sensors or sensor_errors(rig)
    budget = hold_budget(start.azimuth_sigma_deg * DEG, errors, rest_s, plan.duration_s)
    numbers = {
        "azimuth_sigma_deg": float(budget.sigma_rad) / DEG,
        "budget": budget_json(budget),
    }
    return Promise(chosen, rest_s + plan.duration_s, (), numbers)


async def run(  # noqa: PLR0913 -- every procedure's
    rig: Rig,
    plan: Plan,
    emit: Emit,
    *,
    done: Sequence[Visit] = (),
    elapsed_s: float = 0.0,
    gate: Gate | None = None,  # noqa: ARG001 -- nothing in it could wait
) -> HoldRun:
    """Hold the heading on an open rig.

    Raises:
        ConfigError: There is no heading to hold, or it is not known how large a bias may be left.
        AcquisitionError: The table or the instrument failed, or what it sends carries no heading.
    """
    if done or elapsed_s:
        msg = "a heading hold cannot be carried on: what the base turned meanwhile is not known"
        raise ValueError(msg)
    chosen = _chosen(plan, rig)
    stream = Stream(rig, emit, "holding", (chosen.rest_s or 0.0) + chosen.duration_s)
    start_of(chosen)
    instrument = await stream.prepare()
    track = HoldTrack(chosen, rig.config, instrument)
    visits = await stream.follow(track, instrument)
    return _concluded(track, visits, chosen, rig.config)


def reduce_visits(visits: Sequence[Visit], plan: Plan, config: RigConfig) -> HoldRun:
    """Hold the heading again over recorded samples, as the live hold did."""
    instrument = recorded_instrument(visits, plan.sample_period_s)
    track = HoldTrack(plan, config, instrument)
    kept = follow_again(track, visits, instrument.period_s)
    return _concluded(track, kept, plan, config)


def result_json(run: HoldRun) -> JsonObject:
    """Return every number of the result: the heading at the end, and its whole history."""
    last = run.history[-1]
    numbers = held_json(last)
    half_width_deg = float(last.budget.interval95_rad) / DEG
    azimuth_deg = numbers["azimuth_deg"]
    return {
        **numbers,
        "azimuth_interval95_deg": [azimuth_deg - half_width_deg, azimuth_deg + half_width_deg],
        "reference_azimuth_deg": wrapped_deg(azimuth_deg + run.reference_offset_rad / DEG),
        "start": start_of(run.plan).model_dump(mode="json"),
        "method": run.plan.method,
        "gyro_bias_deg_h": [float(bias) / DEG_PER_HOUR for bias in run.bias_rad_s],
        "bridged_samples": run.bridged,
        "budget": budget_json(last.budget),
        "checks": checks_json(run.checks),
        "history": history_json(
            [held.time_s for held in run.history],
            [held.table for held in run.history],
            [float(held.budget.sigma_rad) for held in run.history],
        ),
        "visits": list(run.visits),
    }


def _chosen(plan: Plan, rig: Rig) -> Plan:
    """Fill in what is left open: the rest, and the instrument."""
    rest_s = plan.rest_s
    if rest_s is None:
        rest_s = _REST_S if start_of(plan).kind == "north-seek" else 0.0
    filled_in = {
        "rest_s": rest_s,
        "sensors": plan.sensors or sensor_errors(rig),
        "sample_period_s": rig.gyro.sensor.sample_period_s,
    }
    return plan.model_copy(update=filled_in)


def _concluded(
    track: HoldTrack, visits: Sequence[JsonObject], plan: Plan, config: RigConfig
) -> HoldRun:
    lost = check_lost_samples(*counts_of(visits))
    return HoldRun(
        plan,
        tuple(track.history),
        track.hold.bias_rad_s,
        track.bridged,
        visits,
        [_check_bias(track, plan), lost],
        config.site.reference_offset_deg * DEG,
    )


def _check_bias(track: HoldTrack, plan: Plan) -> Check:
    """Compare the biases that the rest showed with what the instrument may have."""
    expected_deg_h = plan.sensors.gyro_bias_deg_h if plan.sensors else 0.0
    if not plan.rest_s:
        text = (
            f"The gyros' biases were not measured: each may be {expected_deg_h:.3g} deg/h, and the "
            f"heading drifts by as much."
        )
        return Check("gyro bias", "pass", text)
    largest_deg_h = float(max(abs(track.hold.bias_rad_s))) / DEG_PER_HOUR
    limit_deg_h = 4.0 * expected_deg_h + 1.0
    text = f"At rest the largest bias was {largest_deg_h:.3f} deg/h (limit {limit_deg_h:.2g} deg/h)"
    if largest_deg_h <= limit_deg_h:
        return Check("gyro bias", "pass", f"{text}.")
    return Check(
        "gyro bias", "warn", f"{text}; was the base at rest, and is the heading still the same?"
    )
