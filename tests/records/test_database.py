"""Databases that cannot serve are refused in one sentence, and left as they are."""

import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import platformdirs
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from northfinder.records import Records, RecordsError, default_url
from northfinder.records.database import make_engine
from northfinder.records.schema import CURRENT_REVISION, VERSION_TABLE, alembic_config
from northfinder.records.tables import Base
from tests.records.examples import RUN

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


def test_the_migrations_arrive_at_the_tables_as_declared(records: Records, url: str) -> None:
    del records  # has migrated
    engine = make_engine(url)
    with engine.connect() as connection:
        options = {"version_table": VERSION_TABLE, "compare_type": True}
        context = MigrationContext.configure(connection, opts=options)
        assert compare_metadata(context, Base.metadata) == []
        assert context.get_current_revision() == CURRENT_REVISION
        script = ScriptDirectory.from_config(alembic_config(connection))
        assert script.get_heads() == [CURRENT_REVISION]
    engine.dispose()


def test_an_existing_database_is_opened_without_alembic(records: Records, url: str) -> None:
    del records  # has migrated
    program = (
        "import sys; from northfinder.records import Records\n"
        "with Records.open(sys.argv[1]): sys.exit('alembic' in sys.modules)"
    )
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", program, url], cwd=root, check=True)


def test_a_database_locked_by_another_program_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "records.db"
    with Records.open(f"sqlite:///{path}?timeout=0.05") as records:
        run_id = records.create_run(RUN)
        with locked_by_another_process(path):
            with pytest.raises(RecordsError, match=r"database is locked.*another program holds it"):
                records.set_state(run_id, "running")
            assert records.run(run_id).state == "queued"
        records.set_state(run_id, "running")


def test_a_read_only_database_can_be_read_and_says_why_it_takes_nothing(
    records: Records, running: str, tmp_path: Path
) -> None:
    del records
    archive_url = f"sqlite:///{(tmp_path / 'records.db').as_uri()}?mode=ro&uri=true"
    with Records.open(archive_url) as archive:
        assert archive.run(running).state == "running"
        with pytest.raises(RecordsError, match=r"readonly database.*make the file and its folder"):
            archive.create_run(RUN)


def test_another_programs_database_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "places.sqlite"
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE moz_places (url TEXT)")
        connection.execute("CREATE TABLE alembic_version (version_num TEXT)")
    before = path.read_bytes()
    with pytest.raises(RecordsError, match=r"another program \(its tables: .*moz_places"):
        Records.open(f"sqlite:///{path}")
    assert path.read_bytes() == before


def test_a_newer_schema_is_refused_and_left_alone(url: str, tmp_path: Path) -> None:
    Records.open(url).close()
    with closing(sqlite3.connect(tmp_path / "records.db")) as connection:
        connection.execute("UPDATE northfinder_schema SET version_num = '9999'")
        connection.commit()
    with pytest.raises(RecordsError, match=r"newer northfinder \(schema 9999, this one knows"):
        Records.open(url)


def test_a_file_that_is_no_database_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "thesis.txt"
    path.write_text("North is where the needle points." * 100)
    with pytest.raises(RecordsError, match=r"not a database.*the file is something else"):
        Records.open(f"sqlite:///{path}")
    assert path.read_text().startswith("North is")


def test_a_place_where_no_file_can_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordsError, match=r"unable to open database file.*check the path"):
        Records.open(f"sqlite:///{tmp_path}")
    (tmp_path / "file").touch()
    with pytest.raises(RecordsError, match=r"folder .* cannot be made"):
        Records.open(f"sqlite:///{tmp_path / 'file' / 'records.db'}")


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        pytest.param("records.db", "is no database URL; write sqlite:///FILE", id="a path"),
        pytest.param("mysql://lab/records", "cannot be kept in mysql; use sqlite", id="mysql"),
        pytest.param("sqlite://", "lives in memory and would lose every run", id="memory"),
        pytest.param("sqlite+nothing:///x.db", "no driver for the database", id="driver"),
    ],
)
def test_a_url_that_cannot_serve_is_refused(url: str, sentence: str) -> None:
    with pytest.raises(RecordsError, match=sentence):
        Records.open(url)


def test_a_password_is_not_shown() -> None:
    with pytest.raises(RecordsError, match="no driver") as caught:
        Records.open("postgresql+nothing://lab:secret@host/records")
    assert "secret" not in str(caught.value)


def test_the_default_is_a_file_in_the_users_data_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "100% North" / "northfinder"
    monkeypatch.setattr(platformdirs, "user_data_path", lambda *_, **__: folder)
    with Records.open(default_url()) as records:
        records.create_run(RUN)
    assert (folder / "northfinder.db").is_file()
