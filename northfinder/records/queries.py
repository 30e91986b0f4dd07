"""What is asked of the tables inside a transaction."""

import difflib
import hashlib
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

from sqlalchemy import Row, false, func, select, tuple_
from sqlalchemy.orm import Session, undefer_group

from northfinder.records.entries import (
    Idempotency,
    Page,
    Run,
    RunEvent,
    RunSummary,
    VisitStatistics,
)
from northfinder.records.errors import RecordsError, UnknownRunError
from northfinder.records.samples import decode_samples
from northfinder.records.tables import WHOLE, EventRow, RunRow, SamplesRow, VisitRow
from northfinder.samples import Samples, Stream

S = TypeVar("S", RunSummary, Run)

_NAMED_AT_MOST = 5
_SEARCHED_FOR_NEAR_IDS = 1000
_SUMMARY_COLUMNS = [
    getattr(RunRow, name)
    for name in (
        *(field.name for field in fields(RunSummary) if field.name != "idempotency"),
        "idempotency_key",
        "request_sha256",
    )
]


def found(session: Session, run_id: str, *, whole: bool = False) -> RunRow:
    """Return a run by its id or a unique beginning of it.

    Raises:
        UnknownRunError: None or several begin so; the message names near ones.
    """
    if not storable(run_id):
        raise UnknownRunError(unknown(session, run_id))
    options = [undefer_group(WHOLE)] if whole else []
    row = session.get(RunRow, run_id, options=options)
    if row is not None:
        return row
    begins_so = select(RunRow).where(RunRow.id.startswith(run_id, autoescape=True))
    newest = begins_so.order_by(RunRow.id.desc()).limit(_NAMED_AT_MOST).options(*options)
    rows = session.scalars(newest).all()
    if len(rows) == 1:
        return rows[0]
    if rows:
        msg = f"several runs begin with {run_id!r}: {', '.join(row.id for row in rows)}"
        raise UnknownRunError(msg)
    raise UnknownRunError(unknown(session, run_id))


def unknown(session: Session, run_id: str) -> str:
    """Return the sentence for an id that no run has, with near ones."""
    newest = select(RunRow.id).order_by(RunRow.created_utc.desc()).limit(_SEARCHED_FOR_NEAR_IDS)
    ids = session.scalars(newest).all()
    if not ids:
        return f"there is no run {run_id!r}: nothing has been recorded yet"
    near = difflib.get_close_matches(run_id, ids, _NAMED_AT_MOST)
    if near:
        return f"there is no run {run_id!r}; near it are {', '.join(near)}"
    return f"there is no run {run_id!r}; the newest is {ids[0]}"


def run_of_request(session: Session, key: str) -> Run | None:
    """Return the run that a request with this idempotency key began."""
    if not storable(key):
        return None
    wanted = select(RunRow).where(RunRow.idempotency_key == key).options(undefer_group(WHOLE))
    row = session.scalar(wanted)
    return None if row is None else entry_of(Run, row)


def page_of(
    session: Session, equal: Mapping[str, str | None], cursor: str | None, limit: int
) -> Page:
    """Return the newest runs whose columns are as given, after the cursor: a run's id.

    Runs are never deleted, so that the id of the last one shown finds the place again.

    Raises:
        UnknownRunError: The cursor is no run's id.
    """
    wanted = [
        getattr(RunRow, name) == value if storable(value) else false()
        for name, value in equal.items()
        if value is not None
    ]
    total = session.scalar(select(func.count()).select_from(RunRow).where(*wanted)) or 0
    newest = select(*_SUMMARY_COLUMNS).where(*wanted)
    newest = newest.order_by(RunRow.created_utc.desc(), RunRow.id.desc())
    if cursor is not None:
        last = session.get(RunRow, cursor) if storable(cursor) else None
        if last is None:
            msg = f"there is no page after {cursor!r}: take the cursor from the page before"
            raise UnknownRunError(msg)
        place = tuple_(RunRow.created_utc, RunRow.id)
        newest = newest.where(place < (last.created_utc, last.id))
    rows = session.execute(newest.limit(limit + 1)).all()
    shown = [entry_of(RunSummary, row) for row in rows[:limit]]
    return Page(shown, shown[-1].id if len(rows) > limit else None, total)


def entry_of(entry: type[S], row: RunRow | Row[Any]) -> S:
    """Return a run's row as a value, in full or as a summary."""
    idempotency = None
    if row.idempotency_key is not None:
        idempotency = Idempotency(row.idempotency_key, row.request_sha256 or "")
    names = [field.name for field in fields(entry) if field.name != "idempotency"]
    return entry(**{name: getattr(row, name) for name in names}, idempotency=idempotency)


def visit_of(row: VisitRow) -> VisitStatistics:
    """Return a visit's row as a value."""
    names = [field.name for field in fields(VisitStatistics)]
    return VisitStatistics(**{name: getattr(row, name) for name in names})


def event_of(row: EventRow) -> RunEvent:
    """Return an event's row as a value."""
    return RunEvent(
        run_id=row.run_id,
        seq=row.seq,
        time_utc=row.time_utc,
        event=row.event,
        data=row.data,
    )


def samples_of(session: Session, run_id: str, index: int) -> dict[Stream, Samples]:
    """Return a visit's raw samples.

    Raises:
        RecordsError: No such visit, or its samples are damaged.
    """
    if session.get(VisitRow, (run_id, index)) is None:
        msg = f"run {run_id} has no visit {index}"
        raise RecordsError(msg)
    wanted = select(SamplesRow).where(SamplesRow.run_id == run_id, SamplesRow.visit_index == index)
    return {row.stream: _undamaged(row) for row in session.scalars(wanted)}


def samples_sha256_of(session: Session, run_id: str) -> str:
    """Return one hash over the recorded hashes of a run's samples, in order."""
    columns = (SamplesRow.visit_index, SamplesRow.stream, SamplesRow.sha256)
    wanted = select(*columns).where(SamplesRow.run_id == run_id)
    lines = sorted(tuple(row) for row in session.execute(wanted))
    text = "".join(f"{index} {stream} {sha256}\n" for index, stream, sha256 in lines)
    return hashlib.sha256(text.encode()).hexdigest()


def storable(text: str) -> bool:
    """Return whether every database can hold a text; what it cannot is nowhere to be found."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return "\0" not in text


def made_storable(text: str) -> str:
    """Return a text with whatever not every database can hold spelled out."""
    return text.encode(errors="backslashreplace").decode().replace("\0", "\\0")


def _undamaged(row: SamplesRow) -> Samples:
    if hashlib.sha256(row.arrow).hexdigest() != row.sha256:
        msg = (
            f"the {row.stream} samples of run {row.run_id}, visit {row.visit_index} are damaged:"
            " their SHA-256 is not the recorded one; restore the database from a copy"
        )
        raise RecordsError(msg)
    return decode_samples(row.arrow)
