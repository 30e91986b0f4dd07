"""Whether the service lives, and whether it can measure and record."""

from collections.abc import Mapping

from fastapi import APIRouter
from pydantic import BaseModel
from starlette.concurrency import run_in_threadpool
from starlette.responses import PlainTextResponse, Response

from northfinder.records import Records, RecordsError, State
from northfinder.service.metrics import Moment
from northfinder.service.parts import PartsOf
from northfinder.service.problems import Problem, problem_responses

router = APIRouter(tags=["health"])


class Health(BaseModel):
    """It does."""

    status: str


@router.get("/healthz")
async def healthz() -> Health:
    """The process answers."""
    return Health(status="ok")


@router.get("/readyz", responses=problem_responses(503))
async def readyz(parts: PartsOf) -> Health:
    """A run could be started, or is on: instruments and records are there."""
    rig = await parts.feed.snapshot()
    if rig["state"] not in {"ready", "busy"}:
        raise Problem(503, "rig-offline", f"The rig is {rig['state']}: {rig['detail']}")
    if not rig["database"]["ok"]:
        raise Problem(503, "records-unavailable", rig["database"]["detail"])
    return Health(status="ok")


@router.get("/metrics", response_class=PlainTextResponse)
async def metrics(parts: PartsOf) -> Response:
    """What Prometheus asks for."""
    moment = Moment(
        rig=await parts.feed.snapshot(),
        runs_by_state=await run_in_threadpool(_runs_by_state, parts.records),
        subscribers=parts.hub.subscribers + parts.feed.listeners,
    )
    return parts.metrics.response(moment)


def _runs_by_state(records: Records) -> Mapping[State, int] | None:
    try:
        return records.count_by_state()
    except RecordsError:
        return None  # northfinder_database_up says so
