"""What the records raise on purpose.

RecordsError                the database cannot be used, or does not hold what was asked for
 +-- DatabaseUrlError       its URL names none; also a ConfigError
 +-- UnknownRunError        no such run, or several
 +-- IllegalStepError       the run cannot take this step where it stands
 |    +-- HeldElsewhereError    another program carries the run out
 +-- IdempotencyKeyUsedError    an earlier request had this key
"""

from northfinder.errors import ConfigError, NorthfinderError


class RecordsError(NorthfinderError):
    """The database cannot be used, or does not hold what was asked for."""


class DatabaseUrlError(RecordsError, ConfigError):
    """The URL names no database that could hold records."""


class UnknownRunError(RecordsError):
    """No run has this id, or several begin with it."""


class IllegalStepError(RecordsError):
    """The run cannot take this step where it stands; no later attempt will succeed either.

    Attributes:
        run_id: The run.
        state: Where it stands.
        legal: The states that it may enter from there.
    """

    def __init__(self, message: str, run_id: str, state: str, legal: tuple[str, ...]) -> None:
        super().__init__(message)
        self.run_id = run_id
        self.state = state
        self.legal = legal


class HeldElsewhereError(IllegalStepError):
    """Another program carries the run out; only that one may change it."""


class IdempotencyKeyUsedError(RecordsError):
    """An earlier request had this key; :meth:`Records.same_request` finds its run."""
