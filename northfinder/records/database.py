"""Databases by their URLs, and what their drivers raise as sentences."""

from collections.abc import Iterator
from contextlib import contextmanager

import platformdirs
from sqlalchemy import URL, Engine, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError

from northfinder.records import sqlite
from northfinder.records.errors import DatabaseUrlError, RecordsError

_SERVER_AWAY = "the database server is away: it is used again as soon as it is back"
#: What to do, by a part of the reason; the first that fits.
_ADVICE = {
    "database is locked": "another program holds it: end that one, or wait, and try again",
    "readonly": "make the file and its folder writable, or name another database",
    "unable to open": "check the path and its permissions, or name another database",
    "not a database": "the file is something else: name another database",
    "no such table": "the file was replaced by another: put it back, or start again to make one",
    "malformed": "it is damaged: restore it from a copy, without its old -wal and -shm files",
    "is full": "free some space",
    "Connection refused": "start the database server, or correct host and port in the URL",
    "authentication failed": "correct the user and the password in the URL",
    "no password supplied": "add the password to the URL: postgresql+psycopg://user:password@...",
    "does not exist": "create it, or correct the URL",
    "permission denied": "let this user create and write tables, or name another database",
    "read-only transaction": "this server only takes readers: name the one that takes writers",
    "lock timeout": "another program holds it: end that one, or wait, and try again",
    "statement timeout": "the database server is too busy: lighten its load, or wait",
    "timeout expired": "the database server does not answer: check that it runs, and the network",
    "resolve host": "correct the host in the URL",
    "too many clients": "end other programs that use it, or raise its max_connections",
    "connection slots": "end other programs that use it, or raise its max_connections",
    "No space left": "free some space on the database server",
    "starting up": "wait until it is ready",
    "shutting down": _SERVER_AWAY,
    "terminating connection": _SERVER_AWAY,
    "closed the connection": _SERVER_AWAY,
    "no answer from": "check that the database server runs, and the network",
    "connection is lost": _SERVER_AWAY,
    "connection is closed": _SERVER_AWAY,
    "QueuePool limit": "too many requests at the same time: wait, and try again",
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
        if url.get_backend_name() == "sqlite":
            return sqlite.make_engine(url)
        from northfinder.records import postgresql  # noqa: PLC0415 -- 0.1 s that most can save

        return postgresql.make_engine(url)
    except (ImportError, NoSuchModuleError) as error:
        msg = f"no driver for the database {_public(url)}: {error}"
        raise DatabaseUrlError(msg) from error


@contextmanager
def sentences(engine: Engine) -> Iterator[None]:
    """Turn what a database driver raises into a RecordsError."""
    try:
        yield
    except (DBAPIError, PoolTimeoutError) as error:
        cause = error.orig if isinstance(error, DBAPIError) else error
        reason = " ".join(str(cause).split())
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


def _public(url: URL) -> str:
    return url.set(query={}).render_as_string(hide_password=True)
