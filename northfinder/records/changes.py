"""What changes a run inside a transaction: its state, its events, its lease."""

import hashlib
import secrets
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Final

from sqlalchemy import func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from northfinder.records.entries import EventName, NewRun, RunEvent
from northfinder.records.errors import (
    HeldElsewhereError,
    IdempotencyKeyUsedError,
    IllegalStepError,
    UnknownRunError,
)
from northfinder.records.holders import Holder
from northfinder.records.portable_json import JsonObject, require_json
from northfinder.records.queries import event_of, unknown
from northfinder.records.samples import encode_samples
from northfinder.records.states import (
    ENDED,
    LEGAL_STEPS,
    LIVE,
    RESUMABLE,
    State,
    require_legal_step,
)
from northfinder.records.tables import EventRow, RunRow, SamplesRow, VisitRow
from northfinder.samples import Samples, Stream

LEASE_S: Final = 30.0
_COPIED = (
    "kind",
    "rig_name",
    "plan",
    "prediction",
    "site",
    "rig",
    "simulation",
    "software",
)


def locked(session: Session, run_id: str) -> RunRow:
    """Return the run by its whole id, for nobody else to change before the transaction ends.

    Raises:
        UnknownRunError: No such run.
    """
    row = session.get(RunRow, run_id, with_for_update=True)
    if row is None:
        raise UnknownRunError(unknown(session, run_id))
    return row


def require_held(row: RunRow, holder: Holder, new: State | None = None) -> None:
    """Refuse to change a run that another process carries out.

    A process that slept longer than its lease may wake and find its run resumed by another.

    Args:
        row: The run.
        holder: Who wants to change it.
        new: The state that it shall enter, whose being illegal is the better reason.

    Raises:
        HeldElsewhereError: It is another one's.
        IllegalStepError: It cannot become that state anyhow.
    """
    if row.lease_holder == holder.to_text():
        return
    if row.state in RESUMABLE and new == "running":
        msg = f"run {row.id} is {row.state}: resume it, or abort it for good"
        raise IllegalStepError(msg, row.id, row.state, LEGAL_STEPS[row.state])
    if new is not None:
        require_legal_step(row.id, row.state, new)
    whose = "nobody" if row.lease_holder is None else str(Holder.from_text(row.lease_holder))
    msg = (
        f"run {row.id} is {row.state} and held by {whose}, not by {holder}: change it there; if"
        " that program is gone, the run is interrupted when its rig is started again"
    )
    raise HeldElsewhereError(msg, row.id, row.state, ())


def require_state(row: RunRow, otherwise: str, *states: State) -> None:
    """Refuse what a run can take in certain states only.

    Raises:
        IllegalStepError: It is in another one.
    """
    if row.state not in states:
        msg = f"run {row.id} is {row.state} and {otherwise}: only while {' or '.join(states)}"
        raise IllegalStepError(msg, row.id, row.state, LEGAL_STEPS[row.state])


def require_new_visit(session: Session, row: RunRow, index: int) -> None:
    """Refuse to write a visit twice.

    Raises:
        IllegalStepError: The run has it already.
    """
    if session.get(VisitRow, (row.id, index)) is not None:
        msg = f"run {row.id} has visit {index} already; visits are never replaced"
        raise IllegalStepError(msg, row.id, row.state, LEGAL_STEPS[row.state])


def abandoned(session: Session, rig_name: str, asker: Holder) -> list[RunRow]:
    """Return a rig's unfinished runs that nobody carries out any more, locked.

    Those of the asker are not: it lives, even if it could not renew its lease for a while.
    """
    unfinished = (RunRow.rig_name == rig_name, RunRow.state.in_(LIVE))
    # To lock needs a database that takes writes, even where there is nothing to lock: so an idle
    # rig that asks learns of one that does not.
    locked_rows = select(RunRow).where(*unfinished).order_by(RunRow.id).with_for_update()
    rows = session.scalars(locked_rows).all()
    now_utc = _now_utc(session)
    return [row for row in rows if _is_over(row, asker, now_utc)]


def _is_over(row: RunRow, asker: Holder, now_utc: datetime) -> bool:
    """Return whether a lease has expired, or its holder is gone; older records have none."""
    if row.lease_holder is None or row.lease_expires_utc is None:
        return True
    holder = Holder.from_text(row.lease_holder)
    return holder != asker and (row.lease_expires_utc < now_utc or holder.is_gone())


def enter(session: Session, row: RunRow, state: State, detail: JsonObject) -> RunEvent:
    """Take a legal step and tell it; a run that runs again has not ended and has no error."""
    require_legal_step(row.id, row.state, state)
    now_utc = datetime.now(UTC)
    row.state = state
    row.finished_utc = now_utc if state in ENDED else None
    if state == "running":
        row.started_utc = row.started_utc or now_utc
        row.error = None
    if state in ENDED:
        row.lease_holder = row.lease_expires_utc = None
    return tell(session, row, "state", {"state": state, **detail})


def tell(session: Session, row: RunRow, event: EventName, data: JsonObject) -> RunEvent:
    """Add an event to the run's; who writes is alive, so that its lease is renewed."""
    require_json(event, data)
    if row.lease_holder is not None:
        row.lease_expires_utc = lease_end(session)
    row.last_seq += 1
    new = EventRow(
        run_id=row.id, seq=row.last_seq, time_utc=datetime.now(UTC), event=event, data=data
    )
    session.add(new)
    return event_of(new)


def lease_end(session: Session) -> datetime:
    """Return when a lease that is renewed now expires, by the database's clock."""
    return _now_utc(session) + timedelta(seconds=LEASE_S)


def _now_utc(session: Session) -> datetime:
    """Return the database's time: the clocks of the hosts that share it need not agree."""
    if session.get_bind().dialect.name != "postgresql":
        return datetime.now(UTC)  # an SQLite file is used by one host
    now: datetime = session.scalars(select(func.clock_timestamp())).one()
    return now


def new_row(new: NewRun, holder: Holder) -> RunRow:
    """Return a queued run under a new id, for its holder."""
    created_utc = datetime.now(UTC)
    fields = {name: getattr(new, name) for name in _COPIED}
    return RunRow(
        id=f"{created_utc:%Y%m%dT%H%M%SZ}-{secrets.token_hex(3)}",
        state="queued",
        created_utc=created_utc,
        started_utc=None,
        finished_utc=None,
        result=None,
        error=None,
        progress=0.0,
        headline=None,
        last_seq=0,
        lease_holder=holder.to_text(),
        idempotency_key=new.idempotency and new.idempotency.key,
        request_sha256=new.idempotency and new.idempotency.request_sha256,
        **fields,
    )


def flush_unless_key_is_used(session: Session, new: NewRun) -> None:
    """Insert a new run.

    Raises:
        IdempotencyKeyUsedError: An earlier request had its key.
    """
    try:
        session.flush()
    except IntegrityError as error:
        if new.idempotency is None or "idempotency_key" not in str(error.orig):
            raise
        msg = f"an earlier request had the idempotency key {new.idempotency.key!r}; choose another"
        raise IdempotencyKeyUsedError(msg) from error


def sample_rows(run_id: str, index: int, samples: Mapping[Stream, Samples]) -> list[SamplesRow]:
    """Return a visit's raw samples as rows."""
    rows = []
    for stream, part in samples.items():
        blob = encode_samples(part)
        sha256 = hashlib.sha256(blob).hexdigest()
        rows.append(
            SamplesRow(run_id=run_id, visit_index=index, stream=stream, arrow=blob, sha256=sha256)
        )
    return rows
