"""Every error is a problem document of RFC 9457, and says which value is wrong and what to do."""

import asyncio
import json

import anyio
import httpx
import pytest
from starlette.types import Message, Receive, Scope, Send

from drivers.errors import DriverError, LinkTimeoutError
from northfinder.errors import ConfigError
from northfinder.records import RecordsError
from northfinder.records.errors import DatabaseUrlError, IllegalStepError, UnknownRunError
from northfinder.service.last_resort import LastResort
from northfinder.service.problems import problem_of
from tests.service.asking import ask
from tests.service.shell_app import shell_app

_JSON = {"Content-Type": "application/json"}


def problem(answer: httpx.Response, status: int) -> dict[str, object]:
    """Check what RFC 9457 asks of every problem, and return it."""
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, object] = answer.json()
    assert document["status"] == status
    assert {type(document[name]) for name in ("type", "title", "detail")} == {str}
    return document


def mistakes(body: bytes, headers: dict[str, str] = _JSON) -> dict[str, str]:
    answer = ask(shell_app(), "POST", "/api/v1/wishes", headers, content=body)
    errors = problem(answer, 422)["errors"]
    assert isinstance(errors, list)
    return {error["field"]: error["message"] for error in errors}


def test_a_problem_carries_what_a_program_can_use() -> None:
    busy = problem(ask(shell_app(), "POST", "/api/v1/busy"), 409)
    assert busy == {
        "type": "/problems/rig-busy",
        "title": "Rig busy",
        "status": 409,
        "detail": "Run 7 is on: wait for its end.",
        "run_id": "7",
    }


def test_a_bad_request_names_the_fields_and_their_limits() -> None:
    assert mistakes(b'{"kind": "nose", "positions": 3, "dwell_s": "long", "speed": 1}') == {
        "body.kind": "should be 'north-seek' or 'noise', not \"nose\"",
        "body.positions": "should be greater than or equal to 4, not 3",
        "body.dwell_s": 'should be a valid number, unable to parse string as a number, not "long"',
        "body.speed": "is not a known field",
    }
    assert mistakes(b"{}") == {"body.kind": "is required"}


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (b"", "is required"),
        (b"{", "is no JSON"),
        (b'{"kind": "\xff"}', "is not text in UTF-8"),
        (b"[" * 60_000, "is nested too deeply"),
        (b'{"kind": ' + b"9" * 5000 + b"}", "is no JSON that can be read"),
        (b"[]", "should be a valid dictionary"),
    ],
)
def test_a_body_that_is_no_json_object_is_422(body: bytes, said: str) -> None:
    assert mistakes(body)["body"].startswith(said)


def test_a_body_that_does_not_claim_to_be_json_is_told_to() -> None:
    assert "Content-Type: application/json" in mistakes(b'{"kind": "noise"}', {})["body"]


@pytest.mark.parametrize(
    ("value", "named"),
    [("NaN", "not NaN"), ('"\\ud800"', r'not "\ud800"'), ('"' + "x" * 60_000 + '"', "a number")],
)
def test_an_answer_survives_what_it_repeats(value: str, named: str) -> None:
    """No number that JSON lacks, no half of a surrogate pair, no megabytes come back."""
    message = mistakes(b'{"kind": "noise", "dwell_s": %s}' % value.encode())["body.dwell_s"]
    assert message.endswith(named)


def test_a_thousand_mistakes_are_answered_with_a_few() -> None:
    body = json.dumps({"k" * 100 + str(number): 0 for number in range(500)}).encode()
    assert len(mistakes(body)) <= 20


def test_what_is_not_there_is_a_problem_too() -> None:
    assert "/docs" in str(problem(ask(shell_app(), "GET", "/api/v2"), 404)["detail"])
    answer = ask(shell_app(), "PUT", "/api/v1/wishes")
    assert "allowed is POST" in str(problem(answer, 405)["detail"])
    assert answer.headers["allow"] == "POST"


def test_a_reader_who_leaves_in_mid_stream_is_no_defect(caplog: pytest.LogCaptureFixture) -> None:
    async def stream(_: Scope, __: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        msg = "of the keep-alive"
        raise ExceptionGroup(msg, [anyio.BrokenResourceError()])

    async def receive() -> Message:
        return {"type": "http.disconnect"}

    async def send(_: Message) -> None: ...

    scope = {"type": "http", "method": "GET", "path": "/api/v1/rig/events"}
    with caplog.at_level("INFO"):
        asyncio.run(LastResort(stream)(scope, receive, send))
    (line,) = caplog.messages
    assert line == "the client has left: GET /api/v1/rig/events"


def test_a_defect_is_a_sentence_for_the_client_and_a_traceback_for_the_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    defect = problem(ask(shell_app(), "GET", "/api/v1/defect"), 500)
    (logged,) = [record for record in caplog.records if record.exc_info]
    assert str(defect["reference"]) in logged.getMessage()
    assert "ZeroDivisionError" in caplog.text
    assert "ZeroDivisionError" not in str(defect)


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (UnknownRunError("no run 7"), 404),
        (IllegalStepError("run 7 is paused", "7", "paused", ("running", "aborted")), 409),
        (RecordsError("the database is locked"), 503),
        (DatabaseUrlError("no such database"), 503),
        (ConfigError("positions = 3 leaves no freedom"), 422),
        (DriverError("the gyro is silent"), 503),
        (LinkTimeoutError("no answer within 1 s"), 503),
    ],
)
def test_our_own_errors_keep_their_sentence(error: Exception, status: int) -> None:
    answer = problem_of(error)
    assert (answer.status_code, answer.detail) == (status, str(error))
    assert ("Retry-After" in (answer.headers or {})) == (status == 503)


def test_an_illegal_step_names_the_legal_ones() -> None:
    error = IllegalStepError("run 7 is paused", "7", "paused", ("running", "aborted"))
    assert problem_of(error).members["steps"] == ["resume", "abort"]


def test_openapi_describes_problems_and_nothing_of_fastapis_own() -> None:
    document = ask(shell_app(), "GET", "/openapi.json").json()
    answers = document["paths"]["/api/v1/busy"]["post"]["responses"]
    assert set(answers) == {"200", "400", "409", "422"}
    assert list(answers["409"]["content"]) == ["application/problem+json"]
    assert "HTTPValidationError" not in document["components"]["schemas"]
    assert document["components"]["schemas"]["Problem"]["required"]
