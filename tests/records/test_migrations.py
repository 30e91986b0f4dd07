"""The way of the schema: from nothing, from an older northfinder's file, by several at once."""

import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import text

from northfinder.records import Records
from northfinder.records.database import make_engine
from northfinder.records.samples import encode_samples
from northfinder.records.schema import CURRENT_REVISION, VERSION_TABLE, alembic_config
from northfinder.records.tables import Base
from tests.postgresql import PostgresqlServer
from tests.records.examples import samples, visit

RESULT = {
    "azimuth_deg": 48.02,
    "azimuth_sigma_deg": 0.0385,
    "checks": [{"name": "residuals", "status": "pass"}, {"name": "tilt", "status": "warn"}],
    "visits": [{"index": 0}],
}
FIRST_RUN = """
    INSERT INTO runs (id, kind, rig_name, state, created_utc, started_utc, finished_utc,
                      plan, site, rig, simulation, software, result, error)
    VALUES (:id, 'north-seek', 'Lab 3', :state, '2026-10-01 10:00:00.000000',
            '2026-10-01 10:00:01.000000', :finished, '{"positions": 24}', '{}', '{}', NULL,
            '{"version": "0.1.0"}', :result, NULL)
"""
FIRST_VISIT = """
    INSERT INTO visits VALUES (:run_id, 0, 0, 'out', 0, 0.1, 0.1, 0, 0.1, 4, 1, 0, NULL)
"""
FIRST_SAMPLES = "INSERT INTO samples VALUES (:run_id, 0, 'gyro', :blob, :sha256)"


@pytest.fixture(params=["sqlite", "postgresql"])
def empty_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """A database without tables."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'new.db'}"
        return
    server: PostgresqlServer = request.getfixturevalue("postgresql_server")
    url = server.empty_database()
    yield url
    server.drop(url)


def make_first_revision(url: str) -> None:
    """As the first northfinder left it: a completed run with a visit, and one that was cut off."""
    engine = make_engine(url)
    with engine.begin() as connection:
        command.upgrade(alembic_config(connection), "0001")
        for run_id, state, finished, result in (
            ("20261001T100000Z-aaaaaa", "completed", "2026-10-01 10:03:00.000000", RESULT),
            ("20261001T100000Z-bbbbbb", "running", None, None),
        ):
            values = {"id": run_id, "state": state, "finished": finished}
            row = values | {"result": result and json.dumps(result)}
            connection.execute(text(FIRST_RUN), row)
        blob = encode_samples(samples(0)["gyro"])
        run_id = "20261001T100000Z-aaaaaa"
        connection.execute(text(FIRST_VISIT), {"run_id": run_id})
        sample_values = {"run_id": run_id, "blob": blob, "sha256": "0" * 64}
        connection.execute(text(FIRST_SAMPLES), sample_values)
    engine.dispose()


def test_the_migrations_arrive_at_the_tables_as_declared(url: str) -> None:
    engine = make_engine(url)
    with engine.connect() as connection:
        options = {"version_table": VERSION_TABLE, "compare_type": True}
        context = MigrationContext.configure(connection, opts=options)
        assert compare_metadata(context, Base.metadata) == []
        assert context.get_current_revision() == CURRENT_REVISION
        script = ScriptDirectory.from_config(alembic_config(connection))
        assert script.get_heads() == [CURRENT_REVISION]
    engine.dispose()


def test_runs_of_an_older_northfinder_are_kept(empty_url: str) -> None:
    make_first_revision(empty_url)
    with Records.open(empty_url) as records:
        cut_off, done = records.page(10).runs
        assert (done.state, done.progress, done.last_seq) == ("completed", 1.0, 1)
        assert done.headline == {
            "azimuth_deg": 48.02,
            "azimuth_sigma_deg": 0.0385,
            "checks": {"pass": 1, "warn": 1, "fail": 0},
            "attention": ["tilt"],
        }
        assert records.run(done.id).result == RESULT
        assert records.visits(done.id)[0].repeats is None
        (event,) = records.events(done.id)
        assert (event.seq, event.event, event.data) == (1, "state", {"state": "completed"})
        assert event.time_utc == datetime(2026, 10, 1, 10, 3, tzinfo=UTC)
        assert (cut_off.state, cut_off.progress, cut_off.headline) == ("running", 0.0, None)


def test_an_older_northfinders_run_without_a_lease_is_interrupted_and_can_be_resumed(
    empty_url: str,
) -> None:
    make_first_revision(empty_url)
    with Records.open(empty_url) as records:
        (event,) = records.interrupt_abandoned("Lab 3")
        assert (event.seq, event.data["state"]) == (2, "interrupted")
        records.resume(event.run_id)
        assert records.add_visit(event.run_id, visit(0), samples(0), {}, 0.1).seq == 4


def test_several_that_start_at_the_same_time_migrate_once(empty_url: str) -> None:
    make_first_revision(empty_url)
    with ThreadPoolExecutor(4) as threads:
        opened = list(threads.map(Records.open, [empty_url] * 4))
    for records in opened:
        assert [run.last_seq for run in records.page(10).runs] == [1, 1]
        records.close()


def test_several_that_start_at_the_same_time_on_nothing_make_it_once(empty_url: str) -> None:
    with ThreadPoolExecutor(4) as threads:
        for records in threads.map(Records.open, [empty_url] * 4):
            assert records.page(10).runs == []
            records.close()
