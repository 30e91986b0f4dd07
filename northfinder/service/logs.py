"""What the service says of itself: JSON lines for a collector, colours for a person.

Every logger of the standard library (ours, uvicorn's, SQLAlchemy's) speaks through it, and what
is bound in the context (``run_id``) stands in every line:
``with structlog.contextvars.bound_contextvars(run_id=...)``.
"""

import logging
import sys
import time
from typing import TextIO

import structlog
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_ACCESS = logging.getLogger("northfinder.access")
_TALKATIVE = ("uvicorn.error", "alembic")
_READS = {"GET", "HEAD", "OPTIONS"}


def set_up_logs(level: int = logging.INFO, stream: TextIO | None = None) -> None:
    """Send everything that is logged to a stream; called once, by the process's entry.

    Args:
        level: The lowest level that is shown; ``logging.DEBUG`` shows every request.
        stream: By default stderr; JSON lines unless it is a terminal.
    """
    stream = stream or sys.stderr
    is_for_people = stream.isatty()
    shown = _for_people() if is_for_people else _for_machines()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=[
                structlog.contextvars.merge_contextvars,
                structlog.stdlib.add_log_level,
                structlog.stdlib.add_logger_name,
                structlog.processors.TimeStamper(fmt="iso", utc=True, key="time"),
            ],
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *shown],
        )
    )
    root = logging.getLogger()
    root.handlers = [handler]
    root.setLevel(level)
    # Uvicorn's stages of starting and ending, Alembic's plugins: for whoever looks for a fault.
    for name in _TALKATIVE:
        logging.getLogger(name).setLevel(max(level, logging.WARNING))


def _for_machines() -> list[structlog.typing.Processor]:
    return [
        structlog.processors.format_exc_info,
        structlog.processors.EventRenamer("message"),
        structlog.processors.JSONRenderer(),
    ]


def _for_people() -> list[structlog.typing.Processor]:
    # The default traceback shows local variables, and among them the token.
    return [
        structlog.dev.ConsoleRenderer(
            timestamp_key="time", exception_formatter=structlog.dev.plain_traceback
        )
    ]


class AccessLog:
    """One line a request: writes at info, reads at debug (a page polls), failures as a warning."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and log how it was answered."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        status = 0
        begun_s = time.monotonic()

        async def send_noting(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, send_noting)
        finally:
            took_ms = 1e3 * (time.monotonic() - begun_s)
            level = _level(scope["method"], status)
            # As it was sent, percent-encoded: no line break of a stranger's in the log.
            path = scope.get("raw_path", b"").decode("latin-1")
            _ACCESS.log(level, "%s %s %d %.1f ms", scope["method"], path, status, took_ms)


def _level(method: str, status: int) -> int:
    if status >= 500 or status == 0:
        return logging.WARNING
    return logging.DEBUG if method in _READS else logging.INFO
