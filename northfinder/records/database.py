"""Connections: SQLite as it must be set for records, and its errors as sentences."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import platformdirs
from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError
from sqlalchemy.pool import ConnectionPoolEntry

from northfinder.records.errors import DatabaseUrlError, RecordsError

_BUSY_TIMEOUT_S = "5"
_ADVICE = {
    "locked": "another program holds it: end that one, or wait, and try again",
    "readonly": "make the file and its folder writable, or name another database",
    "unable to open": "check the path and its permissions, or name another database",
    "not a database": "the file is something else: name another database",
    "full": "free some space",
}


def default_url() -> str:
    """Return the URL of the SQLite file in the user's data folder."""
    path = platformdirs.user_data_path("northfinder", appauthor=False) / "northfinder.db"
    return URL.create("sqlite", database=str(path)).render_as_string(hide_password=False)


def make_engine(url_text: str) -> Engine:
    """Prepare connections to a database; an SQLite file's folder is made.

    Args:
        url_text: ``sqlite:///FILE`` or ``postgresql+psycopg://...``.

    Raises:
        DatabaseUrlError: No such kind of database, or no such driver.
        RecordsError: No such folder.
    """
    url = _parse(url_text)
    try:
        if url.get_backend_name() != "sqlite":
            return create_engine(url)
        _require_folder(url)
        engine = create_engine(url.update_query_dict({"timeout": _BUSY_TIMEOUT_S} | url.query))
    except (ImportError, NoSuchModuleError) as error:
        msg = f"no driver for the database {_public(url)}: {error}"
        raise DatabaseUrlError(msg) from error
    event.listen(engine, "connect", _set_up_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def for_writing(engine: Engine) -> Engine:
    """Return the same connections for transactions that write.

    In SQLite they take the write lock first: a transaction that has read and then writes is
    refused at once, without the busy timeout, when another has written in between (WAL,
    SQLITE_BUSY_SNAPSHOT). PostgreSQL locks the rows that are selected for update.
    """
    return engine.execution_options(sqlite_begin="BEGIN IMMEDIATE")


@contextmanager
def sentences(engine: Engine) -> Iterator[None]:
    """Turn what a database driver raises into a RecordsError."""
    try:
        yield
    except DBAPIError as error:
        reason = str(error.orig)
        advice = [advice for key, advice in _ADVICE.items() if key in reason]
        hint = advice[0] if advice else "check that it is there, and yours to write"
        msg = f"the records in {_public(engine.url)} cannot be used ({reason}): {hint}"
        raise RecordsError(msg) from error


def _parse(url_text: str) -> URL:
    try:
        url = make_url(url_text)
    except ArgumentError as error:
        msg = f"{url_text!r} is no database URL; write sqlite:///FILE or postgresql+psycopg://..."
        raise DatabaseUrlError(msg) from error
    if url.get_backend_name() not in {"sqlite", "postgresql"}:
        msg = f"records cannot be kept in {url.get_backend_name()}; use sqlite or postgresql"
        raise DatabaseUrlError(msg)
    return url


def _require_folder(url: URL) -> None:
    if not url.database or url.database == ":memory:":
        msg = "this database lives in memory and would lose every run; name a file: sqlite:///FILE"
        raise DatabaseUrlError(msg)
    if "uri" in url.query:  # an SQLite URI names an existing file, with options of its own
        return
    folder = Path(url.database).parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"the folder {folder} for the records cannot be made: {error}; name another database"
        raise RecordsError(msg) from error


def _public(url: URL) -> str:
    return url.set(query={}).render_as_string(hide_password=True)


def _set_up_sqlite(connection: sqlite3.Connection, _: ConnectionPoolEntry) -> None:
    connection.isolation_level = None  # SQLAlchemy's BEGIN below, not sqlite3's guess
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("PRAGMA foreign_keys = ON")


def _begin_sqlite(connection: Connection) -> None:
    connection.exec_driver_sql(connection.get_execution_options().get("sqlite_begin", "BEGIN"))
