"""Connections to a PostgreSQL server, set up so that every call ends."""

import time
from collections.abc import Generator
from typing import Any, Final

import psycopg
from sqlalchemy import URL, Connection, Dialect, Engine, create_engine, event, func, select, text
from sqlalchemy.pool import ConnectionPoolEntry

_PATIENCE_S: Final = 5  # of every wait of the server's, and for a free connection
#: libpq's parameters; those of TCP end the wait for a server whose computer has vanished.
_PARAMETERS = {
    "connect_timeout": str(_PATIENCE_S),
    "keepalives_idle": str(_PATIENCE_S),
    "keepalives_interval": "1",
    "keepalives_count": "3",
    "tcp_user_timeout": str(_PATIENCE_S * 1000),
    "application_name": "northfinder",
    "client_encoding": "utf8",  # where a database says none, its texts would come as bytes
}
_SETTINGS = {
    "statement_timeout": _PATIENCE_S,
    "lock_timeout": _PATIENCE_S,
    # Should our computer vanish in a transaction, its locks end with its lease.
    "idle_in_transaction_session_timeout": 30,
}
_MIGRATION_S: Final = 600
_MIGRATION_LOCK = int.from_bytes(b"north")  # any number that no other program is likely to take


class PatientConnection(psycopg.Connection[Any]):
    """A connection that gives up when nothing at all comes from a server.

    The server's own time-outs come first and say more; they are no help where it hangs itself.

    Attributes:
        patience_s: How long an answer may take.
    """

    patience_s = _PATIENCE_S + 3.0

    def wait(self, gen: Generator[Any, Any, Any], *args: Any, **options: Any) -> Any:  # noqa: ANN401 -- as psycopg's, of which each version has other options
        """See :meth:`psycopg.Connection.wait`."""
        return super().wait(self._until(gen, time.monotonic() + self.patience_s), *args, **options)

    def _until(self, gen: Generator[Any, Any, Any], deadline_s: float) -> Generator[Any, Any, Any]:
        """Pass on what is awaited and what came; psycopg reports ten times a second."""
        try:
            awaited = next(gen)
            while True:
                ready = yield awaited
                if not ready and time.monotonic() > deadline_s:
                    self.pgconn.finish()  # whatever comes later belongs to nobody
                    msg = f"no answer from the server for {self.patience_s:g} s"
                    raise psycopg.OperationalError(msg)
                awaited = gen.send(ready)
        except StopIteration as end:
            return end.value


def make_engine(url: URL) -> Engine:
    """Prepare connections; a server that was away is used again as soon as it is back."""
    engine = create_engine(
        url.update_query_dict(_PARAMETERS | url.query),
        pool_pre_ping=True,
        pool_timeout=_PATIENCE_S,
    )
    event.listen(engine, "do_connect", _connect)
    event.listen(engine, "connect", _set_up)
    return engine


def prepare_migration(connection: Connection) -> None:
    """Let one instance migrate and others that start at the same time wait for it.

    To create tables and fill them may take longer than an ordinary call is allowed.
    """
    patient = connection.connection.dbapi_connection
    assert isinstance(patient, PatientConnection)  # noqa: S101 -- for the type checker
    patient.patience_s = _MIGRATION_S
    connection.execute(text(f"SET LOCAL statement_timeout = '{_MIGRATION_S}s'"))
    connection.execute(text(f"SET LOCAL lock_timeout = '{_MIGRATION_S}s'"))
    connection.execute(select(func.pg_advisory_xact_lock(_MIGRATION_LOCK)))


def _connect(
    _: Dialect, __: ConnectionPoolEntry, arguments: list[Any], options: dict[str, Any]
) -> PatientConnection:
    return PatientConnection.connect(*arguments, **options)


def _set_up(connection: PatientConnection, _: ConnectionPoolEntry) -> None:
    for name, seconds in _SETTINGS.items():
        connection.execute("SELECT set_config(%s, %s, false)", (name, f"{seconds}s"))
    connection.commit()
