"""The service beside the plainest FastAPI app that returns the same dicts, under one client."""

import asyncio
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np

from northfinder.proof.figure import Figure
from northfinder.proof.http_client import HttpConnection, JsonObject
from northfinder.proof.processes import plain_service, simulated_service
from northfinder.proof.service_load import run_to_its_end, wait_until_ready

_RUNS = 20
_SHORT: JsonObject = {"kind": "north-seek", "positions": 4, "dwell_s": 0.2, "settle_s": 0.1}
_LEAST = {"/healthz": 0.5, "/api/v1/rig": 0.3, "/api/v1/runs": 0.2}
_FILL_SPEED = 100.0
_ROUND = 20


def service_peers(requests: int = 1000, runs: int = _RUNS) -> Iterator[Figure]:
    """Ask both in turn over one connection each; the rig streams all the while.

    Args:
        requests: Of each path, to each service.
        runs: In the history that is asked for.

    Yields:
        How many times as fast as the plain app, by medians; its limit is what a socket alone
        takes for the same bytes.
    """
    for path, (ours_s, plain_s, bare_s) in asyncio.run(_measure(requests, runs)).items():
        limit = f"a bare socket {1 / bare_s:,.0f} answers/s: {100 * bare_s / ours_s:.0f} % of it"
        name = f"GET {path} / plainest FastAPI"
        yield Figure(name, plain_s / ours_s, "times as fast", _LEAST[path], None, limit)


async def _measure(requests: int, runs: int) -> dict[str, list[float]]:
    """Return by path the median duration of an answer of ours, the plain app's, bare bytes', s."""
    with tempfile.TemporaryDirectory() as folder:
        async with simulated_service(Path(folder), _FILL_SPEED) as port:
            await _fill(port, runs)
        async with simulated_service(Path(folder), 1.0) as port:
            with closing(HttpConnection(port)) as ours:
                await wait_until_ready(ours)
                answers = {path: await ours.ask("GET", path) for path in _LEAST}
                return await _compare(ours, answers, Path(folder), requests)


async def _compare(
    ours: HttpConnection, answers: dict[str, JsonObject], folder: Path, requests: int
) -> dict[str, list[float]]:
    async with plain_service(answers, folder) as (plain_port, bare_port):
        plain, bare = HttpConnection(plain_port), HttpConnection(bare_port)
        with closing(plain), closing(bare):
            return {path: await _medians_s([ours, plain, bare], path, requests) for path in answers}


async def _fill(port: int, runs: int) -> None:
    """Record so many short runs: a history as long as its first page."""
    with closing(HttpConnection(port)) as service:
        await wait_until_ready(service)
        for _ in range(runs):
            await run_to_its_end(service, _SHORT)


async def _medians_s(clients: list[HttpConnection], path: str, requests: int) -> list[float]:
    """Ask in rounds, so that whatever disturbs disturbs all alike."""
    durations_s: list[list[float]] = [[] for _ in clients]
    for _ in range(max(1, requests // _ROUND)):
        for client, taken_s in zip(clients, durations_s, strict=True):
            for _ in range(_ROUND):
                begun_s = time.perf_counter()
                await client.ask("GET", path)
                taken_s.append(time.perf_counter() - begun_s)
    return [float(np.median(taken_s)) for taken_s in durations_s]
