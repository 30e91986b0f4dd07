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
FULL_PAGES = 150  # of 200 runs: a page has 50


def add_copies(url: str, run_id: str, numbers: range) -> list[str]:
    """Store copies of a run, each a minute older than the one before; return their ids."""
    table = RunRow.__table__
    assert isinstance(table, Table)
    with Records.open(url) as records, records._engine.begin() as connection:
        row = dict(connection.execute(select(table).where(RunRow.id == run_id)).mappings().one())
        created_utc = row["created_utc"]
        ids = []
        for start in range(0, len(numbers), BATCH):
            copies = []
            for number in numbers[start : start + BATCH]:
                then_utc = created_utc - timedelta(minutes=1 + number)
                ids.append(f"{then_utc:%Y%m%dT%H%M%SZ}-{number:06x}")
                copies.append({**row, "id": ids[-1], "created_utc": then_utc})
            connection.execute(insert(table), copies)
    return ids


@contextmanager
def service_with_a_run(folder: Path, url: str) -> Iterator[tuple[ServiceProcess, str]]:
    """Serve a run that was really measured."""
    with serving(folder, "--sim-speed", "20", database=url) as service:
        wait_until_ready(service)
        run_id = service.start(PLAN)
        assert len(service.wait(run_id, "completed")["result"]["visits"]) == 48
        yield service, run_id


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


def medians_ms(service: ServiceProcess, ids: list[str]) -> dict[str, float]:
    found = requests(ids).items()
    return {name: float(np.median(latencies_ms(service, paths, 100))) for name, paths in found}


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'records.db'}"
    url: str = request.getfixturevalue("postgresql_url")
    return url


@pytest.mark.alone
def test_the_history_of_two_thousand_runs_comes_as_fast_as_that_of_two_hundred(
    tmp_path: Path, url: str
) -> None:
    """By medians, for one in a hundred says more of this machine's other work."""
    with service_with_a_run(tmp_path, url) as (service, run_id):
        ids = add_copies(url, run_id, range(200))
        few_ms = medians_ms(service, ids[:FULL_PAGES])
        ids += add_copies(url, run_id, range(200, 2000))
        many_ms = medians_ms(service, ids)
    slower = {name: many_ms[name] / few_ms[name] for name in many_ms}
    assert max(slower.values()) < 3.0, slower  # ten where every run is looked at


@pytest.mark.alone
@pytest.mark.proof
@pytest.mark.timeout(600)
def test_the_history_of_ten_thousand_runs_comes_within_30_ms(
    tmp_path: Path, url: str, record_property: Record
) -> None:
    with service_with_a_run(tmp_path, url) as (service, run_id):
        ids = add_copies(url, run_id, range(10_000))
        for name, paths in requests(ids).items():
            p50_ms, p99_ms = np.percentile(latencies_ms(service, paths, 1000), [50, 99])
            kind = url.partition(":")[0]
            told = f"{kind}, {name}: median {p50_ms:.1f} ms, 99 of 100 within {p99_ms:.1f} ms"
            record_property("measured", told)
            assert p99_ms < ALLOWED_MS, name
