"""All six axes of one instrument, stretch by stretch, without a gap between the stretches."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from drivers.interfaces import Listener, SampleBlock
from northfinder.procedures.acquisition import SILENCE_S
from northfinder.procedures.visits import Direction, Visit
from northfinder.samples import Samples, Stream

_AXES: Final = "xyz"
_RATES: Final[tuple[Stream, ...]] = ("rate-x", "rate-y", "rate-z")
_FORCES: Final[tuple[Stream, ...]] = ("force-x", "force-y", "force-z")


@dataclass(frozen=True, kw_only=True)
class InertialVisit(Visit):
    """A stretch of samples of all axes; ``gyro`` and ``accelerometer`` are along the sensing one.

    Attributes:
        axes: Every axis by the name of its stream; rates in rad/s, forces in standard gravities.
    """

    axes: Mapping[Stream, Samples]

    @property
    def streams(self) -> Mapping[Stream, Samples]:
        """Return the samples as they are kept."""
        return self.axes

    def block(self) -> SampleBlock:
        """Return the samples as the instrument sent them; their temperature is not kept."""
        first = self.axes["rate-x"]
        rates, forces = ([self.axes[name] for name in names] for names in (_RATES, _FORCES))
        return SampleBlock(
            tick=first.tick,
            time_s=first.time_s,
            rate_rad_s=np.stack([axis.value for axis in rates], axis=1),
            specific_force_g=np.stack([axis.value for axis in forces], axis=1),
            rate_valid=np.stack([axis.valid for axis in rates], axis=1),
            force_valid=np.stack([axis.valid for axis in forces], axis=1),
            temperature_deg_c=np.full(len(first), np.nan),
        )


def inertial_visit(  # noqa: PLR0913
    block: SampleBlock, expected: int, axis: str, *, index: int, angle_rad: float, start_s: float
) -> InertialVisit:
    """Make a visit of a stretch of samples.

    Args:
        block: The samples.
        expected: How many there should be.
        axis: The sensing axis, ``x`` to ``-z``.
        index: Its place in the run.
        angle_rad: Where the table stands.
        start_s: From the start of the run to its first sample.
    """
    axes: dict[Stream, Samples] = {}
    for names, values, valid in (
        (_RATES, block.rate_rad_s, block.rate_valid),
        (_FORCES, block.specific_force_g, block.force_valid),
    ):
        for column, name in enumerate(names):
            axes[name] = Samples(
                block.tick, block.time_s, values[:, column], valid[:, column], expected
            )
    return _of_axes(
        axes,
        axis,
        index=index,
        segment=0,
        direction="out",
        angle_rad=angle_rad,
        start_s=start_s,
        turned_rad=None,
    )


def restored(
    samples: Mapping[Stream, Samples],
    axis: str,
    *,
    direction: Direction,
    **entry: Any,  # noqa: ANN401 -- the other fields of a visit, as recorded
) -> Visit:
    """Return a recorded visit, of two axes or of all.

    Args:
        samples: As they were kept.
        axis: The gyro's sensing axis, ``x`` to ``-z``.
        direction: Out or back.
        entry: The visit's other fields.
    """
    if "gyro" in samples:
        gyro, accelerometer = samples["gyro"], samples["accelerometer"]
        return Visit(direction=direction, gyro=gyro, accelerometer=accelerometer, **entry)
    return _of_axes(samples, axis, direction=direction, **entry)


def _of_axes(axes: Mapping[Stream, Samples], axis: str, **entry: Any) -> InertialVisit:  # noqa: ANN401
    sign = -1.0 if axis.startswith("-") else 1.0
    column = _AXES.index(axis[-1])
    rate, force = (_along(axes[names[column]], sign) for names in (_RATES, _FORCES))
    return InertialVisit(gyro=rate, accelerometer=force, axes=axes, **entry)


def _along(samples: Samples, sign: float) -> Samples:
    value = sign * samples.value
    return Samples(samples.tick, samples.time_s, value, samples.valid, samples.expected)


class StretchReader:
    """Cuts an instrument's samples into stretches of exactly so many ticks each.

    Args:
        listener: Of the instrument.
        start_s: Loop time from which samples count.
    """

    def __init__(self, listener: Listener, start_s: float) -> None:
        self._listener = listener
        self._start_s = start_s
        self._parts: list[SampleBlock] = []
        self._next_tick: int | None = None

    @property
    def next_tick(self) -> int:
        """Return where the next stretch begins; known once one has been taken."""
        if self._next_tick is None:
            msg = "no stretch has been taken yet"
            raise RuntimeError(msg)
        return self._next_tick

    async def take(self, ticks: int) -> SampleBlock:
        """Return the next stretch; what was lost on the way is missing, of a long gap all.

        Raises:
            LinkTimeoutError: The instrument fell silent; the next call goes on where this ended.
            TransportError: The link is gone and did not come back.
        """
        if not self._parts:
            self._parts = [await self._next()]
        begin = int(self._parts[0].tick[0]) if self._next_tick is None else self._next_tick
        self._next_tick = begin
        while self._parts[-1].tick[-1] < begin + ticks - 1:
            self._parts.append(await self._next())
        whole = joined(self._parts)
        cut = int(np.searchsorted(whole.tick, begin + ticks))
        self._next_tick = begin + ticks
        self._parts = [part_of(whole, slice(cut, None))] if cut < len(whole) else []
        return part_of(whole, slice(0, cut))

    async def _next(self) -> SampleBlock:
        """Return the next samples that count."""
        while True:
            block = await self._listener.next(SILENCE_S)
            begin = int(np.searchsorted(block.time_s, self._start_s))
            if begin < len(block):
                return part_of(block, slice(begin, None))


def joined(blocks: Sequence[SampleBlock]) -> SampleBlock:
    """Return samples that follow one another as one block."""
    columns = zip(*map(_columns, blocks), strict=True)
    return SampleBlock(*(np.concatenate(column) for column in columns))


def part_of(block: SampleBlock, some: slice) -> SampleBlock:
    """Return some of the samples."""
    return SampleBlock(*(column[some] for column in _columns(block)))


def _columns(block: SampleBlock) -> list[Any]:
    return [getattr(block, field.name) for field in fields(block)]
