"""The alignment: attitude and heading of a base that may rock, from a three-axis instrument."""

import asyncio
from collections.abc import Sequence
from typing import Final

from northfinder.alignment import Limits, predict_limits
from northfinder.procedures.alignment_json import budget_of, headline, result_json
from northfinder.procedures.alignment_plan import METHODS, Plan, Wish, errors_of
from northfinder.procedures.alignment_reduction import concluded, reduce_visits
from northfinder.procedures.alignment_result import AlignmentRun
from northfinder.procedures.alignment_track import AlignmentTrack
from northfinder.procedures.events import Emit
from northfinder.procedures.gate import Gate
from northfinder.procedures.promise import Promise
from northfinder.procedures.sensor_errors import sensor_errors
from northfinder.procedures.tracking import Stream
from northfinder.procedures.visits import Visit
from northfinder.rig import Rig
from northfinder.units import DEG

__all__ = [
    "METHODS",
    "RESUMABLE",
    "AlignmentRun",
    "Plan",
    "Wish",
    "headline",
    "predict",
    "reduce_visits",
    "result_json",
    "run",
]

RESUMABLE: Final = False
_USELESS_RAD = 5.0 * DEG


def predict(plan: Plan, rig: Rig) -> Promise:
    """Say how long it takes and how well it finds north on a base at rest.

    Raises:
        ConfigError: How large a bias may be left is not known.
        EstimationError: No heading is observable at this latitude.
    """
    chosen = _with_sensors(plan, rig)
    latitude_rad = plan.latitude_rad(rig.config)
    limits = predict_limits(
        plan.method, latitude_rad, plan.duration_s, errors_of(chosen), plan.warm_s
    )
    numbers = {
        "azimuth_sigma_deg": limits.heading_sigma_rad / DEG,
        "budget": budget_of(limits),
    }
    return Promise(chosen, plan.warm_s + plan.duration_s, _warnings(limits), numbers)


async def run(  # noqa: PLR0913 -- every procedure's
    rig: Rig,
    plan: Plan,
    emit: Emit,
    *,
    done: Sequence[Visit] = (),
    elapsed_s: float = 0.0,
    gate: Gate | None = None,  # noqa: ARG001 -- nothing in it could wait
) -> AlignmentRun:
    """Align on an open rig; after a gap in the samples from the beginning.

    Raises:
        ConfigError: How large a bias may be left is not known.
        AcquisitionError: The table or the instrument failed, or lacks an axis.
        EstimationError: The samples determine no heading.
    """
    if done or elapsed_s:
        msg = "an alignment cannot be carried on: what the base turned meanwhile is not known"
        raise ValueError(msg)
    chosen = _with_sensors(plan, rig)
    stream = Stream(rig, emit, "aligning", plan.warm_s + plan.duration_s)
    instrument = await stream.prepare()
    track = AlignmentTrack(chosen, rig.config, instrument)
    visits = await stream.follow(track, instrument)
    return await asyncio.to_thread(concluded, track, visits, chosen, rig.config)


def _with_sensors(plan: Plan, rig: Rig) -> Plan:
    filled_in = {
        "sensors": plan.sensors or sensor_errors(rig),
        "sample_period_s": rig.gyro.sensor.sample_period_s,
    }
    return plan.model_copy(update=filled_in)


def _warnings(limits: Limits) -> list[str]:
    if limits.heading_sigma_rad < _USELESS_RAD:
        return []
    worst = max(limits.lines, key=lambda line: line.heading_rad)
    sentence = (
        f"the heading is predicted to {limits.heading_sigma_rad / DEG:.1f} deg (1 sigma), mostly "
        f"by the {worst.source}: this instrument hardly finds north so"
    )
    return [sentence]
