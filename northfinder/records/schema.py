"""The schema's revision: compared cheaply, migrated by alembic only when it is not ours."""

from typing import TYPE_CHECKING

from sqlalchemy import Connection, Engine, column, inspect, select, table

from northfinder.records import sqlite
from northfinder.records.errors import RecordsError
from northfinder.records.sqlite import for_writing

if TYPE_CHECKING:
    from alembic.config import Config

CURRENT_REVISION = "0002"
#: A name of our own: another program's ``alembic_version`` shall not pass for ours.
VERSION_TABLE = "northfinder_schema"


def ensure_schema(engine: Engine) -> None:
    """Create or migrate the tables where needed.

    Raises:
        RecordsError: The database is another program's, or a newer northfinder's.
    """
    with engine.connect() as connection:
        stored = stored_revision(connection)
    if stored != CURRENT_REVISION:
        _migrate(for_writing(engine))


def stored_revision(connection: Connection) -> str | None:
    """Return the revision that the database is at, ``None`` for an empty database.

    Raises:
        RecordsError: There are tables, but not ours.
    """
    names = inspect(connection).get_table_names()
    if VERSION_TABLE in names:
        return connection.scalar(select(column("version_num")).select_from(table(VERSION_TABLE)))
    if names:
        msg = (
            f"the database {connection.engine.url.database} belongs to another program"
            f" (its tables: {', '.join(names[:5])}); name another database"
        )
        raise RecordsError(msg)
    return None


def alembic_config(connection: Connection) -> "Config":
    """Return what alembic needs to migrate over this connection, without an ini file."""
    from alembic.config import Config  # noqa: PLC0415 -- 0.2 s that most starts can save

    config = Config()
    config.set_main_option("script_location", "northfinder.records:migrations")
    config.attributes["connection"] = connection
    return config


def _migrate(engine: Engine) -> None:
    from alembic import command  # noqa: PLC0415 -- as above
    from alembic.script import ScriptDirectory  # noqa: PLC0415 -- as above

    from northfinder.records import postgresql  # noqa: PLC0415 -- as above

    with engine.connect() as connection:
        connection.detach()  # it is set up to migrate and serves for nothing else
        if connection.dialect.name == "sqlite":
            sqlite.prepare_migration(connection)
        with connection.begin():
            if connection.dialect.name == "postgresql":
                postgresql.prepare_migration(connection)
            stored = stored_revision(connection)  # again, now that nobody else can write
            config = alembic_config(connection)
            known = {s.revision for s in ScriptDirectory.from_config(config).walk_revisions()}
            if stored not in known | {None}:
                msg = (
                    f"the records in {engine.url.database} were written by a newer northfinder"
                    f" (schema {stored}, this one knows {CURRENT_REVISION}); install that version"
                )
                raise RecordsError(msg)
            command.upgrade(config, "head")
