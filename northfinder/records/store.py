"""The records: plain synchronous calls, each one a transaction."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from typing import Self

from sqlalchemy import Engine, func, select, update
from sqlalchemy.orm import Session

from northfinder.records import changes, queries
from northfinder.records.database import make_engine, sentences
from northfinder.records.entries import (
    EventName,
    NewRun,
    Page,
    Run,
    RunEvent,
    VisitStatistics,
)
from northfinder.records.errors import RecordsError
from northfinder.records.holders import Holder
from northfinder.records.portable_json import JsonObject, require_json
from northfinder.records.schema import ensure_schema
from northfinder.records.sqlite import for_writing
from northfinder.records.states import LIVE, RESUMABLE, SettableState, State
from northfinder.records.tables import EventRow, RunRow, VisitRow
from northfinder.samples import Samples, Stream


class Records:
    """Every run of every rig that shares a database; safe to use from several threads.

    What changes a run and what tells of it is one transaction; the event is returned once it is
    durable. A run that is created or resumed here is held by this process (a lease of 30 s,
    renewed by every change and by :meth:`renew_leases`) and no other may change it until it
    ends. Reading calls accept any unique beginning of a run's id. Every call raises RecordsError
    when the database is locked, full, read-only or gone, within seconds; none needs to be opened
    again when it is back.
    """

    def __init__(self, engine: Engine, holder: Holder) -> None:
        self._engine = engine
        self._writing = for_writing(engine)
        self._holder = holder

    @classmethod
    def open(cls, url: str, holder: Holder | None = None) -> Self:
        """Open a database, create or migrate its tables.

        Args:
            url: ``sqlite:///FILE``, whose folder is made, or ``postgresql+psycopg://...``.
            holder: Who holds the runs that are begun here; this process.

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
        return cls(engine, holder or Holder.this_process())

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def create_run(self, new: NewRun) -> Run:
        """Record a queued run, held by this process; its first event says so.

        Raises:
            IdempotencyKeyUsedError: An earlier request had this key.
        """
        with self._transaction() as session:
            row = changes.new_row(new, self._holder)
            session.add(row)
            changes.flush_unless_key_is_used(session, new)
            changes.tell(session, row, "state", {"state": "queued"})
            return queries.entry_of(Run, row)

    def set_state(
        self, run_id: str, state: SettableState, detail: JsonObject | None = None
    ) -> RunEvent:
        """Move a run on; :meth:`finish`, :meth:`fail` and :meth:`resume` are the other ways.

        Args:
            run_id: The whole id.
            state: Where to; a failed or interrupted run runs again by :meth:`resume` only.
            detail: What the event says besides.

        Raises:
            IllegalStepError: The step is illegal, or another process holds the run.
            UnknownRunError: No such run.
        """
        with self._transaction() as session:
            row = changes.locked(session, run_id)
            if row.state not in RESUMABLE or state == "running":
                changes.require_held(row, self._holder, state)
            return changes.enter(session, row, state, detail or {})

    def finish(
        self, run_id: str, result: JsonObject, headline: JsonObject | None
    ) -> list[RunEvent]:
        """Complete a run, and tell the result, without its visits, and the state.

        Raises:
            IllegalStepError: It is not running, or another process holds it.
            UnknownRunError: No such run.
            ValueError: The result is no JSON, for example NaN.
        """
        require_json("result", result)
        require_json("headline", headline)
        told = {name: value for name, value in result.items() if name != "visits"}
        with self._transaction() as session:
            row = changes.locked(session, run_id)
            changes.require_held(row, self._holder, "completed")
            row.result, row.headline, row.progress = result, headline, 1.0
            return [
                changes.tell(session, row, "result", told),
                changes.enter(session, row, "completed", {}),
            ]

    def fail(self, run_id: str, error: str) -> list[RunEvent]:
        """End a run with the reason, one sentence, and tell both.

        Raises:
            IllegalStepError: It has ended already, or another process holds it.
            UnknownRunError: No such run.
        """
        sentence = queries.made_storable(error)
        with self._transaction() as session:
            row = changes.locked(session, run_id)
            changes.require_held(row, self._holder, "failed")
            row.error = sentence
            return [
                changes.tell(session, row, "error", {"message": sentence}),
                changes.enter(session, row, "failed", {}),
            ]

    def resume(self, run_id: str) -> RunEvent:
        """Let a failed or interrupted run run again, held by this process.

        Raises:
            IllegalStepError: It is in another state.
            UnknownRunError: No such run.
        """
        with self._transaction() as session:
            row = changes.locked(session, run_id)
            changes.require_state(row, "cannot be resumed", *RESUMABLE)
            row.lease_holder = self._holder.to_text()
            return changes.enter(session, row, "running", {})

    def add_visit(
        self,
        run_id: str,
        visit: VisitStatistics,
        samples: Mapping[Stream, Samples],
        data: JsonObject,
        progress: float,
    ) -> RunEvent:
        """Keep a visit with its raw samples; it is on the disk when this returns.

        Args:
            run_id: The whole id of a run in progress.
            visit: Its statistics.
            samples: What was read.
            data: What the event says: the visit as clients see it.
            progress: How far the run is now, 0 to 1.

        Raises:
            IllegalStepError: The run has this visit already or is not running, or another
                process holds it.
            UnknownRunError: No such run.
        """
        parts = changes.sample_rows(run_id, visit.index, samples)
        with self._transaction() as session:
            row = changes.locked(session, run_id)
            changes.require_state(row, "takes no visits", "running")
            changes.require_held(row, self._holder)
            changes.require_new_visit(session, row, visit.index)
            session.add(VisitRow(run_id=run_id, **asdict(visit)))
            session.flush()  # the samples refer to it
            session.add_all(parts)
            row.progress = progress
            return changes.tell(session, row, "visit", data)

    def add_event(
        self,
        run_id: str,
        event: EventName,
        data: JsonObject,
        *,
        progress: float | None = None,
        headline: JsonObject | None = None,
    ) -> RunEvent:
        """Tell what changes no state; progress and headline are kept as they were if not given.

        Raises:
            IllegalStepError: The run has ended, or another process holds it.
            UnknownRunError: No such run.
        """
        require_json("headline", headline)
        with self._transaction() as session:
            row = changes.locked(session, run_id)
            changes.require_state(row, "takes no events", *LIVE)
            changes.require_held(row, self._holder)
            row.progress = row.progress if progress is None else progress
            row.headline = row.headline if headline is None else headline
            return changes.tell(session, row, event, data)

    def interrupt_abandoned(self, rig_name: str) -> list[RunEvent]:
        """Interrupt a rig's unfinished runs that nobody carries out any more.

        That is known at once where the process that held them on this host is gone, otherwise
        when its lease expires: ask again after 30 s where a run of this rig is still on.
        """
        with self._transaction() as session:
            return [
                changes.enter(session, row, "interrupted", {"detail": "its program ended"})
                for row in changes.abandoned(session, rig_name, self._holder)
            ]

    def renew_leases(self) -> int:
        """Renew the leases of every run that this process holds; return how many those are."""
        held = RunRow.lease_holder == self._holder.to_text()
        with self._snapshot() as session:
            ids = session.scalars(select(RunRow.id).where(held)).all()
        if not ids:  # an idle service shall not write
            return 0
        with self._transaction() as session:
            renewal = update(RunRow).where(held)
            session.execute(renewal.values(lease_expires_utc=changes.lease_end(session)))
        return len(ids)

    def run(self, run_id: str) -> Run:
        """Return a run by its id or a unique beginning of it.

        Raises:
            UnknownRunError: None or several begin so; the message names near ones.
        """
        with self._snapshot() as session:
            return queries.entry_of(Run, queries.found(session, run_id, whole=True))

    def same_request(self, key: str) -> Run | None:
        """Return the run that an earlier request with this idempotency key began."""
        with self._snapshot() as session:
            return queries.run_of_request(session, key)

    def page(
        self,
        limit: int,
        cursor: str | None = None,
        *,
        kind: str | None = None,
        state: State | None = None,
        rig_name: str | None = None,
    ) -> Page:
        """Return the newest runs first, those of one kind, state or rig only if given.

        Args:
            limit: How many.
            cursor: ``next_cursor`` of the page before; runs that begin meanwhile shift nothing.
            kind: As in :class:`NewRun`.
            state: Where they stand.
            rig_name: The rig that ran them.

        Raises:
            UnknownRunError: The cursor is none of ours.
        """
        given = {"kind": kind, "state": state, "rig_name": rig_name}
        with self._snapshot() as session:
            return queries.page_of(session, given, cursor, limit)

    def count_by_state(self) -> dict[State, int]:
        """Return how many runs are in each state; states without one are left out."""
        counted = select(RunRow.state, func.count()).group_by(RunRow.state)
        with self._snapshot() as session:
            return dict(session.execute(counted).tuples().all())

    def visits(self, run_id: str) -> list[VisitStatistics]:
        """Return a run's visits in time order.

        Raises:
            UnknownRunError: No such run.
        """
        with self._snapshot() as session:
            wanted = select(VisitRow).where(VisitRow.run_id == queries.found(session, run_id).id)
            rows = session.scalars(wanted.order_by(VisitRow.index))
            return [queries.visit_of(row) for row in rows]

    def events(self, run_id: str, after: int = 0, limit: int = 1000) -> list[RunEvent]:
        """Return a run's events in order.

        Args:
            run_id: The run.
            after: The sequence number of the last one known.
            limit: How many at most; none are left when fewer come.

        Raises:
            UnknownRunError: No such run.
        """
        with self._snapshot() as session:
            row = queries.found(session, run_id)
            wanted = select(EventRow).where(
                EventRow.run_id == row.id, EventRow.seq > min(after, row.last_seq)
            )
            rows = session.scalars(wanted.order_by(EventRow.seq).limit(limit))
            return [queries.event_of(row) for row in rows]

    def samples(self, run_id: str, index: int) -> dict[Stream, Samples]:
        """Return a visit's raw samples, bit for bit as they were added.

        Raises:
            RecordsError: No such run or visit, or its samples are damaged.
        """
        with self._snapshot() as session:
            return queries.samples_of(session, queries.found(session, run_id).id, index)

    def samples_sha256(self, run_id: str) -> str:
        """Return one SHA-256 over the recorded ones of all the run's samples, in order.

        It is that of the lines ``visit stream sha256``, by visit and then stream.

        Raises:
            UnknownRunError: No such run.
        """
        with self._snapshot() as session:
            return queries.samples_sha256_of(session, queries.found(session, run_id).id)

    @contextmanager
    def _transaction(self) -> Iterator[Session]:
        with sentences(self._engine), Session(self._writing) as session, session.begin():
            yield session

    @contextmanager
    def _snapshot(self) -> Iterator[Session]:
        with sentences(self._engine), Session(self._engine) as session:
            yield session
