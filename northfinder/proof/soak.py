"""Hours of a technician's work on one service: does it lose anything, does its memory grow?

``python -m northfinder.proof.soak --minutes 30``, or ``make soak``. KVH at 1 kHz and STIM300 at
500 Hz on pseudo-terminals, a CiA 402 table behind a CAN adapter on a third, the service, runs one
after another that twenty people watch, and after each the certificate, figures and exports.
"""

import argparse
import asyncio
import itertools
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import psutil

from northfinder.proof.document_evidence import write_figures
from northfinder.proof.figure import Figure
from northfinder.proof.http_client import HttpConnection, JsonObject
from northfinder.proof.processes import MIXED, Served, service_of, simulated_instruments
from northfinder.proof.service_load import (
    completed,
    listen_to_run,
    lost_by,
    lost_in,
    missed_events,
    wait_until_ready,
    watch_rig,
)

_API = "/api/v1"
_WATCHERS = 2
_READERS = 4  # at the same time, so that the first minute sees as many threads as all others
_SAMPLED_S: Final = 0.25
_RUN_S = 120.0  # none takes as long
_PAGES = ("report.html", "figures/fit.svg", "samples?format=csv", "samples?format=parquet")


@dataclass(slots=True)
class Account:
    """What has been seen so far.

    Attributes:
        runs: Completed.
        lost: Samples.
        missed: Events, by all subscribers together.
        events: That each subscriber should have seen.
        longest_pause_s: By which this process woke too late: what the machine did to the others.
        counters: Of each device, at the end.
        at_s: When the memory was looked at.
        rss_bytes: The service's resident memory then.
    """

    runs: int = 0
    lost: int = 0
    missed: int = 0
    events: int = 0
    longest_pause_s: float = 0.0
    counters: JsonObject = field(default_factory=dict)
    at_s: list[float] = field(default_factory=list)
    rss_bytes: list[int] = field(default_factory=list)

    def add(self, run: JsonObject, seen: list[list[int]]) -> None:
        """Enter a completed run, and what each subscriber saw of it."""
        self.runs += 1
        self.lost += lost_in(run)
        self.missed += missed_events(run, seen)
        self.events += run["last_seq"]


def soak(duration_s: float, settled_s: float = 60.0, subscribers: int = 20) -> Iterator[Figure]:
    """Run one after another for at least that long, in wall time.

    Args:
        duration_s: Without the start.
        settled_s: From when on the memory may not grow any more.
        subscribers: Of each run; besides, two of the rig.
    """
    account = asyncio.run(_soak(duration_s, subscribers))
    name = f"soak of {duration_s / 60:g} min, {account.runs} runs, {subscribers} subscribers"
    counted = ", ".join(f"{role} {counters}" for role, counters in account.counters.items())
    counted += f"; longest pause of this computer {account.longest_pause_s:.2f} s"
    yield Figure(f"{name}: samples lost", float(account.lost), "samples", None, 0.0, counted)
    yield Figure(f"{name}: events missed", float(account.missed), "events", None, 0.0)
    growth, detail = growth_of(account, settled_s)
    yield Figure(f"{name}: memory growth", growth, "%", None, 2.0, detail)


async def _soak(duration_s: float, subscribers: int) -> Account:
    account = Account()
    with tempfile.TemporaryDirectory() as folder:
        async with (
            simulated_instruments(Path(folder), MIXED) as links,
            service_of(links, Path(folder), MIXED) as served,
        ):
            with closing(HttpConnection(served.port)) as client:
                await wait_until_ready(client)
            await _work(served, duration_s, subscribers, account)
            with closing(HttpConnection(served.port)) as client:
                rig = await client.ask("GET", f"{_API}/rig")
            account.lost += lost_by(rig)
            account.counters = {each["role"]: each["counters"] for each in rig["devices"]}
    return account


async def _work(served: Served, duration_s: float, subscribers: int, account: Account) -> None:
    """Begin runs until the time is over, watched and weighed."""
    looks, begun_s = [0] * _WATCHERS, time.monotonic()
    async with asyncio.TaskGroup() as group:
        beside = [group.create_task(watch_rig(served.port, looks, n)) for n in range(_WATCHERS)]
        beside.append(group.create_task(_weigh(served, account)))
        for plan in itertools.cycle(_plans()):
            await _one_run(served.port, plan, subscribers, account)
            if time.monotonic() - begun_s > duration_s:
                break
        for task in beside:
            task.cancel()


def _plans() -> Sequence[JsonObject]:
    """Return short runs of two kinds, with a few events a second."""
    seek: JsonObject = {"kind": "north-seek", "positions": 4, "dwell_s": 0.4, "settle_s": 0.1}
    return (seek, seek | {"positions": 6}, seek | {"order": "sequential"})


async def _one_run(port: int, plan: JsonObject, subscribers: int, account: Account) -> None:
    """Carry a plan out under the subscribers' eyes, and fetch what a technician would."""
    with closing(HttpConnection(port)) as client:
        run = f"{_API}/runs/{(await client.ask('POST', f'{_API}/runs', plan))['run_id']}"
    seen: list[list[int]] = [[] for _ in range(subscribers)]
    come = asyncio.Semaphore(0)
    async with asyncio.timeout(_RUN_S), asyncio.TaskGroup() as group:
        for numbers in seen:
            group.create_task(listen_to_run(port, run, come, numbers))
    # Anew: the service closes a connection on which nothing was asked for some seconds.
    with closing(HttpConnection(port)) as client:
        account.add(completed(await client.ask("GET", run)), seen)
        for path in (f"{_API}/runs", f"{_API}/rig", f"{run}/visits"):
            await client.ask("GET", path)
    await asyncio.gather(*(_read(port, run) for _ in range(_READERS)))


async def _read(port: int, run: str) -> None:
    """Fetch what a technician keeps of a run."""
    with closing(HttpConnection(port)) as client:
        for page in _PAGES:
            await client.size_of(f"{run}/{page}")


async def _weigh(served: Served, account: Account) -> None:
    """Note the service's memory, for ever."""
    process, begun_s = psutil.Process(served.pid), time.monotonic()
    while True:
        account.at_s.append(time.monotonic() - begun_s)
        account.rss_bytes.append(process.memory_info().rss)
        slept_s = -time.monotonic()
        await asyncio.sleep(_SAMPLED_S)
        slept_s += time.monotonic()
        account.longest_pause_s = max(account.longest_pause_s, slept_s - _SAMPLED_S)


def growth_of(account: Account, settled_s: float) -> tuple[float, str]:
    """Return by how many per cent the memory has grown since it settled, and the story of it.

    What is compared are the means of the first and the last tenth, a minute at most: a run's
    arrays come and go.
    """
    at_s, rss_mb = np.array(account.at_s), np.array(account.rss_bytes) / 1e6
    settled = at_s >= settled_s
    if settled.sum() < 10:
        msg = f"the soak ended {at_s[-1]:.0f} s after it began, before {settled_s:g} s had settled"
        raise RuntimeError(msg)
    at_s, rss_mb = at_s[settled], rss_mb[settled]
    span_s = min(60.0, 0.1 * (at_s[-1] - at_s[0]))
    first = float(rss_mb[at_s <= at_s[0] + span_s].mean())
    last = float(rss_mb[at_s >= at_s[-1] - span_s].mean())
    slope_kb_min = 60e3 * float(np.polyfit(at_s, rss_mb, 1)[0])
    story = f"{first:.1f} MB after {settled_s:g} s, {last:.1f} at the end"
    return 100.0 * (last / first - 1.0), f"{story}, {slope_kb_min:+.0f} kB/min"


def main() -> None:
    """Soak for so many minutes; exits with 1 where a promise is not kept."""
    parser = argparse.ArgumentParser(prog="python -m northfinder.proof.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0, help="wall time, at least 2")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there too")
    asked = parser.parse_args()
    minutes: float = asked.minutes
    if not minutes >= 2.0:
        parser.error(f"{minutes:g} minutes are too short: the memory settles for one of them")
    try:
        figures = list(soak(60.0 * minutes))
    except* (RuntimeError, TimeoutError, OSError) as ended:
        sys.exit(f"the soak has ended early: {_first(ended)}")
    if asked.json:
        write_figures(asked.json, {"soak": figures})
    for figure in figures:
        verdict = "met" if figure.met else "NOT MET"
        line = f"{figure.name}: {figure.value:,.4g} {figure.unit}, {figure.required}: {verdict}"
        sys.stdout.write(f"{line}  {figure.limit}\n")
    sys.exit(not all(figure.met for figure in figures))


def _first(group: BaseExceptionGroup[Exception]) -> Exception:
    first = group.exceptions[0]
    return _first(first) if isinstance(first, BaseExceptionGroup) else first


if __name__ == "__main__":
    main()
