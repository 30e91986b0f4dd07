"""What a run left behind: visits, raw samples, result, certificate, figures."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse

from northfinder.records import Records, Run
from northfinder.records.export import samples_csv, samples_parquet, visit_json, visits_csv
from northfinder.replay import estimates_of
from northfinder.report.certificate import certificate
from northfinder.report.figures import draw, drawn_from
from northfinder.service import policies
from northfinder.service.messages import JsonObject, Visits
from northfinder.service.parts import PartsOf
from northfinder.service.problems import Problem, problem_responses
from northfinder.service.routes.run_ids import RunId

router = APIRouter(prefix="/runs/{run_id}", tags=["record"], responses=problem_responses(404, 503))

_DOCUMENT = {"Content-Security-Policy": policies.DOCUMENT}
_CSV, _PARQUET = "text/csv; charset=utf-8", "application/vnd.apache.parquet"


class SvgResponse(Response):
    """A figure."""

    media_type = "image/svg+xml"


@router.get("/visits", response_model=Visits, responses={200: {"content": {"text/csv": {}}}})
def get_visits(
    run_id: RunId,
    parts: PartsOf,
    format: Annotated[Literal["json", "csv"], Query()] = "json",  # noqa: A002 -- its public name
) -> Response | JsonObject:
    """The visits in time order."""
    if format == "json":
        return {"visits": _visits(parts.records, run_id)}
    rows = visits_csv(parts.records, run_id)
    return StreamingResponse(rows, media_type=_CSV, headers=_attachment(run_id, "visits.csv"))


@router.get(
    "/samples",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/csv": {}, _PARQUET: {}}}},
)
def get_samples(
    run_id: RunId,
    parts: PartsOf,
    format: Annotated[Literal["csv", "parquet"], Query()] = "csv",  # noqa: A002 -- its public name
) -> Response:
    """Every raw sample of both sensors."""
    parts.records.run(run_id)  # a stream that has begun cannot answer 404 any more
    headers = _attachment(run_id, f"samples.{format}")
    if format == "csv":
        return StreamingResponse(samples_csv(parts.records, run_id), 200, headers, _CSV)
    return StreamingResponse(samples_parquet(parts.records, run_id), 200, headers, _PARQUET)


@router.get("/result.json", response_class=JSONResponse, responses=problem_responses(409))
def get_result(run_id: RunId, parts: PartsOf) -> JSONResponse:
    """The result as a file."""
    run = parts.records.run(run_id)
    if run.result is None:
        raise _without_result(run)
    return JSONResponse(run.result, headers=_attachment(run_id, "result.json"))


@router.get("/report.html", response_class=HTMLResponse)
def get_report(run_id: RunId, parts: PartsOf) -> HTMLResponse:
    """The certificate; of a run that has not been completed, the record of what it did."""
    store = parts.records
    page = certificate(
        store.run(run_id),
        store.visits(run_id),
        estimates_of(store, run_id),
        store.samples_sha256(run_id),
    )
    return HTMLResponse(page, headers=_DOCUMENT)


@router.get("/figures/{name}.svg", response_class=SvgResponse)
def get_figure(run_id: RunId, name: str, parts: PartsOf) -> SvgResponse:
    """A figure of the certificate.

    Of a north-seek: fit, residuals, dial, convergence, budget. Of an alignment or a heading hold:
    dial, heading, level, budget. Of a noise record: allan-gyro, allan-accelerometer.
    """
    store = parts.records
    run = store.run(run_id)
    result = drawn_from(run, store.visits(run_id))
    return SvgResponse(draw(name, result, estimates_of(store, run_id)), headers=_DOCUMENT)


def _visits(store: Records, run_id: str) -> list[JsonObject]:
    return [visit_json(entry) for entry in store.visits(run_id)]


def _without_result(run: Run) -> Problem:
    sentence = f"Run {run.id} is {run.state} and has no result; its visits are at /visits."
    return Problem(409, "no-result", sentence, run_id=run.id)


def _attachment(run_id: str, name: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="{run_id}-{name}"'}
