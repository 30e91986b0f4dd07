"""The records: plain synchronous calls, each one a transaction."""

import difflib
import hashlib
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, fields
from datetime import UTC, datetime
from typing import Literal, Self, TypeVar

from sqlalchemy import Engine, select
from sqlalchemy.orm import Session

from northfinder.records.database import for_writing, make_engine, sentences
from northfinder.records.entries import NewRun, Run, VisitStatistics
from northfinder.records.errors import RecordsError
from northfinder.records.portable_json import JsonObject, require_json
from northfinder.records.samples import Stream, decode_samples, encode_samples
from northfinder.records.schema import ensure_schema
from northfinder.records.states import ENDED, State, require_legal_step
from northfinder.records.tables import RunRow, SamplesRow, VisitRow
from northfinder.samples import Samples

E = TypeVar("E", Run, VisitStatistics)

_NAMED_AT_MOST = 5
_SEARCHED_FOR_NEAR_IDS = 1000


class Records:
    """Every run of every rig that shares a database; safe to use from several threads.

    Reading calls accept any unique beginning of a run's id. Every call raises RecordsError
    when the database is locked, full, read-only or gone.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._writing = for_writing(engine)

    @classmethod
    def open(cls, url: str) -> Self:
        """Open a database, create or migrate its tables.

        Args:
            url: ``sqlite:///FILE``, whose folder is made, or ``postgresql+psycopg://...``.

        Raises:
            RecordsError: It cannot be reached or written, is another program's, or was written
                by a newer northfinder.
        """
        engine = make_engine(url)
        try:
            with sentences(engine):
                ensure_schema(engine)
        except RecordsError:
            engine.dispose()
            raise
        return cls(engine)

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def create_run(self, new: NewRun) -> str:
        """Record a queued run and return its id."""
        created_utc = datetime.now(UTC)
        run_id = f"{created_utc:%Y%m%dT%H%M%SZ}-{secrets.token_hex(3)}"
        with self._transaction() as session:
            row = RunRow(id=run_id, state="queued", created_utc=created_utc, **asdict(new))
            session.add(row)
        return run_id

    def set_state(
        self, run_id: str, state: Literal["running", "paused", "aborted", "interrupted"]
    ) -> None:
        """Move a run on; :meth:`finish` and :meth:`fail` are the other two ways.

        Raises:
            RecordsError: The step is illegal, or no such run.
        """
        with self._transaction() as session:
            _enter(_locked(session, run_id), state)

    def finish(self, run_id: str, result: JsonObject) -> None:
        """Complete a run.

        Raises:
            RecordsError: It is not running, or no such run.
            ValueError: The result is no JSON, for example NaN.
        """
        require_json("result", result)
        with self._transaction() as session:
            row = _locked(session, run_id)
            _enter(row, "completed")
            row.result = result

    def fail(self, run_id: str, error: str) -> None:
        """End a run with the reason, one sentence.

        Raises:
            RecordsError: It has ended already, or no such run.
        """
        with self._transaction() as session:
            row = _locked(session, run_id)
            _enter(row, "failed")
            row.error = error

    def add_visit(
        self, run_id: str, visit: VisitStatistics, samples: Mapping[Stream, Samples]
    ) -> None:
        """Keep a visit with its raw samples; it is on the disk when this returns.

        Raises:
            RecordsError: The run has this visit already or is not running, or no such run.
        """
        blobs = {stream: encode_samples(part) for stream, part in samples.items()}
        with self._transaction() as session:
            row = _locked(session, run_id)
            if row.state != "running":
                msg = f"run {run_id} is {row.state} and takes no visits"
                raise RecordsError(msg)
            if session.get(VisitRow, (run_id, visit.index)) is not None:
                msg = f"run {run_id} has visit {visit.index} already; visits are never replaced"
                raise RecordsError(msg)
            session.add(VisitRow(run_id=run_id, **asdict(visit)))
            session.flush()
            session.add_all(
                SamplesRow(
                    run_id=run_id,
                    visit_index=visit.index,
                    stream=stream,
                    arrow=blob,
                    sha256=hashlib.sha256(blob).hexdigest(),
                )
                for stream, blob in blobs.items()
            )

    def run(self, run_id: str) -> Run:
        """Return a run by its id or a unique beginning of it.

        Raises:
            RecordsError: None or several begin so; the message names near ones.
        """
        with self._snapshot() as session:
            return _entry(Run, _found(session, run_id))

    def runs(
        self, *, limit: int = 50, kind: str | None = None, state: State | None = None
    ) -> list[Run]:
        """Return the newest runs first, of one kind or state only if given."""
        wanted = select(RunRow).order_by(RunRow.created_utc.desc(), RunRow.id.desc()).limit(limit)
        if kind is not None:
            wanted = wanted.where(RunRow.kind == kind)
        if state is not None:
            wanted = wanted.where(RunRow.state == state)
        with self._snapshot() as session:
            return [_entry(Run, row) for row in session.scalars(wanted)]

    def visits(self, run_id: str) -> list[VisitStatistics]:
        """Return a run's visits in time order.

        Raises:
            RecordsError: No such run.
        """
        with self._snapshot() as session:
            wanted = select(VisitRow).where(VisitRow.run_id == _found(session, run_id).id)
            return [
                _entry(VisitStatistics, row)
                for row in session.scalars(wanted.order_by(VisitRow.index))
            ]

    def samples(self, run_id: str, index: int) -> dict[Stream, Samples]:
        """Return a visit's raw samples, bit for bit as they were added.

        Raises:
            RecordsError: No such run or visit, or its samples are damaged.
        """
        with self._snapshot() as session:
            full_id = _found(session, run_id).id
            if session.get(VisitRow, (full_id, index)) is None:
                msg = f"run {full_id} has no visit {index}"
                raise RecordsError(msg)
            wanted = select(SamplesRow).where(
                SamplesRow.run_id == full_id, SamplesRow.visit_index == index
            )
            return {row.stream: _undamaged(row) for row in session.scalars(wanted)}

    @contextmanager
    def _transaction(self) -> Iterator[Session]:
        with sentences(self._engine), Session(self._writing) as session, session.begin():
            yield session

    @contextmanager
    def _snapshot(self) -> Iterator[Session]:
        with sentences(self._engine), Session(self._engine) as session:
            yield session


def _enter(row: RunRow, state: State) -> None:
    """Take a legal step; a run that runs again has not ended and has no error any more."""
    require_legal_step(row.id, row.state, state)
    now_utc = datetime.now(UTC)
    row.state = state
    row.finished_utc = now_utc if state in ENDED else None
    if state == "running":
        row.started_utc = row.started_utc or now_utc
        row.error = None


def _locked(session: Session, run_id: str) -> RunRow:
    """Return the run by its whole id, for nobody else to change before the transaction ends."""
    row = session.get(RunRow, run_id, with_for_update=True)
    if row is None:
        raise RecordsError(_unknown(session, run_id))
    return row


def _found(session: Session, run_id: str) -> RunRow:
    row = session.get(RunRow, run_id)
    if row is not None:
        return row
    begins_so = select(RunRow).where(RunRow.id.startswith(run_id, autoescape=True))
    rows = session.scalars(begins_so.order_by(RunRow.id.desc()).limit(_NAMED_AT_MOST)).all()
    if len(rows) == 1:
        return rows[0]
    if rows:
        msg = f"several runs begin with {run_id!r}: {', '.join(row.id for row in rows)}"
        raise RecordsError(msg)
    raise RecordsError(_unknown(session, run_id))


def _unknown(session: Session, run_id: str) -> str:
    newest = select(RunRow.id).order_by(RunRow.created_utc.desc()).limit(_SEARCHED_FOR_NEAR_IDS)
    ids = session.scalars(newest).all()
    if not ids:
        return f"there is no run {run_id!r}: nothing has been recorded yet"
    near = difflib.get_close_matches(run_id, ids, _NAMED_AT_MOST)
    if near:
        return f"there is no run {run_id!r}; near it are {', '.join(near)}"
    return f"there is no run {run_id!r}; the newest is {ids[0]}"


def _entry(entry: type[E], row: RunRow | VisitRow) -> E:
    return entry(**{field.name: getattr(row, field.name) for field in fields(entry)})


def _undamaged(row: SamplesRow) -> Samples:
    if hashlib.sha256(row.arrow).hexdigest() != row.sha256:
        msg = (
            f"the {row.stream} samples of run {row.run_id}, visit {row.visit_index} are damaged:"
            " their SHA-256 is not the recorded one; restore the database from a copy"
        )
        raise RecordsError(msg)
    return decode_samples(row.arrow)
