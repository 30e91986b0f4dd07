"""A run at real time over real pseudo-terminals, while many people watch and programs ask."""

import asyncio
import itertools
import tempfile
import time
from collections.abc import Iterator
from contextlib import AsyncExitStack, closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from northfinder.proof.figure import Figure
from northfinder.proof.http_client import HttpConnection, JsonObject
from northfinder.proof.processes import service_of, simulated_instruments

_API = "/api/v1"
_READY_S = 30.0
_WATCHERS = 10  # of the rig itself, 20 events a second each; beside those of the run
_CONNECTIONS = 16


@dataclass(slots=True)
class _Seen:
    """What subscribers and programs saw of a run under load.

    Attributes:
        latency_s: Of each answer, from the moment when it should have been asked for.
        numbers: Of the run's events, as each subscriber saw them.
        looks: How often each watcher saw the rig.
    """

    latency_s: list[float] = field(default_factory=list)
    numbers: list[list[int]] = field(default_factory=list)
    looks: list[int] = field(default_factory=list)


def service_load(
    duration_s: float = 60.0, subscribers: int = 100, requests_per_s: float = 50.0
) -> Iterator[Figure]:
    """Run at 1 kHz and 500 Hz for at least that long; instruments, service and load are processes.

    Args:
        duration_s: Of the run.
        subscribers: Streams of the run's events; besides, ten streams of the rig.
        requests_per_s: GETs of the rig, the history, the run and its visits in turn.
    """
    run, rig, seen = asyncio.run(_measure(duration_s, subscribers, requests_per_s))
    under = f"{duration_s:g} s, {subscribers} subscribers, {requests_per_s:g} requests/s"
    p99_ms = 1e3 * float(np.percentile(seen.latency_s, 99))
    yield Figure(f"{under}: samples lost", float(lost_in(run) + lost_by(rig)), "samples", None, 0.0)
    yield Figure(f"{under}: 99 of 100 GETs", p99_ms, "ms", None, 100.0)
    yield Figure(
        f"{under}: events missed", float(missed_events(run, seen.numbers)), "events", None, 0.0
    )


async def _measure(
    duration_s: float, subscribers: int, requests_per_s: float
) -> tuple[JsonObject, JsonObject, _Seen]:
    """Return the run, the rig and what was seen."""
    with tempfile.TemporaryDirectory() as folder:
        async with (
            simulated_instruments(Path(folder)) as links,
            service_of(links, Path(folder)) as (port, _),
            asyncio.timeout(duration_s + 120.0),
        ):
            with closing(HttpConnection(port)) as client:
                await wait_until_ready(client)
                plan = await _plan(client, duration_s)
                run_id = (await client.ask("POST", f"{_API}/runs", plan))["run_id"]
            run = f"{_API}/runs/{run_id}"
            seen = await _bear(port, run, subscribers, requests_per_s)
            with closing(HttpConnection(port)) as client:
                ended, rig = await client.ask("GET", run), await client.ask("GET", f"{_API}/rig")
    return completed(ended), rig, seen


async def _bear(port: int, run: str, subscribers: int, requests_per_s: float) -> _Seen:
    """Subscribe and watch, and ask from the moment when all have subscribed until the run ends."""
    seen = _Seen([], [[] for _ in range(subscribers)], [0] * _WATCHERS)
    async with asyncio.TaskGroup() as group:
        come = asyncio.Semaphore(0)
        listening = [
            group.create_task(listen_to_run(port, run, come, each)) for each in seen.numbers
        ]
        others = [group.create_task(watch_rig(port, seen.looks, n)) for n in range(_WATCHERS)]
        for _ in listening:
            await come.acquire()
        others.append(group.create_task(_ask(port, run, requests_per_s, seen.latency_s)))
        await asyncio.wait(listening)
        for task in others:
            task.cancel()
    return seen


async def wait_until_ready(client: HttpConnection) -> None:
    """Wait until the rig is open.

    Raises:
        RuntimeError: It is not, half a minute later.
    """
    deadline_s = time.monotonic() + _READY_S
    while (rig := await client.ask("GET", f"{_API}/rig"))["state"] != "ready":
        if time.monotonic() > deadline_s:
            msg = f"the rig is {rig['state']} after {_READY_S:g} s: {rig['detail']}"
            raise RuntimeError(msg)
        await asyncio.sleep(0.1)


async def run_to_its_end(
    client: HttpConnection, plan: JsonObject, within_s: float = 60.0
) -> JsonObject:
    """Carry out a plan and return the run.

    Raises:
        RuntimeError: It did not complete.
    """
    run = f"{_API}/runs/{(await client.ask('POST', f'{_API}/runs', plan))['run_id']}"
    async with asyncio.timeout(within_s):
        async for _ in client.follow(f"{run}/events"):
            pass
    return completed(await client.ask("GET", run))


def completed(run: JsonObject) -> JsonObject:
    """Return a run that is completed.

    Raises:
        RuntimeError: It is not; its reason.
    """
    if run["state"] != "completed":
        msg = f"the run is {run['state']}: {run['error']}"
        raise RuntimeError(msg)
    return run


async def _plan(client: HttpConnection, duration_s: float) -> JsonObject:
    """Return a plan that takes at least this long, with an event or more each second."""
    positions = 12 if duration_s > 30.0 else 4
    plan: JsonObject = {"kind": "north-seek", "positions": positions, "dwell_s": 0.2}
    shortest_s = (await client.ask("POST", f"{_API}/plans", plan))["duration_s"]
    return {**plan, "dwell_s": 0.2 + max(0.0, duration_s - shortest_s) / positions}


async def listen_to_run(port: int, run: str, come: asyncio.Semaphore, numbers: list[int]) -> None:
    """Note the numbers of a run's events; say when the first has come."""
    with closing(HttpConnection(port)) as connection:
        async for number in connection.follow(f"{run}/events"):
            if not numbers:
                come.release()
            numbers.append(number or 0)


async def watch_rig(port: int, looks: list[int], which: int) -> None:
    """Count how often the rig is seen, in its place among those of all watchers."""
    with closing(HttpConnection(port)) as connection:
        async for _ in connection.follow(f"{_API}/rig/events"):
            looks[which] += 1


async def _ask(port: int, run: str, requests_per_s: float, latency_s: list[float]) -> None:
    """Ask at a steady rate, whether or not the answers before have come."""
    connections = [HttpConnection(port) for _ in range(_CONNECTIONS)]
    paths = itertools.cycle([f"{_API}/rig", f"{_API}/runs", run, f"{run}/visits"])
    begun_s = time.perf_counter()
    async with AsyncExitStack() as stack, asyncio.TaskGroup() as group:
        for connection in connections:
            stack.callback(connection.close)
        for number, path, connection in zip(itertools.count(), paths, itertools.cycle(connections)):
            due_s = begun_s + number / requests_per_s
            await asyncio.sleep(due_s - time.perf_counter())
            group.create_task(_time(connection, path, due_s, latency_s))


async def _time(
    connection: HttpConnection, path: str, due_s: float, latency_s: list[float]
) -> None:
    await connection.ask("GET", path)
    latency_s.append(time.perf_counter() - due_s)


def lost_in(run: JsonObject) -> int:
    """Return how many samples a run's visits lack."""
    return sum(visit["lost"] for visit in run["result"]["visits"])


def lost_by(rig: JsonObject) -> int:
    """Return how many samples did not come whole, by the devices' counters."""
    counters = [device["counters"] for device in rig["devices"]]
    return sum(each["lost"] + each["crc_errors"] for each in counters)


def missed_events(run: JsonObject, seen: list[list[int]]) -> int:
    """Return how many events the subscribers did not see, or not once and in their order."""
    whole = list(range(1, run["last_seq"] + 1))
    return sum(
        max(len(whole), len(numbers)) - _common_beginning(whole, numbers) for numbers in seen
    )


def _common_beginning(whole: list[int], seen: list[int]) -> int:
    pairs = enumerate(zip(whole, seen, strict=False))
    return next((at for at, (a, b) in pairs if a != b), min(len(whole), len(seen)))
