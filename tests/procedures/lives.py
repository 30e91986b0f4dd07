"""Runs that are interrupted, paused and resumed, on simulated rigs in virtual time."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from northfinder.errors import NorthfinderError
from northfinder.procedures.events import Event, VisitCompleted
from northfinder.procedures.gate import Gate
from northfinder.procedures.north_seek import Plan, run
from northfinder.procedures.north_seek_json import JsonObject, north_seek_json
from northfinder.procedures.visits import Visit
from northfinder.wiring import build_rig
from sim.world import World
from tests.procedures.rigs import config_of, virtually, world_of

EIGHT = Plan(positions=8, dwell_s=1.0, settle_s=0.1)

#: Sees every event of a life, and may spoil the world or pause the run.
Watch = Callable[[World, Gate, Event], None]


class CrashError(Exception):
    """The process went away."""


@dataclass
class Life:
    """What a life left behind: all visits of the run, and how it ended."""

    visits: list[Visit]
    events: list[Event] = field(default_factory=list)
    result: JsonObject | None = None
    refusal: str = ""

    @property
    def completed(self) -> JsonObject:
        assert self.result is not None, self.refusal
        return self.result

    def kinds(self) -> list[str]:
        return [type(event).__name__ for event in self.events]

    def of(self, kind: type) -> list[Any]:
        return [event for event in self.events if isinstance(event, kind)]


def nothing(_: World, __: Gate, ___: Event) -> None: ...


def live(
    plan: Plan = EIGHT,
    done: Sequence[Visit] = (),
    watch: Watch = nothing,
    elapsed_s: float = 1000.0,
    **sections: Any,  # noqa: ANN401 - of the configuration
) -> Life:
    """Live one life of a run, to its end, its refusal or its crash."""
    config = config_of(**sections)
    life = Life(list(done))

    async def begin() -> None:
        gate = Gate()
        async with build_rig(config) as rig:

            async def emit(event: Event) -> None:
                life.events.append(event)
                if isinstance(event, VisitCompleted):
                    life.visits.append(event.visit)
                watch(world_of(rig), gate, event)

            seek = await run(
                rig, plan, emit, done=done, elapsed_s=elapsed_s if done else 0.0, gate=gate
            )
            life.result = north_seek_json(seek)

    try:
        virtually(config, begin())
    except CrashError:
        pass
    except NorthfinderError as error:
        life.refusal = str(error)
    return life


def crash_after(visits: int) -> Watch:
    """CrashError as soon as so many visits of this life are complete."""

    def crash(_: Gate) -> None:
        raise CrashError

    return _after(visits, crash)


def pause_after(visits: int, pause_s: float) -> Watch:
    """Pause once, as soon as so many visits are complete."""
    return _after(visits, lambda gate: pause(gate, pause_s))


def pause(gate: Gate, pause_s: float) -> None:
    """Close the gate, and open it when that time has passed."""
    gate.close()
    asyncio.get_running_loop().call_later(pause_s, gate.open)


def _after(visits: int, act: Callable[[Gate], None]) -> Watch:
    left = [visits]

    def watch(_: World, gate: Gate, event: Event) -> None:
        if isinstance(event, VisitCompleted):
            left[0] -= 1
            if left[0] == 0:
                act(gate)

    return watch
