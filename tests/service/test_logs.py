"""What the service says: lines that a collector can read, with the run they belong to."""

import io
import json
import logging
from collections.abc import Iterator

import pytest
import structlog

from northfinder.service.logs import _TALKATIVE, set_up_logs
from tests.service.asking import ask
from tests.service.shell_app import shell_app


@pytest.fixture
def stream() -> Iterator[io.StringIO]:
    """Where the logs go, until the test's end."""
    loggers = [logging.getLogger(name) for name in ("", *_TALKATIVE)]
    before = [(logger, logger.handlers, logger.level) for logger in loggers]
    stream = io.StringIO()
    set_up_logs(stream=stream)
    yield stream
    for logger, handlers, level in before:
        logger.handlers = handlers
        logger.setLevel(level)


def lines(stream: io.StringIO) -> list[dict[str, str]]:
    """Return what was logged, but for the client's own part of it."""
    logged = [json.loads(line) for line in stream.getvalue().splitlines()]
    return [line for line in logged if line["logger"] != "httpx"]


def test_a_line_says_who_when_and_about_which_run(stream: io.StringIO) -> None:
    with structlog.contextvars.bound_contextvars(run_id="7f"):
        logging.getLogger("sqlalchemy.pool").warning("the pool of %d is empty", 5)
    (line,) = lines(stream)
    assert line.pop("time").endswith("Z")
    assert line == {
        "level": "warning",
        "logger": "sqlalchemy.pool",
        "message": "the pool of 5 is empty",
        "run_id": "7f",
    }


def test_a_traceback_stays_in_its_line(stream: io.StringIO) -> None:
    ask(shell_app(), "GET", "/api/v1/defect")
    defect, request = lines(stream)
    assert "ZeroDivisionError" in defect["exception"]
    assert request["message"].startswith("GET /api/v1/defect 500 ")


def test_writes_are_logged_and_reads_are_not(stream: io.StringIO) -> None:
    ask(shell_app(), "GET", "/api/v1/runs/7")
    ask(shell_app(), "POST", "/api/v1/wishes", json={"kind": "noise"})
    (line,) = lines(stream)
    assert line["message"].startswith("POST /api/v1/wishes 200 ")
    assert line["message"].endswith(" ms")


def test_a_stranger_writes_no_lines_of_his_own(stream: io.StringIO) -> None:
    ask(shell_app(), "POST", "/x%0a%1b[31mall is well")
    (line,) = lines(stream)
    assert "\n" not in line["message"]
    assert "\x1b" not in line["message"]
