"""Alembic's script folder: the way of the schema from its first revision to the current one."""
