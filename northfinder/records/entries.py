"""What goes into the records and comes out of them, as values."""

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from northfinder.records.portable_json import JsonObject, require_json
from northfinder.records.states import State

EventName = Literal["state", "progress", "visit", "estimate", "warning", "result", "error"]


@dataclass(frozen=True, slots=True)
class Idempotency:
    """What tells a repeated request from a new one.

    Attributes:
        key: Chosen by the client, once per request that it means.
        request_sha256: Of the request's body: the same key with another body is a mistake.
    """

    key: str
    request_sha256: str


@dataclass(frozen=True, slots=True, kw_only=True)
class NewRun:
    """What is known of a run before it begins.

    Attributes:
        kind: ``north-seek``, ``alignment``, ``noise``, ``heading-hold``.
        rig_name: The rig that runs it; several may share one database.
        plan: What was asked for.
        prediction: What it should take and bring, ``None`` where nobody asked.
        site: Where the rig stands.
        rig: Its configuration and the identities of its devices.
        simulation: The truth of a simulated world, ``None`` on hardware.
        software: Versions of what computed the result.
        idempotency: The request that began it, ``None`` where none did.

    Raises:
        ValueError: A value is no JSON, for example NaN.
    """

    kind: str
    rig_name: str
    plan: JsonObject
    prediction: JsonObject | None
    site: JsonObject
    rig: JsonObject
    simulation: JsonObject | None
    software: JsonObject
    idempotency: Idempotency | None = None

    def __post_init__(self) -> None:
        for name in ("plan", "prediction", "site", "rig", "simulation", "software"):
            require_json(name, getattr(self, name))


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary:
    """What a list shows of a run.

    Attributes:
        id: Sortable by the second of its creation, in UTC: ``20261122T034512Z-7f3a9c``.
        kind: As in :class:`NewRun`, like ``rig_name``, ``plan`` and ``idempotency``.
        state: Where it stands.
        created_utc: When it was recorded first.
        started_utc: When it first ran, ``None`` before.
        finished_utc: When it last ended, ``None`` while it has not, or runs again.
        progress: From 0 to 1.
        headline: The numbers that a list shows, so far or final, ``None`` before there are any.
        last_seq: The number of its newest event.
        error: Why it failed, one sentence.
    """

    id: str
    kind: str
    rig_name: str
    state: State
    created_utc: datetime
    started_utc: datetime | None
    finished_utc: datetime | None
    plan: JsonObject
    progress: float
    headline: JsonObject | None
    last_seq: int
    error: str | None
    idempotency: Idempotency | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Run(RunSummary):
    """A run as recorded: the summary, and what is too large for a list.

    Attributes:
        prediction: As in :class:`NewRun`, like ``site`` to ``software``.
        result: What came out, once completed.
    """

    prediction: JsonObject | None
    site: JsonObject
    rig: JsonObject
    simulation: JsonObject | None
    software: JsonObject
    result: JsonObject | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RunEvent:
    """Something that happened in a run, durable before anybody hears of it.

    Attributes:
        run_id: The run.
        seq: Counts the run's events from 1, without a gap, through all its lives.
        time_utc: When.
        event: What; see the contract of the event stream for its data.
        data: A JSON object.
    """

    run_id: str
    seq: int
    time_utc: datetime
    event: EventName
    data: JsonObject


@dataclass(frozen=True, slots=True)
class Page:
    """A piece of the list of runs, newest first.

    Attributes:
        runs: The runs.
        next_cursor: Where the next piece begins, ``None`` after the last.
        total: How many there are in all the pieces.
    """

    runs: list[RunSummary]
    next_cursor: str | None
    total: int


@dataclass(frozen=True, slots=True, kw_only=True)
class VisitStatistics:
    """One measurement at one angle of the revolution.

    Attributes:
        index: Counts the run's visits from 0 in time order, through all segments.
        segment: Counts from 0; a resume or a long pause opens the next.
        direction: ``out`` or ``back``.
        angle_rad: The table's angle.
        gyro_mean_rad_s: Mean of the valid rates along the configured axis.
        gyro_sigma_rad_s: One standard deviation of that mean.
        accel_mean_g: Mean of the valid specific forces along the configured axis.
        accel_sigma_g: One standard deviation of that mean.
        samples: Gyro samples received.
        lost: Samples lost, of both streams.
        start_s: From the start of the run to the first sample.
        turned_rad: How far the gyro saw the table turn on the way, None where it cannot tell.
        repeats: The earlier visit whose angle this one measures again, to prove that nothing
            moved meanwhile; None for an ordinary visit.

    Raises:
        ValueError: A number is not finite.
    """

    index: int
    segment: int
    direction: str
    angle_rad: float
    gyro_mean_rad_s: float
    gyro_sigma_rad_s: float
    accel_mean_g: float
    accel_sigma_g: float
    samples: int
    lost: int
    start_s: float
    turned_rad: float | None
    repeats: int | None = None

    def __post_init__(self) -> None:
        for name in _VISIT_NUMBERS:
            value = getattr(self, name)
            if not math.isfinite(value):
                msg = f"visit {self.index}: {name} is {value}; a visit without a mean is no visit"
                raise ValueError(msg)


_VISIT_NUMBERS = (
    "angle_rad",
    "gyro_mean_rad_s",
    "gyro_sigma_rad_s",
    "accel_mean_g",
    "accel_sigma_g",
    "start_s",
)
