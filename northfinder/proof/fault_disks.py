"""A database that fills up, or that another program locks, at a word."""

import sqlite3
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Self

from sqlalchemy import Connection, Engine, event

_PATIENCE_S = 0.2  # of the records, by their URL: a locked database is waited for in wall time
_NO_LIMIT_PAGES = 2**30


class Disk(AbstractContextManager["Disk"]):
    """An SQLite file as on a disk that may fill up, by the most pages SQLite lets it have.

    Args:
        folder: Where the file is.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / "records.db"
        self._is_full = False
        self._other: sqlite3.Connection | None = None

    @property
    def url(self) -> str:
        """Return the URL of its records."""
        return f"sqlite:///{self._path.as_posix()}?timeout={_PATIENCE_S}"

    def __enter__(self) -> Self:
        event.listen(Engine, "begin", self._limit)
        return self

    def __exit__(self, *_: object) -> None:
        self.mend()
        event.remove(Engine, "begin", self._limit)

    def fill(self) -> None:
        """Let the file grow no more."""
        self._is_full = True

    def lock(self) -> None:
        """Have another program take the write lock, and keep it."""
        self._other = sqlite3.connect(self._path, isolation_level=None)
        self._other.execute("BEGIN IMMEDIATE")

    def mend(self) -> None:
        """Make room, and release the lock."""
        self._is_full = False
        if self._other is not None:
            self._other.close()
            self._other = None

    def _limit(self, connection: Connection) -> None:
        """SQLite takes no less than the file has, so that one page is as many as there are."""
        pages = 1 if self._is_full else _NO_LIMIT_PAGES
        connection.exec_driver_sql(f"PRAGMA max_page_count = {pages}")
