"""A list and a run come as fast from ten thousand runs as from a hundred."""

import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from sqlalchemy import insert

from northfinder.records import Records
from northfinder.records.entries import VisitStatistics
from northfinder.records.tables import RunRow, VisitRow
from tests.records.examples import visit

#: As large as what a north-seek of 48 visits stores: a result of 20 kB.
RESULT = {"azimuth_deg": 48.0, "visits": [{"index": 1, "text": "x" * 400}] * 48}
HEADLINE = {"azimuth_deg": 48.0, "azimuth_sigma_deg": 0.04, "attention": ["tilt"]}
FIRST_UTC = datetime(2026, 1, 1, tzinfo=UTC)
VISIT_COLUMNS = VisitStatistics.__slots__


def add_runs(records: Records, count: int) -> None:
    """Add completed runs, each with two visits, a minute apart."""
    visits = [{name: getattr(visit(index), name) for name in VISIT_COLUMNS} for index in (0, 1)]
    with records._transaction() as session:
        for start in range(0, count, 500):
            runs = [run_row(number) for number in range(start, start + 500)]
            session.execute(insert(RunRow), runs)
            session.execute(
                insert(VisitRow), [{"run_id": run["id"], **row} for run in runs for row in visits]
            )


def run_row(number: int) -> dict[str, object]:
    created_utc = FIRST_UTC + timedelta(minutes=number)
    return {
        "id": f"{created_utc:%Y%m%dT%H%M%SZ}-{number:06x}",
        "kind": "noise" if number % 2 == 0 else "north-seek",
        "rig_name": f"Lab {number % 3}",
        "state": "failed" if number % 5 == 0 else "completed",
        "created_utc": created_utc,
        "started_utc": created_utc,
        "finished_utc": created_utc,
        "plan": {"positions": 24, "dwell_s": 5.0},
        "prediction": {"schedule": "y" * 4000},
        "site": {"latitude_deg": 40.0},
        "rig": {"config": "z" * 2000},
        "simulation": None,
        "software": {"version": "0.1.0"},
        "result": RESULT,
        "headline": HEADLINE,
        "progress": 1.0,
        "last_seq": 0,
    }


def durations_s(call: Callable[[], object], repeats: int) -> list[float]:
    durations = []
    for _ in range(repeats):
        began_s = time.perf_counter()
        call()
        durations.append(time.perf_counter() - began_s)
    return durations


def calls(records: Records) -> dict[str, Callable[[], object]]:
    middle = records.page(250).runs[-1].id
    return {
        "newest": lambda: records.page(50),
        "from the middle": lambda: records.page(50, middle),
        "by state": lambda: records.page(50, state="failed"),
        "by a state that none has": lambda: records.page(50, state="paused"),
        "by rig and kind": lambda: records.page(50, rig_name="Lab 2", kind="noise"),
        "one run": lambda: records.run(middle),
        "its visits": lambda: records.visits(middle),
    }


@pytest.mark.alone
def test_a_list_is_as_fast_from_many_runs_as_from_few(records: Records) -> None:
    add_runs(records, 500)  # of each sort more than a page
    few = {name: min(durations_s(call, 20)) for name, call in calls(records).items()}
    with records._transaction() as session:
        session.query(VisitRow).delete()
        session.query(RunRow).delete()
    add_runs(records, 5_000)
    many = {name: min(durations_s(call, 20)) for name, call in calls(records).items()}
    slower = {name: many[name] / limit_s for name, limit_s in few.items()}
    assert max(slower.values()) < 4.0, slower


@pytest.mark.alone
@pytest.mark.proof
def test_a_list_of_ten_thousand_runs_takes_less_than_30_ms(records: Records) -> None:
    add_runs(records, 10_000)
    for name, call in calls(records).items():
        p99_ms = 1e3 * float(np.percentile(durations_s(call, 500), 99))
        print(f"{records._engine.dialect.name}, {name}: p99 {p99_ms:.1f} ms")  # noqa: T201 -- for the proof
        assert p99_ms < 30.0, name
