"""Fresh records, in an SQLite file and on a PostgreSQL server: every test here runs over both."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from northfinder.records import Records
from tests.records.examples import RUN


@pytest.fixture(scope="session")
def sqlite_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with the tables, to copy: to migrate takes longer than most tests."""
    path = tmp_path_factory.mktemp("template") / "records.db"
    Records.open(f"sqlite:///{path}").close()
    return path


@pytest.fixture
def sqlite_url(tmp_path: Path, sqlite_template: Path) -> str:
    path = tmp_path / "records.db"
    shutil.copy(sqlite_template, path)
    return f"sqlite:///{path}"


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest) -> str:
    url: str = request.getfixturevalue(f"{request.param}_url")
    return url


@pytest.fixture
def records(url: str) -> Iterator[Records]:
    with Records.open(url) as records:
        yield records


@pytest.fixture
def running(records: Records) -> str:
    """The id of a run in progress."""
    run_id = records.create_run(RUN).id
    records.set_state(run_id, "running")
    return run_id
