"""A database that is locked, read-only or gone: the table stands, the page says so, it recovers."""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from pathlib import Path
from typing import NamedTuple

import httpx
import pytest

from tests.postgresql import PostgresqlServer
from tests.service.process import LONG, SHORT, JsonObject, ServiceProcess, serving, wait_until_ready

pytestmark = pytest.mark.slow
PATIENCE_S = 20.0  # a busy database is waited for 5 s, call after call


class Case(NamedTuple):
    """One trouble with one database.

    Attributes:
        url: The database.
        trouble: Lasts as long as its context.
        says: What the sentence about it says.
        readable: Whether the history can be read meanwhile.
    """

    url: str
    trouble: Callable[[], AbstractContextManager[None]]
    says: str
    readable: bool


def locked(tmp_path: Path) -> Case:
    @contextmanager
    def trouble() -> Iterator[None]:
        with closing(sqlite3.connect(tmp_path / "bench" / "records.db")) as other:
            other.execute("BEGIN EXCLUSIVE")
            yield

    return Case(sqlite_url(tmp_path), trouble, "database is locked", readable=True)


def moved_away(tmp_path: Path) -> Case:
    @contextmanager
    def trouble() -> Iterator[None]:
        (tmp_path / "bench").rename(tmp_path / "away")
        yield
        (tmp_path / "away").rename(tmp_path / "bench")

    return Case(sqlite_url(tmp_path), trouble, "unable to open", readable=False)


def sqlite_url(tmp_path: Path) -> str:
    (tmp_path / "bench").mkdir()
    return f"sqlite:///{tmp_path / 'bench' / 'records.db'}"


def switched_off(server: PostgresqlServer, url: str) -> Case:
    @contextmanager
    def trouble() -> Iterator[None]:
        server.stop()
        try:
            yield
        finally:
            server.start()

    return Case(url, trouble, "the database server", readable=False)


def read_only(server: PostgresqlServer, url: str) -> Case:
    return Case(url, server.read_only, "read-only transaction", readable=True)


IN_FILE = {"locked": locked, "moved_away": moved_away}
ON_SERVER = {"switched_off": switched_off, "read_only": read_only}


@pytest.fixture(params=[*IN_FILE, *ON_SERVER])
def case(request: pytest.FixtureRequest, tmp_path: Path) -> Case:
    if request.param in IN_FILE:
        return IN_FILE[request.param](tmp_path)
    server: PostgresqlServer = request.getfixturevalue("postgresql_server")
    return ON_SERVER[request.param](server, request.getfixturevalue("postgresql_url"))


def until(condition: Callable[[], bool], service: ServiceProcess) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, f"{rig(service)}\n{service.log.read_text()}"
        time.sleep(0.05)


def rig(service: ServiceProcess) -> JsonObject:
    answer = service.api.get("/rig")
    assert answer.status_code == 200, answer.text
    told: JsonObject = answer.json()
    return told


def ready(service: ServiceProcess) -> httpx.Response:
    return httpx.get(f"{service.address}/readyz", timeout=20.0)


def stands(service: ServiceProcess) -> bool:
    """Say whether the table does not move for as long as several visits take."""
    angles_deg = set()
    for _ in range(10):
        angles_deg.add(rig(service)["table"]["angle_deg"])
        time.sleep(0.1)
    return len(angles_deg) == 1 and not rig(service)["table"]["moving"]


def assert_told(service: ServiceProcess, case: Case) -> None:
    """The trouble is told wherever somebody looks, in words, and nothing is a defect."""
    until(lambda: not rig(service)["database"]["ok"], service)
    assert case.says in rig(service)["database"]["detail"]
    answer = ready(service)
    assert (answer.status_code, answer.json()["type"]) == (503, "/problems/records-unavailable")
    assert case.says in answer.json()["detail"]
    history = service.api.get("/runs")
    if case.readable:
        assert history.status_code == 200
    else:
        assert (history.status_code, history.json()["type"]) == (
            503,
            "/problems/records-unavailable",
        )
        assert history.headers["content-type"] == "application/problem+json"


def assert_well(service: ServiceProcess) -> None:
    """Without anybody's help: ready, nothing to tell, and a new run brings north."""
    until(lambda: ready(service).status_code == 200, service)
    assert rig(service)["database"] == {"ok": True, "detail": None}
    assert service.wait(service.start(SHORT))["state"] == "completed"


def test_an_idle_service_says_so_refuses_runs_and_recovers(tmp_path: Path, case: Case) -> None:
    with serving(tmp_path, "--sim-speed", "20", database=case.url) as service:
        wait_until_ready(service)
        with case.trouble():
            assert_told(service, case)
            refused = service.api.post("/runs", json=SHORT)
            assert (refused.status_code, refused.json()["type"]) == (
                503,
                "/problems/records-unavailable",
            )
            assert rig(service)["run_id"] is None
        assert_well(service)


def test_a_run_fails_safe_loses_no_visit_and_can_be_resumed(tmp_path: Path, case: Case) -> None:
    with serving(tmp_path, "--sim-speed", "20", database=case.url) as service:
        wait_until_ready(service)
        run_id = service.start(LONG)
        service.wait_for_visits(run_id, 2)
        before = service.api.get(f"/runs/{run_id}/visits").json()["visits"]
        with case.trouble():
            assert_told(service, case)
            until(lambda: stands(service), service)
            assert rig(service)["run_id"] == run_id  # busy until its end is in the records
        run = service.wait(run_id)
        assert (run["state"], run["steps"]) == ("failed", ["resume", "abort"])
        assert case.says in run["error"]
        after = service.api.get(f"/runs/{run_id}/visits").json()["visits"]
        assert after[: len(before)] == before
        assert len(after) > len(before), "what was measured meanwhile is not in the records"
        assert_well(service)
        assert service.api.post(f"/runs/{run_id}/resume").status_code == 202
        run = service.wait(run_id)
        assert run["state"] == "completed", run["error"]
        seqs = [event.id for event in service.events(run_id)]
        assert seqs == list(range(1, run["last_seq"] + 1))
