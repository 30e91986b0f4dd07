"""The static record: let everything stand still, and find what noise the sensors have."""

import asyncio
from collections.abc import Sequence
from typing import Final, Self

from northfinder.errors import EstimationError
from northfinder.procedures import north_seek
from northfinder.procedures.acquisition import check_usable, settle
from northfinder.procedures.events import Emit, Progress, SoFar, VisitCompleted
from northfinder.procedures.gate import Gate
from northfinder.procedures.inertial import StretchReader
from northfinder.procedures.measuring import acquisition_errors, table_stopped_at_the_end
from northfinder.procedures.noise_json import headline, result_json
from northfinder.procedures.noise_plan import Plan, Wish
from northfinder.procedures.noise_reduction import NoiseRecord, reduce_visits
from northfinder.procedures.promise import Promise
from northfinder.procedures.visits import Visit
from northfinder.rig import Rig, SensingAxis
from northfinder.samples import Samples

__all__ = [
    "RESUMABLE",
    "NoiseRecord",
    "Plan",
    "Wish",
    "headline",
    "predict",
    "reduce_visits",
    "result_json",
    "run",
]

RESUMABLE: Final = False
_TELLING_S = 600.0  # below it, a bias that wanders hardly shows


def predict(plan: Plan, rig: Rig) -> Promise:
    """Say how long it takes, and what so short a record cannot show."""
    warnings = []
    if plan.duration_s < _TELLING_S:
        warnings.append(
            f"{plan.duration_s:g} s show the white noise; bias instability and random walk need "
            f"an hour or more"
        )
    if rig.gyro.sensor.sample_period_s * 100 > plan.duration_s:
        warnings.append("fewer than a hundred samples: hardly a record")
    return Promise(_with_pause(plan, rig), plan.duration_s + plan.settle_s, warnings)


def _with_pause(plan: Plan, rig: Rig) -> Plan:
    """Fill in the time of moving and settling before each visit of the usual north-seek."""
    if not rig.turns:
        return plan
    usual = north_seek.predict(north_seek.Plan(), rig)
    dwells_s = sum(visit.dwell_s for visit in usual.visits)
    pause_s = (usual.duration_s - usual.homing_s - dwells_s) / len(usual.visits)
    return plan.model_copy(update={"pause_s": pause_s})


async def run(  # noqa: PLR0913 -- every procedure's
    rig: Rig,
    plan: Plan,
    emit: Emit,
    *,
    done: Sequence[Visit] = (),
    elapsed_s: float = 0.0,
    gate: Gate | None = None,  # noqa: ARG001 -- nothing in it could wait
) -> NoiseRecord:
    """Record on an open rig, and analyse the record.

    Raises:
        AcquisitionError: The rate does not settle, or a sensor failed.
        EstimationError: The record is too short for any statement.
    """
    if done or elapsed_s:
        msg = "a static record cannot be carried on: the time between would be missing"
        raise ValueError(msg)
    chosen = _with_pause(plan, rig)
    async with table_stopped_at_the_end(rig):
        visits = await _record(rig, chosen, emit)
    return await asyncio.to_thread(reduce_visits, visits, chosen, rig.config)


async def _record(rig: Rig, plan: Plan, emit: Emit) -> list[Visit]:
    visits: list[Visit] = []
    began_s = asyncio.get_running_loop().time()
    await emit(_progress(plan, 0))
    async with (
        rig.gyro.sensor.listen() as rates,
        rig.accelerometer.sensor.listen() as forces,
        _Analyst(rig, plan, emit) as analyst,
    ):
        with acquisition_errors("before the record"):
            angle_rad = (await rig.table_state()).angle_rad
            begin_s = await settle(rig, rates, plan.settle_s)
        readers = StretchReader(rates, begin_s), StretchReader(forces, begin_s)
        for index in range(plan.stretches):
            with acquisition_errors(f"after {len(visits)} of {plan.stretches} stretches"):
                gyro, accelerometer = await _take_both(rig, plan, readers)
            start_s = float(gyro.time_s[0]) - began_s
            visit = Visit(index, 0, "out", angle_rad, start_s, None, gyro, accelerometer)
            visits.append(visit)
            await emit(VisitCompleted(visit))
            await emit(_progress(plan, index + 1))
            analyst.look_at(visits)
    return visits


async def _take_both(
    rig: Rig, plan: Plan, readers: tuple[StretchReader, StretchReader]
) -> tuple[Samples, Samples]:
    """Take a stretch of both sensors, each by its own clock."""
    async with asyncio.TaskGroup() as both:
        tasks = [
            both.create_task(_take(axis, reader, plan))
            for axis, reader in zip((rig.gyro, rig.accelerometer), readers, strict=True)
        ]
    gyro, accelerometer = (task.result() for task in tasks)
    return gyro, accelerometer


async def _take(axis: SensingAxis, reader: StretchReader, plan: Plan) -> Samples:
    expected = round(plan.duration_s / plan.stretches / axis.sensor.sample_period_s)
    block = await reader.take(expected)
    samples = Samples(block.tick, block.time_s, axis.values(block), axis.valid(block), expected)
    check_usable(axis, samples)
    return samples


class _Analyst:
    """Analyses what there is whenever it has doubled, for the work grows with the record.

    Beside the recording, never in its way: samples that nobody takes would be discarded.
    """

    def __init__(self, rig: Rig, plan: Plan, emit: Emit) -> None:
        self._rig, self._plan, self._emit = rig, plan, emit
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])
            if not self._task.cancelled():
                self._task.result()  # a defect must not pass in silence

    def look_at(self, visits: Sequence[Visit]) -> None:
        """Begin to analyse, unless it is too early or the last analysis still goes on."""
        count, last = len(visits), self._plan.stretches
        if count >= last or count & (count - 1):
            return
        if self._task is None or self._task.done():
            if self._task is not None:
                self._task.result()
            self._task = asyncio.create_task(self._tell(list(visits)), name="noise so far")

    async def _tell(self, visits: Sequence[Visit]) -> None:
        try:
            so_far = await asyncio.to_thread(reduce_visits, visits, self._plan, self._rig.config)
        except EstimationError:
            return  # at the end it is the result's to say, if it still holds then
        numbers = result_json(so_far)
        await self._emit(SoFar({key: numbers[key] for key in numbers if key != "visits"}))


def _progress(plan: Plan, done: int) -> Progress:
    fraction = done / plan.stretches
    left_s = plan.duration_s * (1.0 - fraction)
    visit = min(done + 1, plan.stretches)
    return Progress(fraction, left_s, "recording", visit, plan.stretches, None)
