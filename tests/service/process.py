"""The service as a process of its own, as `northfinder serve` starts it, and clients of it."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import httpx

from northfinder.records import Records
from northfinder.records.states import ENDED

JsonObject = dict[str, Any]

SHORT: JsonObject = {"kind": "north-seek", "positions": 4, "dwell_s": 0.2, "settle_s": 0.1}
LONG: JsonObject = {"kind": "north-seek", "positions": 24, "dwell_s": 5}
_PATIENCE_S = 30.0


@dataclass(slots=True)
class Event:
    """One server-sent event."""

    id: int | None
    event: str
    data: JsonObject


class ServiceProcess:
    """A running service; ``api`` is a client of its REST interface."""

    def __init__(self, process: "subprocess.Popen[str]", address: str, log: Path) -> None:
        self.process = process
        self.address = address
        self.log = log
        self.api = httpx.Client(base_url=f"{address}/api/v1", timeout=20.0)

    def start(self, body: JsonObject | None = None) -> str:
        """Start a run and return its id."""
        answer = self.api.post("/runs", json=SHORT if body is None else body)
        assert answer.status_code == 202, answer.text
        run_id: str = answer.json()["run_id"]
        return run_id

    def run(self, run_id: str) -> JsonObject:
        """Return a run."""
        answer = self.api.get(f"/runs/{run_id}")
        assert answer.status_code == 200, answer.text
        run: JsonObject = answer.json()
        return run

    def wait(self, run_id: str, *states: str) -> JsonObject:
        """Wait until a run is in one of these states, by default any that ends it."""
        wanted = states or tuple(ENDED)
        end_s = time.monotonic() + _PATIENCE_S
        while (run := self.run(run_id))["state"] not in wanted:
            assert time.monotonic() < end_s, f"still {run['state']}: {self.log.read_text()}"
            time.sleep(0.02)
        return run

    def wait_for_visits(self, run_id: str, count: int) -> None:
        """Wait until so many visits are complete."""
        with closing(self.events(run_id, "visit")) as visits:
            seen = list(islice(visits, count))
        assert len(seen) == count, f"the run ended before: {self.run(run_id)}"

    def wait_for_log(self, text: str) -> None:
        """Wait until the log says so: what the records cannot tell while they are away."""
        end_s = time.monotonic() + _PATIENCE_S
        while text not in self.log.read_text():
            assert time.monotonic() < end_s, self.log.read_text()
            time.sleep(0.05)

    def events(
        self, run_id: str, *names: str, after: int | None = None
    ) -> Generator[Event, None, None]:
        """Follow a run's events, all or those of some names, until the stream ends."""
        headers = {} if after is None else {"Last-Event-ID": str(after)}
        with self.api.stream("GET", f"/runs/{run_id}/events", headers=headers) as stream:
            assert stream.status_code == 200, stream.read()
            for event in events_of(stream):
                if not names or event.event in names:
                    yield event

    def kill(self) -> None:
        """End the process as a power cut would."""
        self.process.kill()
        self.process.wait(10.0)

    def end(self, how: signal.Signals = signal.SIGTERM) -> float:
        """End the process; return how long that took."""
        begun_s = time.monotonic()
        self.process.send_signal(how)
        self.process.wait(10.0)
        return time.monotonic() - begun_s


def events_of(stream: httpx.Response) -> Iterator[Event]:
    """Parse a stream of server-sent events (HTML standard, section 9.2.6)."""
    fields: dict[str, str] = {}
    for line in stream.iter_lines():
        if not line:
            if "data" in fields:
                number = int(fields["id"]) if "id" in fields else None
                yield Event(number, fields["event"], json.loads(fields["data"]))
            fields = {}
        elif not line.startswith(":"):
            name, _, value = line.partition(":")
            fields[name] = value.removeprefix(" ")


@contextmanager
def serving(
    folder: Path, *options: str, database: str | None = None, **environment: str
) -> Iterator[ServiceProcess]:
    """Serve the simulated rig as fast as this machine can until the context ends.

    Its log must not hold a traceback, whatever was done to it.
    """
    url = database or f"sqlite:///{folder / 'records.db'}"
    log = folder / f"service-{time.monotonic_ns()}.log"
    command = [sys.executable, "-m", "northfinder", "serve", "--port", "0", "--database", url]
    if "--sim-speed" not in options and "--config" not in options:
        options = (*options, "--sim-speed", "100")
    with (
        log.open("w") as stderr,
        subprocess.Popen(
            [*command, *options],
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            env={**os.environ, **environment},
        ) as process,
    ):
        assert process.stdout is not None
        told = process.stdout.readline()
        assert told, log.read_text()
        service = ServiceProcess(process, told.split()[-1], log)
        try:
            yield service
        finally:
            service.api.close()
            if process.poll() is None:
                service.end()
    assert "Traceback" not in log.read_text(), log.read_text()


def wait_until_ready(service: ServiceProcess) -> None:
    """Wait until the rig is open."""
    end_s = time.monotonic() + _PATIENCE_S
    while httpx.get(f"{service.address}/readyz").status_code != 200:
        assert time.monotonic() < end_s, service.log.read_text()
        time.sleep(0.02)


def stored(folder: Path) -> Records:
    """Open the records that a service in this folder writes."""
    return Records.open(f"sqlite:///{folder / 'records.db'}")
