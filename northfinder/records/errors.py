"""What the records raise on purpose."""

from northfinder.errors import NorthfinderError


class RecordsError(NorthfinderError):
    """The database cannot be used, or does not hold what was asked for."""
