"""Fresh records in a folder of their own."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from northfinder.records import Records
from tests.records.examples import RUN


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'records.db'}"


@pytest.fixture
def records(url: str) -> Iterator[Records]:
    with Records.open(url) as records:
        yield records


@pytest.fixture
def running(records: Records) -> str:
    """The id of a run in progress."""
    run_id = records.create_run(RUN)
    records.set_state(run_id, "running")
    return run_id
