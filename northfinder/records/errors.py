"""What the records raise on purpose."""

from northfinder.errors import ConfigError, NorthfinderError


class RecordsError(NorthfinderError):
    """The database cannot be used, or does not hold what was asked for."""


class DatabaseUrlError(RecordsError, ConfigError):
    """The URL names no database that could hold records."""
