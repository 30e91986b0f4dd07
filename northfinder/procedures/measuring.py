"""One stop of the table: turn to an angle, settle, and collect both axes."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass

from drivers.errors import DriverError
from northfinder.errors import AcquisitionError
from northfinder.procedures.acquisition import collect, settle
from northfinder.procedures.turning import watch_turning
from northfinder.procedures.visits import Direction, Visit
from northfinder.rig import Rig


@dataclass(frozen=True, slots=True)
class Stop:
    """Where to measure and for how long, and what becomes of it in the record."""

    index: int
    segment: int
    direction: Direction
    angle_rad: float
    dwell_s: float
    settle_s: float
    repeats: int | None


async def measure(rig: Rig, stop: Stop, run_began_s: float, where: str) -> Visit:
    """Measure at one angle.

    Args:
        rig: The open rig.
        stop: What to measure.
        run_began_s: Loop time at which the run would have begun without interruption.
        where: Begins the message of whatever fails.

    Raises:
        AcquisitionError: The table, a sensor or the settling failed.
    """
    with acquisition_errors(where):
        return await _measure(rig, stop, run_began_s)


@contextmanager
def acquisition_errors(where: str) -> Iterator[None]:
    """Turn whatever a driver or a collection raises into one error that says where it happened.

    Raises:
        AcquisitionError: It did.
    """
    try:
        yield
    except (DriverError, AcquisitionError) as error:
        reason: Exception = error
    except ExceptionGroup as both:  # of the two collections; the first that failed says why
        reason = both.exceptions[0]
        if not isinstance(reason, DriverError | AcquisitionError):
            raise
    else:
        return
    msg = f"{where}: {reason}"
    raise AcquisitionError(msg) from reason


async def home(rig: Rig, *, anew: bool) -> None:
    """Find the table's reference where it is not known, or anew.

    Raises:
        AcquisitionError: The table did not find it.
    """
    try:
        if anew or not (await rig.table_state()).homed:
            await rig.home()
    except DriverError as error:
        msg = f"finding the table's reference failed: {error}"
        raise AcquisitionError(msg) from error


@asynccontextmanager
async def table_stopped_at_the_end(rig: Rig) -> AsyncIterator[None]:
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


async def _measure(rig: Rig, stop: Stop, run_began_s: float) -> Visit:
    """Collect both axes over the same stretch of time."""
    async with watch_turning(rig.gyro.sensor) as meter:
        await rig.move_to(stop.angle_rad)
        async with rig.gyro.sensor.listen() as rates, rig.accelerometer.sensor.listen() as forces:
            begin_s = await settle(rig, rates, stop.settle_s)
            turned_rad = meter.finish()
            async with asyncio.TaskGroup() as both:
                gyro = both.create_task(collect(rig.gyro, rates, begin_s, stop.dwell_s))
                accelerometer = both.create_task(
                    collect(rig.accelerometer, forces, begin_s, stop.dwell_s)
                )
    return Visit(
        index=stop.index,
        segment=stop.segment,
        direction=stop.direction,
        angle_rad=stop.angle_rad,
        start_s=float(gyro.result().time_s[0]) - run_began_s,
        turned_rad=turned_rad,
        gyro=gyro.result(),
        accelerometer=accelerometer.result(),
        repeats=stop.repeats,
    )
