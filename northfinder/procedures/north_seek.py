"""The north-seek: turn the table through its angles, measure at each, solve for north."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from drivers.errors import DriverError
from northfinder.errors import AcquisitionError
from northfinder.procedures.acquisition import collect, settle
from northfinder.procedures.events import Estimate, Event, Progress, VisitCompleted
from northfinder.procedures.plan import Plan
from northfinder.procedures.planning import Prediction, predict
from northfinder.procedures.reduction import NorthSeek, estimate_so_far, reduce_visits
from northfinder.procedures.turning import watch_turning
from northfinder.procedures.visits import PlannedVisit, Visit
from northfinder.rig import Rig
from northfinder.units import DEG

__all__ = ["Emit", "Plan", "predict", "run"]

Emit = Callable[[Event], Awaitable[None]]


async def run(rig: Rig, plan: Plan, emit: Emit) -> NorthSeek:
    """Carry a plan out on an open rig; the table stands still afterwards whatever happens.

    Args:
        rig: The open rig.
        plan: What to measure.
        emit: Awaited for every event: a visit is kept before the next begins.

    Raises:
        ConfigError: The plan cannot be carried out on this rig.
        AcquisitionError: Homing or a visit failed; the message says where.
        EstimationError: The readings do not determine north.
    """
    prediction = predict(plan, rig)
    start_s = asyncio.get_running_loop().time()
    visits: list[Visit] = []
    async with _table_stopped_at_the_end(rig):
        await emit(_progress(prediction, 0.0, "finding the table's reference"))
        await _home_if_needed(rig)
        for planned in prediction.visits:
            done_s = prediction.end_s[planned.index - 1] if planned.index else prediction.homing_s
            doing = f"measuring at {planned.angle_rad / DEG:g} deg"
            await emit(_progress(prediction, done_s, doing))
            visits.append(await _visit(rig, planned, prediction, start_s))
            await emit(VisitCompleted(visits[-1]))
            so_far = estimate_so_far(visits, prediction.plan, rig.config)
            if so_far is not None:
                await emit(Estimate(*so_far, visits=len(visits)))
    await emit(_progress(prediction, prediction.duration_s, "solving for north"))
    return reduce_visits(visits, prediction.plan, rig.config)


def _progress(prediction: Prediction, done_s: float, doing: str) -> Progress:
    total_s = prediction.duration_s
    return Progress(done_s / total_s, total_s - done_s, doing)


async def _home_if_needed(rig: Rig) -> None:
    try:
        state = await rig.table_state()
        if not state.homed:
            await rig.home()
    except DriverError as error:
        msg = f"finding the table's reference failed: {error}"
        raise AcquisitionError(msg) from error


async def _visit(rig: Rig, planned: PlannedVisit, prediction: Prediction, start_s: float) -> Visit:
    try:
        return await _measure(rig, planned, prediction.plan.settle_s, start_s)
    except (DriverError, AcquisitionError) as error:
        reason: Exception = error
    except ExceptionGroup as both:  # of the two collections; the first that failed says why
        reason = both.exceptions[0]
        if not isinstance(reason, DriverError | AcquisitionError):
            raise
    where = f"visit {planned.index + 1} of {len(prediction.visits)}"
    msg = f"{where}, at {planned.angle_rad / DEG:g} deg: {reason}"
    raise AcquisitionError(msg) from reason


async def _measure(rig: Rig, planned: PlannedVisit, settle_s: float, start_s: float) -> Visit:
    """Turn to one angle, settle, and collect both axes over the same stretch of time."""
    async with watch_turning(rig.gyro.sensor) as meter:
        await rig.move_to(planned.angle_rad)
        async with rig.gyro.sensor.listen() as rates, rig.accelerometer.sensor.listen() as forces:
            begin_s = await settle(rig, rates, settle_s)
            turned_rad = meter.finish()
            async with asyncio.TaskGroup() as both:
                gyro = both.create_task(collect(rig.gyro, rates, begin_s, planned.dwell_s))
                accelerometer = both.create_task(
                    collect(rig.accelerometer, forces, begin_s, planned.dwell_s)
                )
    return Visit(
        index=planned.index,
        segment=0,
        direction=planned.direction,
        angle_rad=planned.angle_rad,
        start_s=begin_s - start_s,
        turned_rad=turned_rad,
        gyro=gyro.result(),
        accelerometer=accelerometer.result(),
    )


@asynccontextmanager
async def _table_stopped_at_the_end(rig: Rig) -> AsyncIterator[None]:
    """Stop the table on the way out; a table that does not confirm is part of the error."""
    try:
        yield
    except BaseException as error:
        try:
            await rig.stop()
        except DriverError as unconfirmed:
            error.add_note(f"The table did not confirm that it stopped: {unconfirmed}")
        raise
    await rig.stop()
