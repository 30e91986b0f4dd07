"""The rig: what it is doing, what a plan would take, and Stop."""

from collections.abc import AsyncIterator

from fastapi import APIRouter
from fastapi.sse import EventSourceResponse, ServerSentEvent

from northfinder.procedures.kinds import procedure_of
from northfinder.service.messages import Prediction, Rig, RunRequest, Stopped, plan_of_request
from northfinder.service.parts import PartsOf
from northfinder.service.problems import problem_responses
from northfinder.service.worker import JsonObject, Worker
from northfinder.starting import with_start

router = APIRouter(tags=["rig"])

_RETRY_MS = 1000


@router.get("/rig", response_model=Rig, responses=problem_responses(503))
async def get_rig(parts: PartsOf) -> JsonObject:
    """What the rig is, and what it is doing."""
    return await parts.feed.snapshot()


@router.get("/rig/events", response_class=EventSourceResponse)
async def follow_rig(parts: PartsOf) -> AsyncIterator[ServerSentEvent]:
    """The same as a stream of events `rig`: twenty a second while something moves."""
    yield ServerSentEvent(retry=_RETRY_MS, comment="the rig follows")
    async for rig in parts.feed.follow():
        yield ServerSentEvent(raw_data=rig, event="rig")


@router.post("/rig/stop", response_model=Stopped, responses=problem_responses(503))
async def stop_rig(parts: PartsOf) -> JsonObject:
    """Stop the table at once, and abort the run; always allowed."""
    run_id = await parts.thread.call(Worker.stop)
    return {"stopped": True, "run_id": run_id}


@router.post("/plans", response_model=Prediction, responses=problem_responses(404, 422, 503))
def predict_run(request: RunRequest, parts: PartsOf) -> JsonObject:
    """What a run would take and bring; moves nothing."""
    rig = parts.thread.rig()
    plan = with_start(plan_of_request(request), parts.records, rig.name)
    return procedure_of(plan).predict(plan, rig).to_json()
