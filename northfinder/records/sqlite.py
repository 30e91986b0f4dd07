"""Connections to an SQLite file, as they must be set for records."""

import sqlite3
from pathlib import Path
from typing import Any, Final

from sqlalchemy import URL, Connection, Dialect, Engine, create_engine, event
from sqlalchemy.exc import InvalidatePoolError
from sqlalchemy.pool import ConnectionPoolEntry, PoolProxiedConnection

from northfinder.records.errors import DatabaseUrlError, RecordsError

_PATIENCE_S: Final = 5  # of every wait: for a lock, a free connection
#: Of each connection. SQLite's own 2 MB fill up for hours as the file grows, and the system keeps
#: the file in memory anyway.
_CACHE_KIB: Final = 256


def make_engine(url: URL) -> Engine:
    """Prepare connections to a file, which is made where it is not there, with its folder.

    Raises:
        DatabaseUrlError: The URL names no file.
        RecordsError: The file or its folder cannot be made.
    """
    if not url.database or url.database == ":memory:":
        msg = "this database lives in memory and would lose every run; name a file: sqlite:///FILE"
        raise DatabaseUrlError(msg)
    patient_url = url.update_query_dict({"timeout": str(_PATIENCE_S)} | url.query)
    engine = create_engine(patient_url, pool_timeout=_PATIENCE_S)
    if "uri" not in url.query:  # an SQLite URI names an existing file, its own way
        _make_file(Path(url.database))
        event.listen(engine, "do_connect", _name_an_existing_file)
    event.listen(engine, "connect", _set_up)
    event.listen(engine, "checkout", _require_same_file)
    event.listen(engine, "begin", _begin)
    return engine


def for_writing(engine: Engine) -> Engine:
    """Return the same connections for transactions that write; of PostgreSQL, the engine itself.

    In SQLite they take the write lock first: a transaction that has read and then writes is
    refused at once, without the busy timeout, when another has written in between (WAL,
    SQLITE_BUSY_SNAPSHOT). PostgreSQL locks the rows that are selected for update.
    """
    return engine.execution_options(sqlite_begin="BEGIN IMMEDIATE")


def prepare_migration(connection: Connection) -> None:
    """Turn on WAL, which stays with the file, and let alembic rebuild tables.

    To drop a table that others refer to, foreign keys must be off. SQLite takes neither pragma
    inside a transaction.
    """
    cursor = connection.connection.cursor()
    cursor.execute("PRAGMA journal_mode = WAL")
    cursor.execute("PRAGMA foreign_keys = OFF")
    cursor.close()


def _make_file(path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            path.touch()  # an empty file is an empty database
    except OSError as error:
        msg = f"the file {path} for the records cannot be made: {error}; name another database"
        raise RecordsError(msg) from error


def _name_an_existing_file(
    _: Dialect, __: ConnectionPoolEntry, arguments: list[Any], options: dict[str, Any]
) -> None:
    """Have SQLite refuse to make a file: where ours was moved away, an empty one is no help."""
    arguments[0] = f"{Path(arguments[0]).as_uri()}?mode=rw"
    options["uri"] = True


def _set_up(connection: sqlite3.Connection, entry: ConnectionPoolEntry) -> None:
    connection.isolation_level = None  # SQLAlchemy's BEGIN below, not sqlite3's guess
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("PRAGMA foreign_keys = ON")
    connection.execute(f"PRAGMA cache_size = -{_CACHE_KIB}")
    ((_, _, name),) = connection.execute("PRAGMA database_list").fetchall()
    entry.info["file"] = Path(name)
    entry.info["identity"] = _identity(Path(name))


def _require_same_file(
    _: sqlite3.Connection, entry: ConnectionPoolEntry, __: PoolProxiedConnection
) -> None:
    """Leave connections whose file is no longer the one of that name: its records are lost.

    Raises:
        InvalidatePoolError: The pool shall connect again.
    """
    if _identity(entry.info["file"]) != entry.info["identity"]:
        msg = f"the file {entry.info['file']} was moved or replaced"
        raise InvalidatePoolError(msg)


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except FileNotFoundError:
        return None
    return status.st_dev, status.st_ino


def _begin(connection: Connection) -> None:
    connection.exec_driver_sql(connection.get_execution_options().get("sqlite_begin", "BEGIN"))
