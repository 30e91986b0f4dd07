"""Runs: start, list, look at, pause, resume, abort, follow."""

import hashlib
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Query, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from northfinder.records import Idempotency, Run, State, UnknownRunError
from northfinder.service.messages import (
    Detail,
    RunPage,
    RunRequest,
    Step,
    Summary,
    plan_of_request,
    steps_of,
)
from northfinder.service.parts import Parts, PartsOf
from northfinder.service.problems import Problem, problem_responses
from northfinder.service.routes.run_ids import RunId

router = APIRouter(prefix="/runs", tags=["runs"])

_RETRY_MS = 1000
_MOST_SEQ = 2**31 - 1

Key = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        max_length=200,
        pattern=r"^[!-~]+$",
        description="Chosen once per run that is meant: a repeated request starts no second run.",
    ),
]


@router.post("", status_code=202, responses=problem_responses(404, 409, 422, 503))
async def start_run(
    request: RunRequest, parts: PartsOf, response: Response, key: Key = None
) -> Detail:
    """Start a run; one at a time."""
    idempotency = None
    if key is not None:
        body = request.model_dump_json().encode()
        idempotency = Idempotency(key, hashlib.sha256(body).hexdigest())
    plan = plan_of_request(request)
    run_id = await parts.thread.call(lambda worker: worker.start(plan, idempotency))
    response.headers["Location"] = f"/api/v1/runs/{run_id}"
    parts.feed.wake()
    return await _detail(parts, run_id)


@router.get("", responses=problem_responses(422, 503))
def list_runs(  # noqa: PLR0913, PLR0917 -- one argument a query parameter
    parts: PartsOf,
    cursor: Annotated[str | None, Query(max_length=100)] = None,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    kind: Annotated[str | None, Query(max_length=32)] = None,
    state: State | None = None,
    rig: Annotated[str | None, Query(max_length=200)] = None,
) -> RunPage:
    """Runs, newest first; those of every rig that shares the database."""
    try:
        page = parts.records.page(limit, cursor=cursor, kind=kind, state=state, rig_name=rig)
    except UnknownRunError as error:
        sentence = "query.cursor is none that a page of this service ended with."
        errors = [{"field": "query.cursor", "message": "is unknown"}]
        raise Problem(422, "invalid-request", sentence, errors=errors) from error
    runs = [Summary.of(run) for run in page.runs]
    return RunPage(runs=runs, next_cursor=page.next_cursor, total=page.total)


@router.get("/{run_id}", responses=problem_responses(404, 503))
def get_run(run_id: RunId, parts: PartsOf) -> Detail:
    """One run, with its result where there is one."""
    run = parts.records.run(run_id)
    return Detail.of_run(run, pausing=parts.thread.will_pause(run.id))


@router.post("/{run_id}/pause", status_code=202, responses=problem_responses(404, 409, 503))
async def pause_run(run_id: RunId, parts: PartsOf) -> Detail:
    """Wait after the present visit; the table stands."""
    await _legal(parts, run_id, "pause")
    if not await parts.thread.call(lambda worker: worker.pause(run_id)):
        raise _not_here(run_id)
    return await _detail(parts, run_id)


@router.post("/{run_id}/resume", status_code=202, responses=problem_responses(404, 409, 422, 503))
async def resume_run(run_id: RunId, parts: PartsOf) -> Detail:
    """Go on after a pause, or carry a stopped run on in a new segment."""
    run = await _legal(parts, run_id, "resume")
    if run.rig_name != parts.config.site.name:
        sentence = f"Run {run.id} was measured on the rig {run.rig_name}: resume it there."
        raise Problem(409, "other-rig", sentence, run_id=run.id)
    if run.state not in {"failed", "interrupted"} and not parts.thread.carries_out(run.id):
        raise _not_here(run.id)
    await parts.thread.call(lambda worker: worker.resume(run))
    parts.feed.wake()
    return await _detail(parts, run_id)


@router.post("/{run_id}/abort", status_code=202, responses=problem_responses(404, 409, 503))
async def abort_run(run_id: RunId, parts: PartsOf) -> Detail:
    """End a run for good; the table is stopped. Aborting an aborted run changes nothing."""
    run = await run_in_threadpool(parts.records.run, run_id)
    if run.state != "aborted":
        await _legal(parts, run_id, "abort")
        await _abort(parts, run)
    return await _detail(parts, run_id)


def _following(
    run_id: RunId,
    parts: PartsOf,
    last_event_id: Annotated[int, Header(ge=0, le=_MOST_SEQ)] = 0,
) -> AsyncIterator[ServerSentEvent]:
    """Find the run before the stream begins: a stream cannot answer 404 any more."""
    parts.records.events(run_id, limit=1)  # a tenth of the work of reading the run
    return _events(parts, run_id, last_event_id)


@router.get(
    "/{run_id}/events", response_class=EventSourceResponse, responses=problem_responses(404, 503)
)
async def follow_run(
    events: Annotated[AsyncIterator[ServerSentEvent], Depends(_following)],
) -> AsyncIterator[ServerSentEvent]:
    """A run's events from the first, or from `Last-Event-ID` on, until it ends."""
    async for event in events:
        yield event


async def _events(parts: Parts, run_id: str, after: int) -> AsyncIterator[ServerSentEvent]:
    yield ServerSentEvent(retry=_RETRY_MS, comment=f"run {run_id}")
    async for frame in parts.hub.follow(run_id, after):
        yield ServerSentEvent(raw_data=frame.data, event=frame.event, id=str(frame.seq))


async def _detail(parts: Parts, run_id: str) -> Detail:
    run = await run_in_threadpool(parts.records.run, run_id)
    return Detail.of_run(run, pausing=parts.thread.will_pause(run.id))


async def _legal(parts: Parts, run_id: str, step: Step) -> Run:
    """Return the run where the step is legal now.

    Raises:
        IllegalStepError: It is not; the message names what is.
    """
    run = await run_in_threadpool(parts.records.run, run_id)
    legal = steps_of(run, pausing=parts.thread.will_pause(run.id))
    if step not in legal:
        ways = f"only {' or '.join(legal)}" if legal else "nothing else, it is over"
        sentence = f"Run {run.id} is {run.state}: it takes no {step}, {ways}."
        raise Problem(
            409, "illegal-step", sentence, run_id=run.id, state=run.state, steps=list(legal)
        )
    return run


async def _abort(parts: Parts, run: Run) -> None:
    if await parts.thread.call(lambda worker: worker.abort(run.id)):
        return
    if run.state not in {"failed", "interrupted"}:
        raise _not_here(run.id)
    parts.hub.publish(await run_in_threadpool(parts.records.set_state, run.id, "aborted"))


def _not_here(run_id: str) -> Problem:
    sentence = f"Run {run_id} is carried out by another process: ask that one."
    return Problem(409, "not-here", sentence, run_id=run_id)
