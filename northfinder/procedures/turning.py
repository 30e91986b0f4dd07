"""How far the gyro saw the table turn, and which way: a witness to the table's own word."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import numpy as np

from drivers.errors import DriverError
from drivers.interfaces import InertialSensor, Listener, SampleBlock
from northfinder.procedures.acquisition import SILENCE_S

_REST_S = 0.3  # the end of settling: what the gyro reads there is bias and Earth rate
_WIDEST_GAP_S = 0.05  # across a few lost frames the rate goes on evenly
_LEAST_G, _MOST_G = 0.9, 1.1  # of a sensor that stands on a table


@asynccontextmanager
async def watch_turning(sensor: InertialSensor) -> AsyncIterator["TurnMeter"]:
    """Collect a gyro's samples from now on, until the meter is asked."""
    now_s = asyncio.get_running_loop().time()
    meter = TurnMeter(sensor.sample_period_s, now_s)
    async with sensor.listen() as listener:
        watching = asyncio.create_task(_collect(listener, meter), name="turn meter")
        try:
            yield meter
        finally:
            watching.cancel()
            await asyncio.wait([watching])


async def _collect(listener: Listener, meter: "TurnMeter") -> None:
    try:
        while True:
            meter.add(await listener.next(SILENCE_S))
    except DriverError:
        # Whoever waits for this visit's samples hears the same and ends the run; a witness
        # who heard half tells nothing.
        meter.forget()


class TurnMeter:
    """The samples of one move, and the angle that they add up to.

    Args:
        sample_period_s: The gyro's.
        start_s: Samples of before do not count, whether or not they are still to come: which
            of the two it is depends on how long the last visit took to store.
    """

    def __init__(self, sample_period_s: float, start_s: float) -> None:
        self._period_s = sample_period_s
        self._start_s = start_s + sample_period_s / 2
        self._blocks: list[SampleBlock] = []
        self._finished = False

    def add(self, block: SampleBlock) -> None:
        """Take samples, in order."""
        if not self._finished:
            self._blocks.append(block)

    def forget(self) -> None:
        """Throw away what came."""
        self._blocks.clear()

    def finish(self) -> float | None:
        """Return the angle turned about the upward vertical, counter-clockwise positive.

        The gyro's own accelerometers tell which way is up. One without them cannot say which
        way it turned, and the answer is None; so it is where too many samples are missing.
        """
        self._finished = True
        if not self._blocks:
            return None
        during = np.concatenate([block.time_s for block in self._blocks]) > self._start_s
        rate_rad_s = np.concatenate([block.rate_rad_s for block in self._blocks])[during]
        forces_g = np.concatenate([block.specific_force_g for block in self._blocks])[during]
        tick = np.concatenate([block.tick for block in self._blocks])[during]
        force_g = forces_g.mean(axis=0)
        length_g = float(np.linalg.norm(force_g))
        widest_gap_s = float(np.max(np.diff(tick), initial=1)) * self._period_s
        if not _LEAST_G < length_g < _MOST_G or widest_gap_s > _WIDEST_GAP_S:
            return None
        upward_rad_s = rate_rad_s @ (force_g / length_g)
        at_rest_rad_s = upward_rad_s[-max(1, round(_REST_S / self._period_s)) :].mean()
        turned = float(np.trapezoid(upward_rad_s - at_rest_rad_s, tick)) * self._period_s
        return turned if np.isfinite(turned) else None
