"""What a call has returned for is on the disk, whatever happens next."""

import subprocess
import sys
from pathlib import Path

import numpy as np
from sqlalchemy import text

from northfinder.records import Records
from northfinder.records.database import make_engine
from tests.records.examples import samples, visit

ROOT = Path(__file__).parents[2]
ENDLESS_RUN = """
import itertools, sys
from northfinder.records import Records
from tests.records.examples import RUN, samples, visit

records = Records.open(sys.argv[1])
run_id = records.create_run(RUN).id
records.set_state(run_id, "running")
print(run_id, flush=True)
for index in itertools.count():
    records.add_event(run_id, "progress", {"visit": index}, progress=0.1)
    records.add_visit(run_id, visit(index), samples(index), {"index": index}, 0.5)
    print(index, flush=True)
"""


def test_each_visit_is_there_for_another_connection_at_once(
    records: Records, running: str, url: str
) -> None:
    for index in range(5):
        records.add_visit(running, visit(index), samples(index), {}, 0.5)
        with Records.open(url) as others:
            assert others.visits(running)[-1] == visit(index)
            assert len(others.samples(running, index)["gyro"]) == 4


def test_every_completed_visit_survives_a_kill(url: str) -> None:
    command = [sys.executable, "-c", ENDLESS_RUN, url]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        run_id = process.stdout.readline().strip()
        for _ in range(7):
            process.stdout.readline()
        process.kill()
        reported = 7 + len(process.stdout.readlines())
    with Records.open(url) as records:
        assert records.run(run_id).state == "running"
        kept = records.visits(run_id)
        assert kept == [visit(index) for index in range(len(kept))]
        assert reported <= len(kept) <= reported + 1
        events = records.events(run_id)
        assert [event.seq for event in events] == [*range(1, len(events) + 1)]
        assert records.run(run_id).last_seq == len(events)
        told = [event.data["index"] for event in events if event.event == "visit"]
        assert told == [visit.index for visit in kept]
        for index in range(len(kept)):
            np.testing.assert_array_equal(
                records.samples(run_id, index)["gyro"].value, samples(index)["gyro"].value
            )


def test_every_connection_to_a_file_syncs_each_commit_and_keeps_references(
    sqlite_url: str,
) -> None:
    engine = make_engine(sqlite_url)
    with engine.connect() as connection:
        pragmas = ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
        values = [connection.scalar(text(f"PRAGMA {pragma}")) for pragma in pragmas]
    engine.dispose()
    full = 2  # sqlite.org/pragma.html#pragma_synchronous
    assert values == ["wal", full, 1, 5000]
