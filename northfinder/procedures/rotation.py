"""One passage of a table that turns slowly and steadily: its samples, sector by sector."""

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from drivers.interfaces import Listener, SampleBlock, TableState
from northfinder.errors import AcquisitionError
from northfinder.procedures.acquisition import check_usable, settle
from northfinder.procedures.inertial import StretchReader
from northfinder.procedures.steady import SteadyLine
from northfinder.procedures.timing import lead_rad, lead_s
from northfinder.procedures.visits import Direction, Visit
from northfinder.rig import Rig, SensingAxis
from northfinder.samples import Samples

T = TypeVar("T")

_POLL_S = 0.05
_REST_S = 0.3  # before the table sets out: what the gyro reads there is bias and Earth rate
_LEAST_G, _MOST_G = 0.9, 1.1  # of a sensor that stands on a table

#: Takes a finished visit; says whether to go on.
Keep = Callable[[Visit], Awaitable[bool]]


@dataclass(frozen=True, slots=True)
class Sector:
    """Where to measure in passing, and what becomes of it in the record."""

    index: int
    segment: int
    direction: Direction
    angle_rad: float
    repeats: int | None


@dataclass(frozen=True, slots=True)
class Pace:
    """How the table turns.

    Attributes:
        width_rad: Of a sector.
        dwell_s: For how long it lasts.
        settle_s: The plan's wait; before the first sector the speed settles for as long.
    """

    width_rad: float
    dwell_s: float
    settle_s: float

    @property
    def speed_rad_s(self) -> float:
        """Return how fast the table turns."""
        return self.width_rad / self.dwell_s


async def sweep(
    rig: Rig, sectors: Sequence[Sector], pace: Pace, run_began_s: float, keep: Keep
) -> None:
    """Turn through neighbouring sectors without a stop; the table stands afterwards.

    The samples' angles are those of the steady line through the table's positions as they were
    polled. What delays them against the samples turns the azimuth, one way on the way out and the
    other on the way back.

    Args:
        rig: The open rig, homed.
        sectors: In the order of the passage, of one direction.
        pace: How the table turns.
        run_began_s: Loop time at which the run would have begun without interruption.
        keep: Awaited for every visit as soon as its sector is past.

    Raises:
        AcquisitionError: The table does not turn steadily, or samples are missing.
        DriverError: An instrument failed.
    """
    way = 1.0 if sectors[0].direction == "out" else -1.0
    lead = lead_rad(pace.speed_rad_s, pace.settle_s, rig.motion_limits)
    before_rad = sectors[0].angle_rad - way * pace.width_rad / 2
    beyond_rad = sectors[-1].angle_rad + way * (pace.width_rad / 2 + lead)
    await rig.move_to(before_rad - way * lead)
    async with rig.gyro.sensor.listen() as rates, rig.accelerometer.sensor.listen() as forces:
        vertical = await _at_rest(rig, rates, pace.settle_s)
        async with _turning(rig, beyond_rad, pace.speed_rad_s) as turning:
            line = await turning.steady(lead_s(pace.settle_s))
            passage = _Passage(rig, pace, line, (rates, forces), line.time_s(before_rad), vertical)
            for sector in sectors:
                visit = await turning.meanwhile(passage.visit(sector, run_began_s))
                if not await keep(visit):
                    break
            else:
                await turning.finish()
                return
        await rig.stop()


async def _at_rest(rig: Rig, rates: Listener, settle_s: float) -> "_Vertical":
    begin_s = await settle(rig, rates, settle_s)
    period_s = rig.gyro.sensor.sample_period_s
    block = await StretchReader(rates, begin_s).take(max(2, round(_REST_S / period_s)))
    return _Vertical(block)


class _Vertical:
    """The gyro's rate about the upward vertical, less what it reads at rest; NaN where unknown."""

    def __init__(self, at_rest: SampleBlock) -> None:
        force_g = at_rest.specific_force_g.mean(axis=0)
        length_g = float(np.linalg.norm(force_g))
        known = _LEAST_G < length_g < _MOST_G
        self._up = force_g / length_g if known else np.full(3, np.nan)
        self._rest_rad_s = self._mean(at_rest)

    def rate_rad_s(self, block: SampleBlock) -> float:
        """Return the mean over a stretch."""
        return self._mean(block) - self._rest_rad_s

    def _mean(self, block: SampleBlock) -> float:
        return float(np.mean(block.rate_rad_s @ self._up))


class _Passage:
    """Cuts both axes' samples into sectors of equal time, without a gap."""

    def __init__(  # noqa: PLR0913, PLR0917 -- what a passage consists of
        self,
        rig: Rig,
        pace: Pace,
        line: SteadyLine,
        listeners: tuple[Listener, Listener],
        begin_s: float,
        vertical: _Vertical,
    ) -> None:
        rates, forces = listeners
        self._line, self._vertical = line, vertical
        self._gyro = _Cutter(rig.gyro, rates, begin_s, pace.dwell_s)
        self._accelerometer = _Cutter(rig.accelerometer, forces, begin_s, pace.dwell_s)
        self._last: tuple[float, float] | None = None

    async def visit(self, sector: Sector, run_began_s: float) -> Visit:
        """Return the next sector's visit, once it is past."""
        block, gyro = await self._gyro.next()
        _, accelerometer = await self._accelerometer.next()
        time_s = float(np.mean(gyro.time_s[gyro.valid]))
        turned_rad = self._turned_rad(block, time_s)
        return Visit(
            index=sector.index,
            segment=sector.segment,
            direction=sector.direction,
            angle_rad=self._line.angle_rad(time_s),
            start_s=float(gyro.time_s[0]) - run_began_s,
            turned_rad=turned_rad,
            gyro=gyro,
            accelerometer=accelerometer,
            repeats=sector.repeats,
        )

    def _turned_rad(self, block: SampleBlock, time_s: float) -> float | None:
        """Return how far the gyro saw the table turn from the middle of the last sector."""
        rate_rad_s, last = self._vertical.rate_rad_s(block), self._last
        self._last = time_s, rate_rad_s
        if last is None or not math.isfinite(rate_rad_s + last[1]):
            return None
        return (rate_rad_s + last[1]) / 2 * (time_s - last[0])


class _Cutter:
    """One axis's samples, in stretches of equal time to within a sample."""

    def __init__(
        self, axis: SensingAxis, listener: Listener, begin_s: float, dwell_s: float
    ) -> None:
        self._axis, self._reader = axis, StretchReader(listener, begin_s)
        self._ticks, self._stretches = dwell_s / axis.sensor.sample_period_s, 0

    async def next(self) -> tuple[SampleBlock, Samples]:
        """Return the next stretch as it came, and the axis's samples."""
        begin = round(self._stretches * self._ticks)
        self._stretches += 1
        expected = round(self._stretches * self._ticks) - begin
        block = await self._reader.take(expected)
        axis = self._axis
        samples = Samples(block.tick, block.time_s, axis.values(block), axis.valid(block), expected)
        check_usable(axis, samples)
        return block, samples


@asynccontextmanager
async def _turning(rig: Rig, towards_rad: float, speed_rad_s: float) -> AsyncIterator["_Turning"]:
    """Turn the table meanwhile, and stop it where nobody waited for its end."""
    turning = _Turning(rig, towards_rad, speed_rad_s)
    try:
        yield turning
    finally:
        await turning.end()


class _Turning:
    """The table's slow move, and what its polled positions tell of it."""

    def __init__(self, rig: Rig, towards_rad: float, speed_rad_s: float) -> None:
        self._rig = rig
        self._line = SteadyLine(speed_rad_s, rig.motion_limits)
        self._move: asyncio.Task[TableState] = asyncio.create_task(
            rig.move_to(towards_rad, speed_rad_s), name="slow turn"
        )
        self._polls = asyncio.create_task(self._poll(), name="table positions")

    async def steady(self, after_s: float) -> SteadyLine:
        """Return the line of its positions, once it has turned for so long."""
        await self.meanwhile(asyncio.sleep(after_s))
        await self.meanwhile(self._line.known())
        return self._line

    async def meanwhile(self, work: Coroutine[Any, Any, T]) -> T:
        """Do something as long as the table turns and tells where it is.

        Raises:
            AcquisitionError: The table came to rest first.
            DriverError: It failed.
        """
        task = asyncio.create_task(work)
        try:
            others = {self._move, self._polls}
            await asyncio.wait({task, *others}, return_when=asyncio.FIRST_COMPLETED)
            if task.done():
                return task.result()
            for failed in filter(asyncio.Task.done, others):
                failed.result()
            msg = "the table came to rest before its last sector was past: it turned too fast"
            raise AcquisitionError(msg)
        finally:
            task.cancel()
            await asyncio.wait([task])

    async def finish(self) -> None:
        """Wait until the table stands where it was sent."""
        await self._move

    async def end(self) -> None:
        """Leave no task behind; a move that is broken off is stopped by whoever broke it off."""
        for task in (self._polls, self._move):
            task.cancel()
            await asyncio.wait([task])
            if not task.cancelled():
                task.exception()  # it has been raised, or something before it has

    async def _poll(self) -> TableState:
        loop = asyncio.get_running_loop()
        while True:
            asked_s = loop.time()
            state = await self._rig.observe_table()
            self._line.add((asked_s + loop.time()) / 2, state.angle_rad)
            await asyncio.sleep(_POLL_S)
