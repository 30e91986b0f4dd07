"""What is kept: runs, their visits and every raw sample, durable before the next visit begins."""

from northfinder.records.database import default_url
from northfinder.records.entries import (
    EventName,
    Idempotency,
    NewRun,
    Page,
    Run,
    RunEvent,
    RunSummary,
    VisitStatistics,
)
from northfinder.records.errors import (
    HeldElsewhereError,
    IdempotencyKeyUsedError,
    IllegalStepError,
    RecordsError,
    UnknownRunError,
)
from northfinder.records.holders import Holder
from northfinder.records.states import SettableState, State
from northfinder.records.store import Records
from northfinder.records.writer import Writer
from northfinder.samples import Stream

__all__ = [
    "EventName",
    "HeldElsewhereError",
    "Holder",
    "Idempotency",
    "IdempotencyKeyUsedError",
    "IllegalStepError",
    "NewRun",
    "Page",
    "Records",
    "RecordsError",
    "Run",
    "RunEvent",
    "RunSummary",
    "SettableState",
    "State",
    "Stream",
    "UnknownRunError",
    "VisitStatistics",
    "Writer",
    "default_url",
]
