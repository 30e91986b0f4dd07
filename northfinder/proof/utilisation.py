"""How much of an indexed run is measured, moving and settling set aside; in device time."""

import asyncio
from collections.abc import Iterator, Sequence
from itertools import pairwise

from drivers.interfaces import MotionLimits
from northfinder.config import RigConfig, load_config
from northfinder.procedures.events import Event, VisitCompleted
from northfinder.procedures.north_seek import Plan, run
from northfinder.procedures.visits import Visit
from northfinder.proof.figure import Figure
from northfinder.wiring import build_rig, event_loop

_DRIVERS = ("zaber", "cia402")


def utilisation() -> Iterator[Figure]:
    """The default run on both tables, through drivers and bytes, in virtual time."""
    for driver in _DRIVERS:
        name = f"indexed run on {driver}: dwell / (wall - motion - settling)"
        yield Figure(name, measured_share(driver, Plan()), "", 0.98, None)


def measured_share(driver: str, plan: Plan) -> float:
    """Return the dwell over what motion and settling leave of the run.

    From the first sample of the first visit to the last of the last, by the gyro's own ticks;
    motion as long as the table's speed and acceleration make it, settling as the plan says.
    """
    config = load_config(None, {}, {"turntable": {"driver": driver}})
    with asyncio.Runner(loop_factory=event_loop(config, float("inf"))) as runner:
        visits, limits, period_s = runner.run(_seek(config, plan))
    dwell_s = sum(visit.gyro.expected for visit in visits) * period_s
    ticks = int(visits[-1].gyro.tick[-1] - visits[0].gyro.tick[0]) + 1
    return dwell_s / (ticks * period_s - _away_s(visits, plan, limits))


async def _seek(config: RigConfig, plan: Plan) -> tuple[list[Visit], MotionLimits, float]:
    visits: list[Visit] = []

    async def keep(event: Event) -> None:
        if isinstance(event, VisitCompleted):
            visits.append(event.visit)

    async with build_rig(config) as rig:
        await run(rig, plan, keep)
        return visits, rig.motion_limits, rig.gyro.sensor.sample_period_s


def _away_s(visits: Sequence[Visit], plan: Plan, limits: MotionLimits) -> float:
    moves_rad = [abs(later.angle_rad - earlier.angle_rad) for earlier, later in pairwise(visits)]
    return sum(limits.move_s(move_rad) + plan.settle_s for move_rad in moves_rad)
