"""Databases that cannot serve are refused in one sentence, and left as they are."""

import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import platformdirs
import pytest
from sqlalchemy import make_url

from northfinder.records import Records, RecordsError, default_url
from tests.postgresql import PostgresqlServer
from tests.records.examples import RUN, execute


def test_an_existing_database_is_opened_without_alembic(url: str) -> None:
    program = (
        "import sys; from northfinder.records import Records\n"
        "with Records.open(sys.argv[1]): sys.exit('alembic' in sys.modules)"
    )
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", program, url], cwd=root, check=True)


def test_a_read_only_file_can_be_read_and_says_why_it_takes_nothing(
    sqlite_url: str, tmp_path: Path
) -> None:
    with Records.open(sqlite_url) as records:
        run_id = records.create_run(RUN).id
    archive_url = f"sqlite:///{(tmp_path / 'records.db').as_uri()}?mode=ro&uri=true"
    with Records.open(archive_url) as archive:
        assert archive.run(run_id).state == "queued"
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


def test_another_programs_database_on_a_server_is_refused(
    postgresql_server: PostgresqlServer,
) -> None:
    url = postgresql_server.empty_database()
    execute(url, "CREATE TABLE accounts (id int)")
    with pytest.raises(RecordsError, match=r"another program \(its tables: accounts\)"):
        Records.open(url)
    postgresql_server.drop(url)


def test_a_newer_schema_is_refused_and_left_alone(url: str) -> None:
    execute(url, "UPDATE northfinder_schema SET version_num = '9999'")
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
    with pytest.raises(RecordsError, match=r"file .* cannot be made"):
        Records.open(f"sqlite:///{tmp_path / 'file' / 'records.db'}")


@pytest.mark.parametrize(
    ("written", "sentence"),
    [
        pytest.param("records.db", "is no database URL; write sqlite:///FILE", id="a path"),
        pytest.param("mysql://lab/records", "cannot be kept in mysql; use sqlite", id="mysql"),
        pytest.param("sqlite://", "lives in memory and would lose every run", id="memory"),
        pytest.param("sqlite+nothing:///x.db", "no driver for the database", id="driver"),
    ],
)
def test_a_url_that_cannot_serve_is_refused_and_leaves_no_file(
    written: str, sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RecordsError, match=sentence):
        Records.open(written)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        pytest.param({"port": 1}, "refused.*start the database server, or correct", id="port"),
        pytest.param({"password": "no"}, "authentication failed.*correct the user", id="password"),
        pytest.param({"username": "nobody7"}, "authentication failed.*correct", id="user"),
        pytest.param({"database": "absent"}, "does not exist.*create it, or", id="database"),
        pytest.param({"host": "absent.invalid"}, "resolve host.*correct the host", id="host"),
    ],
)
def test_a_server_that_cannot_serve_is_a_sentence(
    postgresql_server: PostgresqlServer, change: dict[str, Any], sentence: str
) -> None:
    url = postgresql_server.url.set(**change).render_as_string(hide_password=False)
    with pytest.raises(RecordsError, match=sentence) as caught:
        Records.open(url)
    assert "\n" not in str(caught.value)
    assert str(postgresql_server.url.password) not in str(caught.value)


def test_a_user_that_may_create_nothing_is_told_so(postgresql_server: PostgresqlServer) -> None:
    url = postgresql_server.empty_database()
    postgresql_server.execute("CREATE ROLE guest LOGIN PASSWORD 'guest'")
    guest_url = make_url(url).set(username="guest", password="guest")  # noqa: S106 -- no secret
    with pytest.raises(RecordsError, match=r"permission denied.*let this user create"):
        Records.open(guest_url.render_as_string(hide_password=False))
    postgresql_server.drop(url)


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
