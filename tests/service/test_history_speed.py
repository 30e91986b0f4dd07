"""The history and a run from it come at once, however many runs there are."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import Table, insert, select

from northfinder.records import Records
from northfinder.records.tables import RunRow
from tests.evidence import Record
from tests.service.process import ServiceProcess, serving, wait_until_ready

PLAN = {"kind": "north-seek", "positions": 24, "dwell_s": 1, "settle_s": 0.1}
BATCH = 500
ALLOWED_MS = 30.0


def add_copies(url: str, run_id: str, count: int) -> list[str]:
    """Store copies of a run, each a minute older than the one before; return their ids."""
    table = RunRow.__table__
    assert isinstance(table, Table)
    with Records.open(url) as records, records._engine.begin() as connection:
        row = dict(connection.execute(select(table)).mappings().one())
        created_utc = row["created_utc"]
        ids = []
        for start in range(0, count, BATCH):
            copies = []
            for number in range(start, start + BATCH):
                then_utc = created_utc - timedelta(minutes=1 + number)
                ids.append(f"{then_utc:%Y%m%dT%H%M%SZ}-{number:06x}")
                copies.append({**row, "id": ids[-1], "created_utc": then_utc})
            connection.execute(insert(table), copies)
    assert run_id == row["id"]
    return ids


@contextmanager
def service_with(folder: Path, url: str, runs: int) -> Iterator[tuple[ServiceProcess, list[str]]]:
    """Serve a history of copies of a run that was really measured."""
    with serving(folder, "--sim-speed", "20", database=url) as service:
        wait_until_ready(service)
        run_id = service.start(PLAN)
        assert len(service.wait(run_id, "completed")["result"]["visits"]) == 48
        yield service, add_copies(url, run_id, runs)


def latencies_ms(service: ServiceProcess, paths: list[str], count: int) -> list[float]:
    taken_ms = []
    for path in islice(cycle(paths), count):
        begun_s = time.perf_counter()
        answer = service.api.get(path)
        taken_ms.append(1e3 * (time.perf_counter() - begun_s))
        assert answer.status_code == 200
    return taken_ms


def requests(ids: list[str]) -> dict[str, list[str]]:
    spread = ids[:: max(1, len(ids) // 100)]
    pages = ["/runs", *(f"/runs?cursor={run_id}" for run_id in spread), "/runs?state=completed"]
    return {"GET /runs": pages, "GET /runs/{id}": [f"/runs/{run_id}" for run_id in spread]}


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'records.db'}"
    url: str = request.getfixturevalue("postgresql_url")
    return url


@pytest.mark.alone
def test_the_history_of_a_thousand_runs_comes_at_once(tmp_path: Path, url: str) -> None:
    """The median, for one in a hundred says more of this machine's other work."""
    with service_with(tmp_path, url, 1000) as (service, ids):
        for name, paths in requests(ids).items():
            assert np.median(latencies_ms(service, paths, 100)) < ALLOWED_MS, name


@pytest.mark.alone
@pytest.mark.proof
@pytest.mark.timeout(600)
def test_the_history_of_ten_thousand_runs_comes_within_30_ms(
    tmp_path: Path, url: str, record_property: Record
) -> None:
    with service_with(tmp_path, url, 10_000) as (service, ids):
        for name, paths in requests(ids).items():
            p50_ms, p99_ms = np.percentile(latencies_ms(service, paths, 1000), [50, 99])
            kind = url.partition(":")[0]
            told = f"{kind}, {name}: median {p50_ms:.1f} ms, 99 of 100 within {p99_ms:.1f} ms"
            record_property("measured", told)
            assert p99_ms < ALLOWED_MS, name
