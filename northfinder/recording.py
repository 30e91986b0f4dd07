"""A north-seek that is kept from its first moment: a visit is durable before the next begins."""

import asyncio

from northfinder import records, software
from northfinder.config import RigConfig
from northfinder.errors import NorthfinderError
from northfinder.formatting import sentence_of
from northfinder.procedures import north_seek
from northfinder.procedures.events import Event, VisitCompleted
from northfinder.procedures.north_seek_json import JsonObject, north_seek_json
from northfinder.procedures.reduction import reduce_visits
from northfinder.procedures.visits import Visit
from northfinder.rig import Rig
from northfinder.validation import validated


async def record_north_seek(
    rig: Rig, plan: north_seek.Plan, writer: records.Writer, watch: north_seek.Emit
) -> JsonObject:
    """Run a north-seek on an open rig, and return its result as it is recorded.

    Whatever ends the run is in the record: completed, aborted by cancellation, or failed with
    the reason; every completed visit stays.

    Args:
        rig: The open rig.
        plan: What to measure.
        writer: The records' writer.
        watch: Receives every event, after what it carries is durable.

    Raises:
        NorthfinderError: The run failed; the record says so too.
    """
    plan = north_seek.predict(plan, rig).plan
    new = _new_run(rig, plan)
    run_id = await writer.create_run(new)

    async def emit(event: Event) -> None:
        if isinstance(event, VisitCompleted):
            visit = event.visit
            await writer.add_visit(
                run_id,
                _statistics(visit),
                {"gyro": visit.gyro, "accelerometer": visit.accelerometer},
            )
        await watch(event)

    try:
        await writer.set_state(run_id, "running")
        seek = await north_seek.run(rig, plan, emit)
    except asyncio.CancelledError:
        await writer.set_state(run_id, "aborted")
        raise
    except Exception as error:
        await writer.fail(run_id, sentence_of(error))
        raise
    # The devices once more, for their counters have counted since.
    rig_after = {**new.rig, "devices": rig.devices()}
    result = {**_frame(run_id, new, "completed"), "rig": rig_after, **north_seek_json(seek)}
    await writer.finish(run_id, result)
    return result


def recompute(store: records.Records, run_id: str) -> JsonObject:
    """Compute a recorded run's result again from its stored samples.

    Raises:
        RecordsError: No such run, or its samples are damaged.
        NorthfinderError: It is no north-seek, or its visits do not determine north.
    """
    run = store.run(run_id)
    if run.kind != "north-seek":
        msg = f"run {run.id} is of the kind {run.kind}: only a north-seek can be recomputed"
        raise NorthfinderError(msg)
    config = validated(RigConfig, run.rig["config"], f"run {run.id}")
    plan = validated(north_seek.Plan, run.plan, f"run {run.id}")
    visits = [_with_samples(store, run.id, entry) for entry in store.visits(run.id)]
    result = north_seek_json(reduce_visits(visits, plan, config))
    rig_after = run.result["rig"] if run.result is not None else run.rig
    return {**_frame(run.id, run, run.state), "rig": rig_after, **result}


def _new_run(rig: Rig, plan: north_seek.Plan) -> records.NewRun:
    unlimited_speed = {"simulation": {"speed"}}  # of no consequence, and infinity is no JSON
    config = rig.config.model_dump(mode="json", by_alias=True, exclude=unlimited_speed)
    return records.NewRun(
        kind="north-seek",
        rig_name=rig.config.site.name,
        plan=plan.model_dump(mode="json"),
        site={**config["site"], "gravity_g": rig.config.site.gravity_g},
        rig={"config": config, "devices": rig.devices()},
        simulation=None if rig.simulation is None else rig.simulation.truth(),
        software=dict(software.description()),
    )


def _frame(run_id: str, run: records.NewRun | records.Run, state: records.State) -> JsonObject:
    """Return what surrounds the numbers of a result; it comes from the record alone."""
    return {
        "kind": run.kind,
        "state": state,
        "run_id": run_id,
        "plan": run.plan,
        "site": run.site,
        "rig": run.rig,
        "simulation": run.simulation,
        "software": run.software,
    }


def _statistics(visit: Visit) -> records.VisitStatistics:
    return records.VisitStatistics(
        index=visit.index,
        segment=visit.segment,
        direction=visit.direction,
        angle_rad=visit.angle_rad,
        gyro_mean_rad_s=visit.gyro.mean,
        gyro_sigma_rad_s=visit.gyro.sigma,
        accel_mean_g=visit.accelerometer.mean,
        accel_sigma_g=visit.accelerometer.sigma,
        samples=len(visit.gyro),
        lost=visit.gyro.lost + visit.accelerometer.lost,
        start_s=visit.start_s,
        turned_rad=visit.turned_rad,
    )


def _with_samples(store: records.Records, run_id: str, entry: records.VisitStatistics) -> Visit:
    samples = store.samples(run_id, entry.index)
    return Visit(
        index=entry.index,
        segment=entry.segment,
        direction="back" if entry.direction == "back" else "out",
        angle_rad=entry.angle_rad,
        start_s=entry.start_s,
        turned_rad=entry.turned_rad,
        gyro=samples["gyro"],
        accelerometer=samples["accelerometer"],
    )
