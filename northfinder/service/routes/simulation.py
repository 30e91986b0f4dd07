"""The simulated world: its truth and its faults, while it runs."""

from typing import Annotated

from fastapi import APIRouter, Body

from northfinder.rig import Simulation
from northfinder.service.messages import (
    FaultChanges,
    Faults,
    SimulationChanges,
    SimulationSettings,
)
from northfinder.service.parts import PartsOf
from northfinder.service.problems import Problem, problem_responses
from northfinder.service.worker import JsonObject, Worker

router = APIRouter(
    prefix="/rig/simulation", tags=["simulation"], responses=problem_responses(404, 503)
)


@router.get("", response_model=SimulationSettings)
async def get_simulation(parts: PartsOf) -> JsonObject:
    """Where the simulated bench really stands, and how its sensors err."""
    return await parts.thread.call(_truth)


@router.patch("", response_model=SimulationSettings, responses=problem_responses(422))
async def change_simulation(
    parts: PartsOf, changes: Annotated[SimulationChanges, Body(examples=[{"azimuth_deg": 50.0}])]
) -> JsonObject:
    """Change some of it at once; a run that is on says so among its events."""
    given = changes.model_dump(exclude_unset=True)

    async def change(worker: Worker) -> JsonObject:
        truth = _simulation(worker).change(given)
        worker.warn_of_change(given)
        return truth

    return await parts.thread.call(change)


@router.get("/faults", response_model=Faults)
async def get_faults(parts: PartsOf) -> JsonObject:
    """What goes wrong on each wire, and with the simulated table."""

    async def faults(worker: Worker) -> JsonObject:
        return {"faults": _simulation(worker).faults()}

    return await parts.thread.call(faults)


@router.post("/faults", response_model=Faults, responses=problem_responses(422))
async def set_faults(
    parts: PartsOf,
    request: Annotated[FaultChanges, Body(examples=[{"device": "gyro", "drop_per_byte": 0.001}])],
) -> JsonObject:
    """Set some faults of one device at once."""
    given = request.model_dump(exclude_unset=True, exclude={"device"})

    async def set_some(worker: Worker) -> JsonObject:
        return {"faults": _simulation(worker).set_faults(request.device, given)}

    return await parts.thread.call(set_some)


@router.delete("/faults", response_model=Faults)
async def clear_faults(parts: PartsOf) -> JsonObject:
    """Mend everything."""

    async def clear(worker: Worker) -> JsonObject:
        return {"faults": _simulation(worker).clear_faults()}

    return await parts.thread.call(clear)


async def _truth(worker: Worker) -> JsonObject:
    return _simulation(worker).truth()


def _simulation(worker: Worker) -> Simulation:
    simulation = worker.simulation
    if simulation is None:
        raise Problem(404, "no-simulation", "This rig is real: there is no simulated world to set.")
    return simulation
