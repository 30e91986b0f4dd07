"""The tables, in types that SQLite and PostgreSQL both have."""

from datetime import UTC, datetime
from typing import Any, ClassVar

from sqlalchemy import (
    JSON,
    DateTime,
    Dialect,
    Double,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    LargeBinary,
    MetaData,
    String,
    Text,
    TypeDecorator,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, MappedColumn, mapped_column

from northfinder.records.entries import EventName
from northfinder.records.portable_json import JsonObject
from northfinder.records.states import State
from northfinder.samples import Stream

#: The columns of a run that are too large for a list.
WHOLE = "whole"


class UtcDateTime(TypeDecorator[datetime]):
    """An instant; SQLite keeps no time zone, so that UTC goes in and comes out everywhere."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002 -- the signature is SQLAlchemy's
        """Turn an aware time into UTC."""
        return value if value is None else value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002 -- the signature is SQLAlchemy's
        """Say that it is UTC, where the database could not."""
        if value is None or value.tzinfo is not None:
            return value if value is None else value.astimezone(UTC)
        return value.replace(tzinfo=UTC)


class Base(DeclarativeBase):
    """Every table; constraints have names, so that a later migration can alter them."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(column_0_label)s",
            "uq": "uq_%(table_name)s_%(column_0_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map: ClassVar[dict[Any, Any]] = {
        datetime: UtcDateTime,
        float: Double,
        JsonObject: JSON(none_as_null=True),
    }


def _whole() -> MappedColumn[Any]:
    """Return a column that only `Records.run` reads: a list of 50 shall not load megabytes."""
    return mapped_column(deferred=True, deferred_group=WHOLE, deferred_raiseload=True)


class RunRow(Base):
    """A run; see :class:`northfinder.records.entries.Run`.

    The lease says who carries the run out: a :class:`northfinder.records.holders.Holder` as
    text, and until when it is believed without a further sign; both NULL once the run ended.
    """

    __tablename__ = "runs"
    # In the order of a list; with what a list is filtered by, which spares a look at each row.
    __table_args__ = (Index("ix_runs_newest", "created_utc", "id", "kind", "state", "rig_name"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(32))
    rig_name: Mapped[str] = mapped_column(Text)
    state: Mapped[State] = mapped_column(String(16))
    created_utc: Mapped[datetime]
    started_utc: Mapped[datetime | None]
    finished_utc: Mapped[datetime | None]
    plan: Mapped[JsonObject]
    site: Mapped[JsonObject] = _whole()
    rig: Mapped[JsonObject] = _whole()
    simulation: Mapped[JsonObject | None] = _whole()
    software: Mapped[JsonObject] = _whole()
    result: Mapped[JsonObject | None] = _whole()
    error: Mapped[str | None] = mapped_column(Text)
    prediction: Mapped[JsonObject | None] = _whole()
    progress: Mapped[float] = mapped_column(server_default="0")
    headline: Mapped[JsonObject | None]
    last_seq: Mapped[int] = mapped_column(server_default="0")
    lease_holder: Mapped[str | None] = mapped_column(Text, index=True)
    lease_expires_utc: Mapped[datetime | None]
    idempotency_key: Mapped[str | None] = mapped_column(Text, unique=True, index=True)
    request_sha256: Mapped[str | None] = mapped_column(String(64))


class EventRow(Base):
    """An event of a run; see :class:`northfinder.records.entries.RunEvent`."""

    __tablename__ = "events"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    time_utc: Mapped[datetime]
    event: Mapped[EventName] = mapped_column(String(16))
    data: Mapped[JsonObject]


class VisitRow(Base):
    """A visit; see :class:`northfinder.records.entries.VisitStatistics`."""

    __tablename__ = "visits"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    index: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    segment: Mapped[int]
    direction: Mapped[str] = mapped_column(String(16))
    angle_rad: Mapped[float]
    gyro_mean_rad_s: Mapped[float]
    gyro_sigma_rad_s: Mapped[float]
    accel_mean_g: Mapped[float]
    accel_sigma_g: Mapped[float]
    samples: Mapped[int]
    lost: Mapped[int]
    start_s: Mapped[float]
    turned_rad: Mapped[float | None]
    repeats: Mapped[int | None]


class SamplesRow(Base):
    """The raw samples of one stream of a visit, an Arrow IPC stream."""

    __tablename__ = "samples"
    __table_args__ = (
        ForeignKeyConstraint(["run_id", "visit_index"], ["visits.run_id", "visits.index"]),
    )

    run_id: Mapped[str] = mapped_column(String(32), primary_key=True)
    visit_index: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    stream: Mapped[Stream] = mapped_column(String(16), primary_key=True)
    arrow: Mapped[bytes] = mapped_column(LargeBinary)
    sha256: Mapped[str] = mapped_column(String(64))
