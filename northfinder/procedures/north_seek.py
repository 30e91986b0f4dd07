"""The north-seek: turn the table through its angles, measure at each, solve for north."""

from collections.abc import Sequence
from typing import Final

from northfinder.procedures.events import Emit
from northfinder.procedures.gate import Gate
from northfinder.procedures.journey import Journey
from northfinder.procedures.measuring import table_stopped_at_the_end
from northfinder.procedures.north_seek_json import north_seek_json as result_json
from northfinder.procedures.plain_json import headline
from northfinder.procedures.plan import Plan
from northfinder.procedures.planning import Prediction, predict
from northfinder.procedures.reduction import NorthSeek, reduce_visits
from northfinder.procedures.visits import Visit
from northfinder.rig import Rig

__all__ = [
    "RESUMABLE",
    "Emit",
    "NorthSeek",
    "Plan",
    "Prediction",
    "headline",
    "predict",
    "reduce_visits",
    "result_json",
    "run",
]

RESUMABLE: Final = True


async def run(  # noqa: PLR0913 -- the last three are a run's earlier life and its pauses
    rig: Rig,
    plan: Plan,
    emit: Emit,
    *,
    done: Sequence[Visit] = (),
    elapsed_s: float = 0.0,
    gate: Gate | None = None,
) -> NorthSeek:
    """Carry a plan out on an open rig; the table stands still afterwards whatever happens.

    After an interruption, that is with visits already done, or after a pause longer than a
    dwell, the table is homed and two angles are measured again: only when nothing moved does
    the run go on, in a new segment (`docs/theory.md`).

    Args:
        rig: The open rig.
        plan: What to measure.
        emit: Awaited for every event: a visit is kept before the next begins.
        done: The visits of an earlier life of this run.
        elapsed_s: From the start of the run to now; later than the end of every visit done.
        gate: Where the run waits before its next visit while it is paused.

    Raises:
        ConfigError: The plan cannot be carried out on this rig.
        AcquisitionError: Homing or a visit failed, or the bench has moved since the earlier
            visits; the message says where and how far.
        EstimationError: The readings do not determine north.
    """
    prediction = predict(plan, rig)
    journey = Journey(rig, prediction, emit, done, elapsed_s, gate or Gate())
    async with table_stopped_at_the_end(rig):
        await journey.travel()
    return reduce_visits(journey.visits, prediction.plan, rig.config)
