"""Puts the service together: one rig, its records, its page."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import APIRouter, FastAPI

from northfinder.config import RigConfig
from northfinder.records import Records
from northfinder.rig import Rig
from northfinder.service import routes
from northfinder.service.docs_page import docs_routes
from northfinder.service.hub import Hub
from northfinder.service.memory import keep_giving_back
from northfinder.service.metrics import Metrics
from northfinder.service.parts import Parts
from northfinder.service.problems import install_problems, problem_responses
from northfinder.service.rig_feed import RigFeed
from northfinder.service.rig_thread import RigThread
from northfinder.service.routes.studies import studies_router
from northfinder.service.sessions import Guesses, Sessions, session_router
from northfinder.service.settings import ServiceSettings
from northfinder.service.shell import shell
from northfinder.service.static_files import page_files, static_routes
from northfinder.service.worker import Worker
from northfinder.wiring import build_rig, require_finite_speed, with_latitude, with_speed

SPEED = 20.0  # of a simulated rig whose configuration names none: a technician sees it work

API = "/api/v1"
API_VERSION = "1.3"  # of the interface that programs are written for, not of the software


def create_app(config: RigConfig, settings: ServiceSettings, records: Records) -> FastAPI:
    """Make the service of one rig; its thread starts with the application and ends with it.

    Args:
        config: The rig.
        settings: For whom it is.
        records: Where runs are kept; the caller's to close.

    Raises:
        ConfigError: The configuration describes no rig, nobody could follow its speed, or the
            page is missing.
    """
    config = with_speed(with_latitude(config), SPEED)
    require_finite_speed(config)
    bench = build_rig(config)
    files = page_files()
    metrics = Metrics()
    sessions = Sessions()
    guesses = None if settings.token is None else Guesses(settings.token)
    app = FastAPI(
        title="northfinder",
        version=API_VERSION,
        description="Finds true north with a gyro and an accelerometer on a turntable.",
        middleware=shell(settings, metrics, sessions, guesses, {*files, "/healthz"}),
        lifespan=lambda app: _running(app, bench, records, metrics),
        responses=problem_responses(400, 401, 403, 413, 422, 500, 503),
        docs_url=None,
        redoc_url=None,
        openapi_url="/openapi.json",
    )
    install_problems(app)
    api = APIRouter(prefix=API)
    for router in (routes.rig, routes.simulation, routes.runs, routes.record):
        api.include_router(router.router)
    api.include_router(session_router(sessions, guesses))
    api.include_router(studies_router())
    app.include_router(api)
    app.include_router(routes.health.router)
    app.router.routes.extend([*docs_routes(app.title, "/openapi.json"), *static_routes(files)])
    return app


@asynccontextmanager
async def _running(
    app: FastAPI, bench: Rig, records: Records, metrics: Metrics
) -> AsyncIterator[None]:
    hub = Hub(records, asyncio.get_running_loop())
    thread = RigThread(bench.config, Worker(bench, records, hub.publish))
    feed = RigFeed(bench.config, thread)
    app.state.parts = Parts(bench.config, records, thread, feed, hub, metrics)
    thread.start()
    tasks = [
        asyncio.create_task(feed.keep_asking(), name="rig feed"),
        asyncio.create_task(feed.keep_house(records), name="housekeeping"),
        asyncio.create_task(keep_giving_back(), name="memory"),
    ]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await thread.stop()


async def stop_bench(app: FastAPI) -> None:
    """Stop the table and what runs on it; for the server, before it ends."""
    parts: Parts = app.state.parts
    await parts.thread.stop()


def end_streams(app: FastAPI) -> None:
    """End the endless answers."""
    parts: Parts = app.state.parts
    parts.hub.close()
    parts.feed.close()
