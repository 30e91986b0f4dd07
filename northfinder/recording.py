"""A run that is kept from its first moment: a visit is durable before the next begins."""

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any, Literal

from pydantic import BaseModel

from northfinder import records, software
from northfinder.errors import ConfigError
from northfinder.formatting import sentence_of
from northfinder.procedures.events import (
    Estimate,
    Event,
    Paused,
    Progress,
    Resumed,
    SegmentOpened,
    SoFar,
    VisitCompleted,
    Warned,
)
from northfinder.procedures.gate import Gate
from northfinder.procedures.kinds import PROCEDURES, procedure_of
from northfinder.procedures.north_seek_json import JsonObject, estimate_json
from northfinder.procedures.plain_json import progress_json, visit_json
from northfinder.procedures.procedure import Predicted
from northfinder.procedures.visits import Visit
from northfinder.replay import Past, frame, past_of, plan_of, require_same_bench
from northfinder.rig import Rig

Publish = Callable[[records.RunEvent], None]
Ending = Literal["aborted", "interrupted"]
_Job = Callable[[], Coroutine[Any, Any, None]]


async def begin(
    rig: Rig,
    plan: BaseModel,
    writer: records.Writer,
    publish: Publish,
    idempotency: records.Idempotency | None = None,
) -> "RecordedRun":
    """Record a queued run on an open rig; nothing moves yet.

    Raises:
        ConfigError: The plan cannot be carried out on this rig.
        RecordsError: It cannot be recorded.
    """
    prediction = procedure_of(plan).predict(plan, rig)
    run = await writer.create_run(_new_run(rig, prediction, idempotency))
    return RecordedRun(rig, run, prediction.plan, writer, publish, None)


async def resume(
    rig: Rig, store: records.Records, run: records.Run, writer: records.Writer, publish: Publish
) -> "RecordedRun":
    """Take a failed or interrupted run up again: it is running from now on, nothing moves yet.

    Raises:
        ConfigError: The bench is not configured, or not equipped, as it was; or a run of this
            kind cannot be carried on.
        IllegalStepError: It is in another state by now.
        RecordsError: Its samples are damaged, or the records cannot be used.
    """
    if not PROCEDURES[run.kind].RESUMABLE:
        msg = f"run {run.id} is of the kind {run.kind}, which cannot be carried on: begin anew"
        raise ConfigError(msg)
    require_same_bench(rig, run)
    plan = plan_of(run)
    past = await asyncio.to_thread(past_of, store, run)
    publish(await writer.resume(run.id))
    return RecordedRun(rig, run, plan, writer, publish, past)


class RecordedRun:
    """One run on a rig and its record.

    Attributes:
        id: The run's.
        gate: Where it can be paused.
        cancelled_as: What the run becomes when the task that carries it out is cancelled.

    Args:
        rig: The open rig.
        run: As recorded so far.
        plan: What to measure, with nothing left open.
        writer: The records' writer.
        publish: Receives every event once it is durable.
        past: Of an earlier life, where the run is resumed.
    """

    def __init__(  # noqa: PLR0913, PLR0917 -- a run is where these six meet
        self,
        rig: Rig,
        run: records.Run,
        plan: BaseModel,
        writer: records.Writer,
        publish: Publish,
        past: Past | None,
    ) -> None:
        self.id = run.id
        self.gate = Gate()
        self.cancelled_as: Ending = "aborted"
        self._rig = rig
        self._run = run
        self._plan = plan
        self._procedure = procedure_of(plan)
        self._writer = writer
        self._publish = publish
        self._past = past
        self._progress = run.progress
        self._unwritten: deque[_Job] = deque()
        self._draining: asyncio.Task[None] | None = None
        self._over = False

    @property
    def settled(self) -> bool:
        """Return whether everything that happened is in the records."""
        return not self._unwritten

    async def carry_out(self) -> JsonObject:
        """Measure, solve, and return the result as it is recorded.

        Whatever ends the run is in the record: completed, what :attr:`cancelled_as` says, or
        failed with the reason; every completed visit stays.

        Raises:
            NorthfinderError: The run failed; the record says so too.
            RecordsError: The records failed; :meth:`settle` writes the rest once they are back.
        """
        try:
            if self._past is None:
                await self._change_state("running")
            done, elapsed_s = self._past or ((), 0.0)
            result = await self._procedure.run(
                self._rig, self._plan, self._emit, done=done, elapsed_s=elapsed_s, gate=self.gate
            )
        except asyncio.CancelledError:
            await self._end(lambda: self._change_state(self.cancelled_as))
            raise
        except Exception as error:
            reason = sentence_of(error)
            await self._end(lambda: self._fail(reason))
            raise
        return await self._finish(self._procedure.result_json(result))

    async def settle(self) -> None:
        """Write what the records could not take when it happened, in its order.

        Raises:
            RecordsError: They still cannot.
        """
        while self._unwritten or self._draining is not None:
            draining = self._drain()
            # Whoever is cancelled here leaves the task to the next call: it goes on, and nothing
            # is written twice.
            await asyncio.wait([draining])
            if self._draining is draining:  # else something was told since, and is being written
                self._draining = None
            draining.result()

    def warn(self, message: str) -> None:
        """Add a warning to the run's events; after its end it is no part of it."""
        if not self._over:
            self._tell("warning", {"message": message})

    async def _end(self, job: _Job) -> None:
        """Write how it ended, as the last of it."""
        self._over = True
        await self._write(job)

    async def _write(self, job: _Job) -> None:
        """Write, after all that was told before, and wait until it is durable."""
        self._unwritten.append(job)
        await self.settle()

    def _tell(
        self, event: records.EventName, data: JsonObject, so_far: JsonObject | None = None
    ) -> None:
        """Write an event while the run goes on; where that fails, the next visit hears of it."""
        progress = self._progress

        async def tell() -> None:
            told = self._writer.add_event(self.id, event, data, progress=progress, headline=so_far)
            self._publish(await told)

        self._unwritten.append(tell)
        self._drain()

    def _drain(self) -> "asyncio.Task[None]":
        """Return the task that writes what is unwritten; one that failed is for `settle`."""
        draining = self._draining
        if draining is None or (draining.done() and draining.exception() is None):
            draining = asyncio.create_task(self._write_all(), name=f"records of run {self.id}")
            self._draining = draining
        return draining

    async def _write_all(self) -> None:
        while self._unwritten:
            try:
                await self._unwritten[0]()
            except records.IllegalStepError:  # no later attempt could succeed
                self._unwritten.popleft()
                raise
            self._unwritten.popleft()

    async def _change_state(self, state: records.SettableState) -> None:
        self._publish(await self._writer.set_state(self.id, state))

    async def _fail(self, reason: str) -> None:
        for event in await self._writer.fail(self.id, reason):
            self._publish(event)

    async def _finish(self, numbers: JsonObject) -> JsonObject:
        # The devices once more, for their counters have counted since.
        rig_after = {**self._run.rig, "devices": self._rig.devices()}
        result = {
            **frame(self._run, "completed"),
            "rig": rig_after,
            **numbers,
        }

        async def write() -> None:
            for event in await self._writer.finish(
                self.id, result, self._procedure.headline(numbers)
            ):
                self._publish(event)

        await self._end(write)
        return result

    async def _emit(self, event: Event) -> None:
        match event:
            case VisitCompleted(visit=visit):
                await self._write(lambda: self._keep_visit(visit))
            case Progress():
                self._progress = event.fraction
                self._tell("progress", progress_json(event))
            case Estimate():
                self._tell_so_far(estimate_json(event))
            case SoFar(numbers=numbers):
                self._tell_so_far(numbers)
            case SegmentOpened():
                self.warn(event.sentence())
            case Warned(sentence=sentence):
                self.warn(sentence)
            case Paused():
                await self._write(lambda: self._change_state("paused"))
            case Resumed():
                await self._write(lambda: self._change_state("running"))

    def _tell_so_far(self, numbers: JsonObject) -> None:
        self._tell("estimate", numbers, self._procedure.headline(numbers))

    async def _keep_visit(self, visit: Visit) -> None:
        event = await self._writer.add_visit(
            self.id, _statistics(visit), visit.streams, visit_json(visit), self._progress
        )
        self._publish(event)


def _new_run(
    rig: Rig, prediction: Predicted, idempotency: records.Idempotency | None
) -> records.NewRun:
    # Of no consequence, and infinity is no JSON; nobody's business, and a password may be in it.
    config = rig.config.model_dump(
        mode="json", by_alias=True, exclude={"simulation": {"speed"}, "database": True}
    )
    plan = prediction.plan.model_dump(mode="json")
    return records.NewRun(
        kind=plan["kind"],
        rig_name=rig.config.site.name,
        plan=plan,
        prediction=prediction.to_json(),
        site={**config["site"], "gravity_g": rig.config.site.gravity_g},
        rig={"config": config, "devices": rig.devices()},
        simulation=None if rig.simulation is None else rig.simulation.truth(),
        software=dict(software.description()),
        idempotency=idempotency,
    )


def _statistics(visit: Visit) -> records.VisitStatistics:
    return records.VisitStatistics(
        index=visit.index,
        segment=visit.segment,
        repeats=visit.repeats,
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
