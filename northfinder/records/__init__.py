"""What is kept: runs, their visits and every raw sample, durable before the next visit begins."""

from northfinder.records.database import default_url
from northfinder.records.entries import NewRun, Run, VisitStatistics
from northfinder.records.errors import RecordsError
from northfinder.records.samples import Stream
from northfinder.records.states import State
from northfinder.records.store import Records
from northfinder.records.writer import Writer

__all__ = [
    "NewRun",
    "Records",
    "RecordsError",
    "Run",
    "State",
    "Stream",
    "VisitStatistics",
    "Writer",
    "default_url",
]
