"""North-seeks on simulated rigs, built as the command line builds them, in virtual time."""

import asyncio
import math
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import BaseModel

from northfinder.config import RigConfig, load_config
from northfinder.procedures.events import Event, Progress
from northfinder.procedures.kinds import procedure_of
from northfinder.procedures.north_seek import Plan
from northfinder.rig import JsonObject, Rig
from northfinder.wiring import SimulatedWorld, build_rig, event_loop
from sim.world import World

T = TypeVar("T")

SHORT = Plan(positions=4, dwell_s=0.2, settle_s=0.1)

#: Sees every event, and may spoil the world.
Meanwhile = Callable[[World, Event], None]


@dataclass(slots=True)
class Outcome:
    """What came of a run; ``at_rest`` is the plate's, asked as soon as the run had ended.

    ``ended_s`` is when that was, in loop time.
    """

    result: JsonObject | None
    error: BaseException | None
    events: list[Event]
    lasted_s: float
    at_rest: bool
    ended_s: float

    @property
    def completed(self) -> JsonObject:
        if self.result is None:
            raise AssertionError(self.error) from self.error
        return self.result

    @property
    def reason(self) -> str:
        assert self.error is not None, "the run should have failed"
        return str(self.error)


def config_of(**sections: dict[str, Any]) -> RigConfig:
    return load_config(None, {}, sections)


def virtually(config: RigConfig, main: Coroutine[Any, Any, T]) -> T:
    results: list[T] = []

    async def keep() -> None:
        # asyncio.Runner puts what its task returns into a message that nobody sees: half a second.
        results.append(await main)

    with asyncio.Runner(loop_factory=event_loop(config, math.inf)) as runner:
        runner.run(keep())
    return results[0]


def world_of(rig: Rig) -> World:
    assert isinstance(rig.simulation, SimulatedWorld)
    return rig.simulation.world


def nothing(_: World, __: Event) -> None: ...


def seek(
    plan: BaseModel = SHORT, meanwhile: Meanwhile = nothing, /, **sections: dict[str, Any]
) -> Outcome:
    """Carry a plan out in virtual time, a north-seek's or another's; keep an error too."""
    config = config_of(**sections)
    return virtually(config, _seek(config, plan, meanwhile))


async def _seek(config: RigConfig, plan: BaseModel, meanwhile: Meanwhile) -> Outcome:
    procedure = procedure_of(plan)
    events: list[Event] = []
    loop = asyncio.get_running_loop()
    async with build_rig(config) as rig:
        world, began_s = world_of(rig), loop.time()

        async def emit(event: Event) -> None:
            events.append(event)
            meanwhile(world, event)

        result, error = None, None
        try:
            chosen = procedure.predict(plan, rig).plan
            result = procedure.result_json(await procedure.run(rig, chosen, emit))
            result["plan"] = chosen.model_dump(mode="json")
        except Exception as failure:  # noqa: BLE001 - the test says what it should have been
            error = failure
        ended_s = loop.time()
        at_rest = world.plate.end_s <= ended_s
        return Outcome(result, error, events, ended_s - began_s, at_rest, ended_s)


def silent_for(duration_s: float, within: tuple[float, float]) -> Meanwhile:
    """Unplug the gyro once the run is so far, and plug it in again after a while; only once."""
    done: list[Event] = []

    def unplug(world: World, event: Event) -> None:
        if isinstance(event, Progress) and within[0] < event.fraction < within[1] and not done:
            done.append(event)
            faults = world.faults("gyro")
            faults.silent = True
            asyncio.get_running_loop().call_later(duration_s, setattr, faults, "silent", False)

    return unplug


def sigmas_off(result: JsonObject, azimuth_deg: float) -> float:
    """How many stated sigma a result is from the truth, modulo the circle."""
    miss_deg = math.remainder(result["azimuth_deg"] - azimuth_deg, 360.0)
    return abs(miss_deg) / float(result["azimuth_sigma_deg"])
