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
    LargeBinary,
    MetaData,
    String,
    Text,
    TypeDecorator,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from northfinder.records.portable_json import JsonObject
from northfinder.records.samples import Stream
from northfinder.records.states import State


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


class RunRow(Base):
    """A run; see :class:`northfinder.records.entries.Run`."""

    __tablename__ = "runs"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(32))
    rig_name: Mapped[str] = mapped_column(Text)
    state: Mapped[State] = mapped_column(String(16))
    created_utc: Mapped[datetime] = mapped_column(index=True)
    started_utc: Mapped[datetime | None]
    finished_utc: Mapped[datetime | None]
    plan: Mapped[JsonObject]
    site: Mapped[JsonObject]
    rig: Mapped[JsonObject]
    simulation: Mapped[JsonObject | None]
    software: Mapped[JsonObject]
    result: Mapped[JsonObject | None]
    error: Mapped[str | None] = mapped_column(Text)


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
