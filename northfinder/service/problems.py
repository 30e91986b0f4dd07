"""Every error answer is a problem document (RFC 9457), and every one is a sentence.

A problem with a name of its own has the type ``/problems/<name>``, a reference that identifies it
and leads nowhere; one that says no more than its status has ``about:blank``. A body that is no
JSON is 422, like one whose fields are wrong: the request was understood, what it carries was not.
"""

import json
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any, NamedTuple, cast

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import compile_path

from drivers.errors import DriverError
from northfinder.errors import AcquisitionError, ConfigError, EstimationError, NorthfinderError
from northfinder.formatting import sentence_of
from northfinder.records import RecordsError, State
from northfinder.records.errors import (
    HeldElsewhereError,
    IdempotencyKeyUsedError,
    IllegalStepError,
    UnknownRunError,
)
from northfinder.report.figures import UnknownFigureError
from northfinder.service.bad_requests import Mistake, mistakes_of, sentence_about, unreadable
from northfinder.service.errors import RigBusyError, RigOfflineError
from northfinder.service.messages import legal_steps

JsonObject = dict[str, Any]
MEDIA_TYPE = "application/problem+json"
_RETRY_AFTER_S = 5
_ECHOED = 100  # characters of a request that an answer repeats at most


class Problem(HTTPException):
    """An error answer.

    Args:
        status: The HTTP status.
        name: What identifies this kind of problem (``rig-busy``); None if the status says it all.
        detail: A sentence: what happened, which value, what to do.
        headers: More headers for the answer.
        members: What a program can use of it, such as the run that keeps the rig busy.
    """

    def __init__(
        self,
        status: int,
        name: str | None,
        detail: str,
        *,
        headers: Mapping[str, str] | None = None,
        **members: Any,  # noqa: ANN401 - whatever JSON can say
    ) -> None:
        super().__init__(status, detail, headers)
        self.name = name
        self.members = members

    def to_json(self) -> JsonObject:
        """Return the problem document."""
        if self.name is None:
            kind, title = "about:blank", HTTPStatus(self.status_code).phrase
        else:
            kind, title = f"/problems/{self.name}", self.name.replace("-", " ").capitalize()
        head = {"type": kind, "title": title, "status": self.status_code, "detail": self.detail}
        return {**head, **self.members}

    def response(self) -> Response:
        """Return the answer; ASCII, for a request may have smuggled in half a surrogate pair."""
        body = json.dumps(self.to_json(), allow_nan=False).encode("ascii")
        return Response(body, self.status_code, self.headers, MEDIA_TYPE)


class _Kind(NamedTuple):
    status: int
    name: str


#: What our own errors mean to a client; the nearest class of an error's ancestry counts.
_KINDS: dict[type[Exception], _Kind] = {
    RigBusyError: _Kind(409, "rig-busy"),
    RigOfflineError: _Kind(503, "rig-offline"),
    UnknownFigureError: _Kind(404, "unknown-figure"),
    UnknownRunError: _Kind(404, "unknown-run"),
    HeldElsewhereError: _Kind(409, "held-elsewhere"),
    IllegalStepError: _Kind(409, "illegal-step"),
    IdempotencyKeyUsedError: _Kind(422, "idempotency-key-used"),
    RecordsError: _Kind(503, "records-unavailable"),
    ConfigError: _Kind(422, "cannot-be-carried-out"),
    EstimationError: _Kind(422, "cannot-be-determined"),
    AcquisitionError: _Kind(503, "no-readings"),
    NorthfinderError: _Kind(409, "not-possible"),
    DriverError: _Kind(503, "device-unavailable"),
}


def problem_of(error: Exception) -> Problem:
    """Return what one of our own errors, a driver's or an HTTP exception means to a client."""
    if isinstance(error, Problem):
        return error
    if isinstance(error, HTTPException):
        return Problem(error.status_code, None, f"{error.detail}.", headers=error.headers)
    kind = next(_KINDS[cls] for cls in type(error).__mro__ if cls in _KINDS)
    headers = {"Retry-After": str(_RETRY_AFTER_S)} if kind.status == 503 else None
    return Problem(
        kind.status, kind.name, sentence_of(error), headers=headers, **_members(error, kind)
    )


def _members(error: Exception, kind: _Kind) -> JsonObject:
    if isinstance(error, RigBusyError):
        return {"run_id": error.run_id}
    if isinstance(error, IllegalStepError):
        is_ours = not isinstance(error, HeldElsewhereError)
        steps = legal_steps(cast("State", error.state), pausing=False) if is_ours else []
        return {"run_id": error.run_id, "state": error.state, "steps": steps}
    if kind.status == 422:
        return {"errors": [{"field": "body", "message": sentence_of(error)}]}
    return {}


def install_problems(app: FastAPI) -> None:
    """Answer every error of an application with a problem, and describe them in its OpenAPI."""
    app.add_exception_handler(HTTPException, _answer_http)
    app.add_exception_handler(RequestValidationError, _answer_invalid)
    for kind in _KINDS:
        app.add_exception_handler(kind, _answer)
    _describe(app)


async def _answer(_request: Request, error: Exception) -> Response:
    return problem_of(error).response()


async def _answer_http(request: Request, error: Exception) -> Response:
    if isinstance(error, Problem):
        return error.response()
    problem = problem_of(error)
    if problem.status_code == 400 and error.__cause__ is not None:  # fastapi, reading the body
        return _invalid(unreadable(error.__cause__)).response()
    path = request.url.path[:_ECHOED]
    if problem.status_code == 404:
        problem.detail = f"There is nothing at {path}: see /docs for what there is."
    if problem.status_code == 405:
        told = {name.lower(): value for name, value in (problem.headers or {}).items()}
        allowed = _methods_at(request) or told.get("allow", "nothing")
        problem.headers = {"Allow": allowed}
        problem.detail = f"{request.method} is not possible at {path}: allowed is {allowed}."
    return problem.response()


def _methods_at(request: Request) -> str | None:
    """Return all methods of a described path; the framework names those of one route alone."""
    for path, operations in request.app.openapi()["paths"].items():
        if compile_path(path)[0].fullmatch(request.url.path):
            return ", ".join(method.upper() for method in operations)
    return None


async def _answer_invalid(_request: Request, error: Exception) -> Response:
    if not isinstance(error, RequestValidationError):
        raise error
    return _invalid(mistakes_of(error)).response()


def _invalid(mistakes: list[Mistake]) -> Problem:
    errors = [mistake._asdict() for mistake in mistakes]
    return Problem(422, "invalid-request", sentence_about(mistakes), errors=errors)


def problem_responses(*statuses: int) -> dict[int | str, JsonObject]:
    """Return what a route's ``responses`` say of the problems that it may answer with."""
    content = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
    return {
        status: {"description": HTTPStatus(status).phrase, "content": content}
        for status in statuses
    }


_TEXT = {"type": "string"}
_SCHEMA: JsonObject = {
    "title": "Problem",
    "description": "An error (RFC 9457); a problem may have more members than these.",
    "type": "object",
    "required": ["type", "title", "status", "detail"],
    "properties": {
        "type": {"type": "string", "format": "uri-reference", "examples": ["/problems/rig-busy"]},
        "title": _TEXT,
        "status": {"type": "integer"},
        "detail": {"type": "string", "description": "What happened, and what to do."},
        "errors": {
            "description": "Of a bad request: each field that is wrong, and how.",
            "type": "array",
            "items": {
                "type": "object",
                "required": ["field", "message"],
                "properties": {"field": _TEXT, "message": _TEXT},
            },
        },
        "run_id": {"type": ["string", "null"], "description": "The run that it is about."},
        "steps": {"type": "array", "items": _TEXT, "description": "What is legal instead."},
    },
}


def _describe(app: FastAPI) -> None:
    described = app.openapi

    def openapi() -> JsonObject:
        document = described()
        schemas = document.setdefault("components", {}).setdefault("schemas", {})
        schemas["Problem"] = _SCHEMA
        return document

    # As fastapi's manual extends OpenAPI.
    app.openapi = openapi  # type: ignore[method-assign]
