"""A stream of all six axes, second by second: tracked live, kept, and tracked from records."""

import asyncio
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple, Protocol

import numpy as np

from drivers.errors import LinkTimeoutError
from drivers.interfaces import SampleBlock
from northfinder.errors import AcquisitionError, ConfigError
from northfinder.procedures.events import Emit, Phase, Progress, SoFar, VisitCompleted, Warned
from northfinder.procedures.inertial import (
    InertialVisit,
    StretchReader,
    inertial_visit,
    joined,
    part_of,
)
from northfinder.procedures.measuring import acquisition_errors, home, table_stopped_at_the_end
from northfinder.procedures.plain_json import visit_json
from northfinder.procedures.visits import Visit
from northfinder.rig import JsonObject, Rig

#: What is tracked at a time, and what is kept at a time.
_SECOND_S: Final = 1.0
_KEPT_SECONDS: Final = 5
_MOST_TOLD: Final = 1000
_SILENCE_LIMIT_S: Final = 15.0  # a plug that was pulled and put back; the driver needs its time
_GUARD_S: Final = 1.0  # after the table has stopped: a rocking base gives no sign of its settling
_AXIS_NAMES = ("rate x", "rate y", "rate z", "force x", "force y", "force z")


class Second(NamedTuple):
    """A stretch of samples on the grid of the instrument's ticks."""

    block: SampleBlock
    begin_tick: int
    ticks: int


class Track(Protocol):
    """What is made of the stream: pure, and the same live as from records."""

    @property
    def fraction(self) -> float:
        """Return how far it is, 0 to 1; at 1 it is done."""

    def take(self, second: Second) -> Iterator[str]:
        """Take the next stretch; yield sentences that whoever watches should know."""

    def so_far(self) -> JsonObject | None:
        """Return what is known now, in the result's own names; None while it is nothing."""


class Instrument(NamedTuple):
    """What a track has to know of the instrument, live or recorded.

    Attributes:
        period_s: Between two samples.
        table_angle_rad: Where the table stands, counter-clockwise.
    """

    period_s: float
    table_angle_rad: float


class Stream:
    """The live stream of a rig's gyro instrument.

    Args:
        rig: The open rig; its table is homed where it is not, and stands still then.
        emit: Awaited for every event.
        phase: What the run is doing.
        duration_s: How long it should take.
    """

    def __init__(self, rig: Rig, emit: Emit, phase: Phase, duration_s: float) -> None:
        self._rig, self._emit = rig, emit
        self._phase, self._duration_s = phase, duration_s
        self._kept: list[JsonObject] = []
        self._unkept: list[SampleBlock] = []
        self._next_told_s = 0.0

    async def prepare(self) -> Instrument:
        """Find the table's reference, and return what a track has to know.

        Raises:
            AcquisitionError: The table did not find it.
        """
        await self._tell("homing", 0.0)
        await home(self._rig, anew=False)
        with acquisition_errors("before the first sample"):
            state = await self._rig.table_state()
        return Instrument(self._rig.gyro.sensor.sample_period_s, state.angle_rad)

    async def follow(self, track: Track, instrument: Instrument) -> list[JsonObject]:
        """Feed a track until it is done; return what was kept, as the record lists it.

        The samples are the records', not the memory's: a hold may last a day.

        Raises:
            AcquisitionError: The instrument lacks an axis, or fell silent for good; or the track
                cannot go on.
        """
        loop = asyncio.get_running_loop()
        began_s = loop.time() + _GUARD_S
        ticks = round(_SECOND_S / instrument.period_s)
        async with (
            table_stopped_at_the_end(self._rig),
            self._rig.gyro.sensor.listen() as listener,
        ):
            reader = StretchReader(listener, began_s)
            while track.fraction < 1.0:
                await self._tell(self._phase, track.fraction)
                with acquisition_errors(f"after {loop.time() - began_s:.0f} s"):
                    second = await _next_second(reader, ticks)
                    _require_six_axes(second, first=not self._kept and not self._unkept)
                    warnings = list(track.take(second))
                await self._keep(second, instrument, began_s)
                for sentence in warnings:
                    await self._emit(Warned(sentence))
                await self._tell_so_far(track)
            await self._keep_rest(instrument, began_s)
        return self._kept

    async def _tell_so_far(self, track: Track) -> None:
        """Tell what is known, once a second; of a long run a thousand times in all."""
        now_s = asyncio.get_running_loop().time()
        if now_s < self._next_told_s:
            return
        numbers = track.so_far()
        if numbers is not None:
            self._next_told_s = now_s + self._duration_s / _MOST_TOLD - 0.5 * _SECOND_S
            await self._emit(SoFar(numbers))

    async def _keep(self, second: Second, instrument: Instrument, began_s: float) -> None:
        self._unkept.append(second.block)
        if len(self._unkept) == _KEPT_SECONDS:
            await self._keep_rest(instrument, began_s)

    async def _keep_rest(self, instrument: Instrument, began_s: float) -> None:
        """Keep what has come as a visit; of a long silence there is nothing to keep."""
        block, seconds = joined(self._unkept) if self._unkept else None, len(self._unkept)
        self._unkept = []
        if block is None or np.count_nonzero(self._rig.gyro.valid(block)) < 2:
            return
        visit = inertial_visit(
            block,
            seconds * round(_SECOND_S / instrument.period_s),
            self._rig.config.gyro.axis,
            index=len(self._kept),
            angle_rad=instrument.table_angle_rad,
            start_s=float(block.time_s[0]) - began_s,
        )
        self._kept.append(visit_json(visit))
        await self._emit(VisitCompleted(visit))

    async def _tell(self, phase: Phase, fraction: float) -> None:
        visits = max(1, round(self._duration_s / _SECOND_S / _KEPT_SECONDS))
        visit = min(len(self._kept) + 1, visits)
        left_s = (1.0 - fraction) * self._duration_s
        await self._emit(Progress(fraction, left_s, phase, visit, visits, None))


def seconds_of(visits: Sequence[Visit], period_s: float) -> Iterator[Second]:
    """Yield what a live stream was cut into, from its visits."""
    whole = joined([visit.block() for visit in visits if isinstance(visit, InertialVisit)])
    ticks = round(_SECOND_S / period_s)
    begins = range(int(whole.tick[0]), int(whole.tick[-1]) + 1, ticks)
    cuts = np.searchsorted(whole.tick, [*begins, begins.stop - 1 + ticks])
    for begin, first, last in zip(begins, cuts[:-1], cuts[1:], strict=True):
        yield Second(part_of(whole, slice(int(first), int(last))), begin, ticks)


def follow_again(track: Track, visits: Sequence[Visit], period_s: float) -> list[JsonObject]:
    """Feed a track from recorded visits, as the live stream fed it; return them as listed."""
    for second in seconds_of(visits, period_s):
        if track.fraction < 1.0:
            list(track.take(second))
    return [visit_json(visit) for visit in visits]


def recorded_instrument(visits: Sequence[Visit], period_s: float | None) -> Instrument:
    """Return what a track has to know of the instrument that recorded the visits.

    Raises:
        ConfigError: The time between samples is still open.
    """
    if period_s is None:
        msg = "the time between samples is still open: predict fills it in"
        raise ConfigError(msg)
    return Instrument(period_s, visits[0].angle_rad)


async def _next_second(reader: StretchReader, ticks: int) -> Second:
    """Return the next stretch, and wait a while for an instrument that fell silent."""
    loop = asyncio.get_running_loop()
    give_up_s = loop.time() + _SILENCE_LIMIT_S
    while True:
        try:
            block = await reader.take(ticks)
        except LinkTimeoutError:
            if loop.time() > give_up_s:
                raise
        else:
            return Second(block, reader.next_tick - ticks, ticks)


def _require_six_axes(second: Second, *, first: bool) -> None:
    if not first:
        return
    valid = np.hstack([second.block.rate_valid, second.block.force_valid])
    missing = [name for name, axis in zip(_AXIS_NAMES, valid.T, strict=True) if not axis.any()]
    if missing:
        msg = (
            f"the gyro's instrument sends no valid {', '.join(missing)}: an alignment needs all "
            f"three rates and all three forces of one instrument"
        )
        raise AcquisitionError(msg)
