"""A real PostgreSQL server that is thrown away afterwards: Debian's pg_virtualenv."""

import itertools
import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any, LiteralString

import psutil
import psycopg
import pytest
from psycopg import sql
from sqlalchemy import URL, make_url

from northfinder.records import Records

# Runs inside pg_virtualenv, whose end removes the server; ends when our end of its stdin closes.
# It answers through a pipe of its own, for which dash knows too few descriptors: with a closed
# stdout, pg_virtualenv never ends cleaning up.
_INSIDE = r"""
echo "$PGUSER $PGPASSWORD $PGPORT" >&"$1"
while read -r action; do
    case $action in
        stop) pg_ctlcluster --mode immediate "$PGVERSION" regress stop ;;
        start) pg_ctlcluster "$PGVERSION" regress start ;;
    esac </dev/null >/dev/null 2>&1
    echo "$?" >&"$1"
done
"""
# Whatever the locale of those who run the tests.
_CLUSTER = "--encoding UTF8 --locale C.UTF-8"


def name_of(url: str) -> str:
    """Return the name of a URL's database."""
    return make_url(url).database or ""


class PostgresqlServer:
    """A server of its own, as root and as any other user; it keeps nothing on the disk in time."""

    def __init__(self, orders: IO[str], answers: IO[str]) -> None:
        self._orders = orders
        self._answers = answers
        user, password, port = self._answer().split()
        self._url = URL.create(
            "postgresql+psycopg", user, password, "localhost", int(port), "postgres"
        )
        self._numbers = itertools.count()
        self._template: str | None = None

    @property
    def url(self) -> URL:
        """Where its maintenance database is."""
        return self._url

    def empty_database(self) -> str:
        """Make a database without tables and return its URL."""
        return self._new_database("template1")

    def database(self) -> str:
        """Make a database with the records' tables, empty, and return its URL: 30 ms."""
        if self._template is None:
            template_url = self.empty_database()
            Records.open(template_url).close()
            self._template = name_of(template_url)
        return self._new_database(self._template)

    def drop(self, url: str) -> None:
        """Remove a database and whoever is connected to it."""
        self.execute("DROP DATABASE {} WITH (FORCE)", name_of(url))

    def execute(self, statement: LiteralString, *names: str) -> None:
        """Execute as superuser, outside a transaction; ``{}`` stands for a name."""
        with self._connection() as connection:
            connection.execute(sql.SQL(statement).format(*map(sql.Identifier, names)))

    def disconnect_everyone(self, url: str) -> None:
        """Cut every connection of northfinder to a database."""
        with self._connection() as connection:
            connection.execute(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
                " WHERE datname = %s AND application_name = 'northfinder'",
                [name_of(url)],
            )

    @contextmanager
    def read_only(self) -> Iterator[None]:
        """Refuse every write meanwhile, of the connections that are open too."""
        self._set_read_only("on")
        try:
            yield
        finally:
            self._set_read_only("off")

    def _set_read_only(self, wanted: LiteralString) -> None:
        deadline_s = time.monotonic() + 5.0
        with self._connection() as connection:
            connection.execute(f"ALTER SYSTEM SET default_transaction_read_only = {wanted}")
            connection.execute("SELECT pg_reload_conf()")
            while connection.execute("SHOW default_transaction_read_only").fetchone() != (wanted,):
                assert time.monotonic() < deadline_s, "the server has not read its configuration"

    @contextmanager
    def frozen(self, url: str) -> Iterator[None]:
        """Have the server's processes for northfinder's connections hang meanwhile."""
        with self._connection() as connection:
            pids = connection.execute(
                "SELECT pid FROM pg_stat_activity"
                " WHERE datname = %s AND application_name = 'northfinder'",
                [name_of(url)],
            ).fetchall()
        processes = [psutil.Process(pid) for (pid,) in pids]
        for process in processes:
            process.suspend()
        try:
            yield
        finally:
            for process in processes:
                process.resume()

    def wait_for_a_lock(self, url: str) -> None:
        """Return once somebody in a database waits for a lock."""
        deadline_s = time.monotonic() + 5.0
        with self._connection() as connection:
            while not connection.execute(
                "SELECT 1 FROM pg_stat_activity WHERE datname = %s AND wait_event_type = 'Lock'",
                [name_of(url)],
            ).fetchall():
                assert time.monotonic() < deadline_s, "nobody waits for a lock"

    def stop(self) -> None:
        """Stop the server as a power cut would."""
        self._tell("stop")

    def start(self) -> None:
        """Start it again."""
        self._tell("start")

    def _connection(self) -> "psycopg.Connection[Any]":
        conninfo = self._url.set(drivername="postgresql").render_as_string(hide_password=False)
        return psycopg.connect(conninfo, autocommit=True)

    def _new_database(self, template: str) -> str:
        name = f"test{next(self._numbers)}"
        self.execute("CREATE DATABASE {} TEMPLATE {}", name, template)
        return self._url.set(database=name).render_as_string(hide_password=False)

    def _tell(self, action: str) -> None:
        self._orders.write(f"{action}\n")
        self._orders.flush()
        assert self._answer() == "0", f"the server did not {action}"

    def _answer(self) -> str:
        answer = self._answers.readline().strip()
        assert answer, "pg_virtualenv ended; what it wrote to stderr says why"
        return answer


@contextmanager
def throw_away_server() -> Iterator[PostgresqlServer]:
    """Start a server for as long as the context lasts: 3 s."""
    if shutil.which("pg_virtualenv") is None:
        pytest.fail("pg_virtualenv is missing: apt-get install postgresql postgresql-common")
    reading, writing = os.pipe()
    command = ["pg_virtualenv", "-t", "-c", _CLUSTER, "bash", "-c", _INSIDE, "bash", str(writing)]
    with (
        os.fdopen(reading, encoding="ascii") as answers,
        # In a session of its own: Ctrl-C is for pytest, whose end closes its stdin.
        subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            pass_fds=[writing],
            start_new_session=True,
            text=True,
        ) as process,
    ):
        os.close(writing)
        assert process.stdin is not None
        yield PostgresqlServer(process.stdin, answers)


@pytest.fixture(scope="session")
def postgresql_server() -> Iterator[PostgresqlServer]:
    """One server for all tests."""
    with throw_away_server() as server:
        yield server


@pytest.fixture
def postgresql_url(postgresql_server: PostgresqlServer) -> Iterator[str]:
    """A database of its own with the records' tables."""
    url = postgresql_server.database()
    yield url
    postgresql_server.drop(url)
