"""A database that is locked, moved, replaced or switched off: a sentence, and then it is back."""

import shutil
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import psycopg
import pytest
from sqlalchemy import make_url, text

from northfinder.records import Records, RecordsError
from tests.postgresql import PostgresqlServer, name_of
from tests.records.examples import RUN, samples, visit

LOCK_HOLDER = """
import sqlite3, sys
connection = sqlite3.connect(sys.argv[1])
connection.execute("BEGIN IMMEDIATE")
print("locked", flush=True)
sys.stdin.read()
"""


@contextmanager
def locked_by_another_process(path: Path) -> Iterator[None]:
    command = [sys.executable, "-c", LOCK_HOLDER, str(path)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "locked\n"
        yield
        process.communicate()


@contextmanager
def locked_by_another_client(url: str) -> Iterator[None]:
    conninfo = make_url(url).set(drivername="postgresql").render_as_string(hide_password=False)
    with psycopg.connect(conninfo) as connection:
        connection.execute("SELECT * FROM runs FOR UPDATE")
        yield


def test_a_file_locked_by_another_program_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "records.db"
    with Records.open(f"sqlite:///{path}?timeout=0.05") as records:
        run_id = records.create_run(RUN).id
        with locked_by_another_process(path):
            with pytest.raises(RecordsError, match=r"database is locked.*another program holds it"):
                records.set_state(run_id, "running")
            assert records.run(run_id).state == "queued"
        records.set_state(run_id, "running")


@pytest.mark.slow  # it waits as long as a technician would
def test_a_run_locked_by_another_client_is_a_sentence_within_seconds(postgresql_url: str) -> None:
    with Records.open(postgresql_url) as records:
        run_id = records.create_run(RUN).id
        with locked_by_another_client(postgresql_url):
            began_s = time.monotonic()
            with pytest.raises(RecordsError, match=r"timeout.*: another program holds it|too busy"):
                records.set_state(run_id, "running")
            assert 4.0 < time.monotonic() - began_s < 8.0
            assert records.run(run_id).state == "queued"
        records.set_state(run_id, "running")


def test_a_file_that_was_moved_away_is_a_sentence_and_is_used_again_when_it_is_back(
    sqlite_url: str, tmp_path: Path
) -> None:
    bench, away = tmp_path / "bench", tmp_path / "away"
    bench.mkdir()
    shutil.move(make_url(sqlite_url).database or "", bench / "records.db")
    with Records.open(f"sqlite:///{bench / 'records.db'}") as records:
        run_id = records.create_run(RUN).id
        bench.rename(away)
        for _ in range(2):
            with pytest.raises(RecordsError, match=r"unable to open.*check the path"):
                records.set_state(run_id, "running")
        bench.mkdir()
        with pytest.raises(RecordsError, match="unable to open"):
            records.run(run_id)
        assert list(bench.iterdir()) == []  # an empty file in its place would hide the loss
        bench.rmdir()
        away.rename(bench)
        records.set_state(run_id, "running")
        assert records.run(run_id).state == "running"


def test_a_file_that_was_replaced_by_a_copy_is_the_one_that_is_written(
    sqlite_url: str, tmp_path: Path
) -> None:
    """Who holds the old file open would write what nobody finds again."""
    path, copy = tmp_path / "records.db", tmp_path / "copy.db"
    with Records.open(sqlite_url) as records:
        run_id = records.create_run(RUN).id
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("VACUUM INTO ?", (str(copy),))
        copy.replace(path)
        for suffix in ("-wal", "-shm"):  # of the old one: sqlite.org/howtocorrupt.html, 1.4
            path.with_name(f"records.db{suffix}").unlink()
        records.set_state(run_id, "running")
        with Records.open(sqlite_url) as others:
            assert others.run(run_id).state == "running"


def test_another_file_in_its_place_is_a_sentence(sqlite_url: str, tmp_path: Path) -> None:
    path = tmp_path / "records.db"
    with Records.open(sqlite_url) as records:
        path.rename(tmp_path / "away.db")
        path.touch()
        with pytest.raises(RecordsError, match=r"no such table.*the file was replaced by another"):
            records.create_run(RUN)
        (tmp_path / "away.db").replace(path)
        records.create_run(RUN)


def test_a_file_that_takes_nothing_for_a_while_takes_it_again(sqlite_url: str) -> None:
    with Records.open(sqlite_url) as records:
        run_id = records.create_run(RUN).id
        with records._engine.connect() as connection:
            connection.exec_driver_sql("PRAGMA query_only = ON")
        with pytest.raises(RecordsError, match=r"readonly database.*writable"):
            records.set_state(run_id, "running")
        assert records.run(run_id).state == "queued"
        with records._engine.connect() as connection:
            connection.exec_driver_sql("PRAGMA query_only = OFF")
        records.set_state(run_id, "running")


def test_a_server_that_only_takes_readers_for_a_while(
    postgresql_server: PostgresqlServer, postgresql_url: str
) -> None:
    name = name_of(postgresql_url)
    with Records.open(postgresql_url) as records:
        run_id = records.create_run(RUN).id
        postgresql_server.execute(f'ALTER DATABASE "{name}" SET default_transaction_read_only = on')
        postgresql_server.disconnect_everyone(postgresql_url)
        with pytest.raises(RecordsError, match=r"read-only transaction.*only takes readers"):
            records.set_state(run_id, "running")
        assert records.run(run_id).state == "queued"
        postgresql_server.execute("ALTER DATABASE {} RESET default_transaction_read_only", name)
        postgresql_server.disconnect_everyone(postgresql_url)
        records.set_state(run_id, "running")


def test_a_server_that_was_switched_off_is_used_again_when_it_is_back(
    postgresql_server: PostgresqlServer, postgresql_url: str
) -> None:
    with Records.open(postgresql_url) as records:
        run_id = records.create_run(RUN).id
        records.set_state(run_id, "running")
        postgresql_server.stop()
        for _ in range(2):
            with pytest.raises(RecordsError, match=r"refused.*start the database server"):
                records.add_visit(run_id, visit(0), samples(0), {}, 0.1)
        postgresql_server.start()
        records.add_visit(run_id, visit(0), samples(0), {}, 0.1)
        assert [event.seq for event in records.events(run_id)] == [1, 2, 3]


def test_a_connection_that_is_cut_in_mid_transaction_leaves_nothing_behind(
    postgresql_server: PostgresqlServer, postgresql_url: str
) -> None:
    with Records.open(postgresql_url) as records:
        run_id = records.create_run(RUN).id
        records.set_state(run_id, "running")
        refused: list[str] = []

        def write() -> None:
            try:
                records.add_visit(run_id, visit(0), samples(0), {}, 0.1)
            except RecordsError as error:
                refused.append(str(error))

        with locked_by_another_client(postgresql_url):
            writer = threading.Thread(target=write)
            writer.start()
            postgresql_server.wait_for_a_lock(postgresql_url)
            postgresql_server.disconnect_everyone(postgresql_url)
            writer.join()
        assert "it is used again as soon as it is back" in refused[0]
        assert records.visits(run_id) == []
        assert records.run(run_id).last_seq == 2


@pytest.mark.slow  # it waits as long as a technician would
def test_a_server_that_hangs_is_given_up_and_asked_anew(
    postgresql_server: PostgresqlServer, postgresql_url: str
) -> None:
    with Records.open(postgresql_url) as records:
        run_id = records.create_run(RUN).id

        def ask_in_vain() -> None:
            with records._snapshot() as session:
                session.execute(text("SELECT 1"))
                with postgresql_server.frozen(postgresql_url):
                    session.execute(text("SELECT 1"))

        began_s = time.monotonic()
        with pytest.raises(RecordsError, match=r"no answer from the server for 8 s.*the network"):
            ask_in_vain()
        assert time.monotonic() - began_s < 12.0
        assert records.run(run_id).state == "queued"
