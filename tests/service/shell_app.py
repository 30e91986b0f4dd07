"""The shell of the service around a few routes: what its tests ask, also as a process of its own.

``python -m tests.service.shell_app PORT ends-streams`` serves it, with an endless stream at
``/stream`` and a bench that takes a moment to stop; with ``keeps-streams`` the stream never ends.
"""

import asyncio
import sys
import time
from collections.abc import AsyncIterator
from typing import Annotated, Literal

from fastapi import FastAPI
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import BaseModel, ConfigDict, Field

from northfinder.service.logs import set_up_logs
from northfinder.service.metrics import Metrics
from northfinder.service.problems import Problem, install_problems, problem_responses
from northfinder.service.server import leave, listen, run
from northfinder.service.sessions import Guesses, Sessions, session_router
from northfinder.service.settings import service_settings
from northfinder.service.shell import shell

TOKEN = "correct-horse-battery"  # noqa: S105 - of the tests


class Wish(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    kind: Literal["north-seek", "noise"]
    positions: Annotated[int, Field(ge=4, le=720)] = 24
    dwell_s: float = 5.0


class Ending:
    """What an endless stream waits for."""

    def __init__(self) -> None:
        self.has_come = asyncio.Event()


def shell_app(
    *, token: str | None = None, metrics: Metrics | None = None, ending: Ending | None = None
) -> FastAPI:
    settings = service_settings("127.0.0.1", 8000, token, [], "sqlite://")
    sessions, guesses = Sessions(), Guesses(token) if token else None
    layers = shell(settings, metrics or Metrics(), sessions, guesses, {"/healthz"})
    app = FastAPI(middleware=layers, docs_url=None, responses=problem_responses(400, 422))
    install_problems(app)
    app.include_router(session_router(sessions, guesses), prefix="/api/v1")
    ending = ending or Ending()

    @app.get("/healthz")
    async def healthz() -> str:
        return "ok"

    @app.post("/api/v1/wishes")
    async def wish(wish: Wish) -> Wish:
        return wish

    @app.post("/api/v1/busy", responses=problem_responses(409))
    async def busy() -> None:
        raise Problem(409, "rig-busy", "Run 7 is on: wait for its end.", run_id="7")

    @app.get("/api/v1/runs/{run_id}")
    async def show(run_id: str) -> str:
        return run_id

    @app.get("/api/v1/defect")
    async def defect() -> None:
        _ = 1 / 0

    @app.get("/slow")
    def slow() -> None:
        time.sleep(60.0)

    @app.get("/stream", response_class=EventSourceResponse)
    async def stream() -> AsyncIterator[ServerSentEvent]:
        number = 0
        while not ending.has_come.is_set():
            yield ServerSentEvent(data={"number": number})
            number += 1
            try:
                async with asyncio.timeout(0.01):
                    await ending.has_come.wait()
            except TimeoutError:
                continue

    return app


def say(what: str) -> None:
    sys.stdout.write(f"{what}\n")
    sys.stdout.flush()


def main(port: int, *, ends_streams: bool) -> None:
    set_up_logs()
    ending = Ending()

    async def stop_bench() -> None:
        await asyncio.sleep(0.1)
        say("the table has stopped")

    def end_streams() -> None:
        say("the streams are told to end")
        if ends_streams:
            ending.has_come.set()

    try:
        run(shell_app(ending=ending), listen("127.0.0.1", port), stop_bench, end_streams)
    except KeyboardInterrupt:
        leave(130)
    leave(0)


if __name__ == "__main__":
    main(int(sys.argv[1]), ends_streams=sys.argv[2] == "ends-streams")
