"""Alembic's environment: it runs the migrations over the connection that `schema` hands in."""

from alembic import context

from northfinder.records.schema import VERSION_TABLE
from northfinder.records.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    version_table=VERSION_TABLE,
    render_as_batch=True,  # SQLite alters a table by rebuilding it
)
with context.begin_transaction():
    context.run_migrations()
