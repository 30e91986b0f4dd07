"""What the service answers with; degrees, seconds, ISO 8601 instants in UTC."""

from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from drivers.interfaces import Role
from northfinder.config import BaseMotion, SimulationConfig
from northfinder.procedures import alignment, heading_hold, noise, north_seek
from northfinder.procedures.kinds import PROCEDURES
from northfinder.records import Run, RunSummary, State
from northfinder.records.states import LEGAL_STEPS
from northfinder.wiring.faults import SensorFaultSettings, TableFaultSettings

JsonObject = dict[str, Any]
Step = Literal["pause", "resume", "abort"]


class NorthSeekRequest(north_seek.Plan):
    """A north-seek; everything but the kind may be left out, as in every request."""

    model_config = ConfigDict(strict=True)  # true is no latitude of 1 degree

    kind: Literal["north-seek"]


class AlignmentRequest(alignment.Wish):
    """An alignment, on a base that may rock."""

    model_config = ConfigDict(strict=True)

    kind: Literal["alignment"]


class NoiseRequest(noise.Wish):
    """A static record, and the noise in it."""

    model_config = ConfigDict(strict=True)

    kind: Literal["noise"]


class HeadingHoldRequest(heading_hold.Wish):
    """Keeping the heading that a run found."""

    model_config = ConfigDict(strict=True)

    kind: Literal["heading-hold"]


#: A run to start, or to predict.
RunRequest = Annotated[
    NorthSeekRequest | AlignmentRequest | NoiseRequest | HeadingHoldRequest,
    Field(discriminator="kind"),
]


def plan_of_request(request: BaseModel) -> BaseModel:
    """Return the plan that a request asks for, of its own procedure."""
    given = request.model_dump()
    plan: BaseModel = PROCEDURES[given["kind"]].Plan(**given)
    return plan


class BudgetLine(BaseModel):
    """One source of uncertainty: one sigma, and its share of the variance."""

    source: str
    u_deg: float
    share: float


class ScheduledVisit(BaseModel):
    """One stop of the table."""

    angle_deg: float
    direction: str


class Prediction(BaseModel):
    """What a plan would take and bring; device time, one sigma.

    A static record promises no azimuth, and only a north-seek has a schedule of angles; where its
    plan left something open, ``chosen`` says what was taken and why.
    """

    duration_s: float
    azimuth_sigma_deg: float | None = None
    motion_limits: JsonObject | None = None
    budget: list[BudgetLine] = []
    warnings: list[str]
    chosen: str | None = None
    plan: JsonObject
    schedule: list[ScheduledVisit] = []


class CheckCounts(BaseModel):
    """How many checks passed, warned and failed."""

    model_config = ConfigDict(populate_by_name=True)

    passed: Annotated[int, Field(alias="pass")]
    warn: int
    fail: int


class Summary(BaseModel):
    """A run as the history shows it; azimuth and checks are those so far until it has ended.

    A static record has no azimuth; its figure is the gyro's angle random walk, in words.
    """

    run_id: str
    kind: str
    rig_name: str
    state: State
    created: datetime
    started: datetime | None
    finished: datetime | None
    progress: float
    plan: JsonObject
    azimuth_deg: float | None
    azimuth_sigma_deg: float | None
    figure: str | None
    checks: CheckCounts | None
    attention: list[str]
    error: str | None

    @classmethod
    def of(cls, run: Run | RunSummary) -> Self:
        """Return a recorded run's."""
        return cls(**_summary(run))


class Detail(Summary):
    """A run with everything that is known of it but its raw samples and events."""

    site: JsonObject
    rig: JsonObject
    simulation: JsonObject | None
    software: JsonObject
    prediction: JsonObject | None
    result: JsonObject | None
    steps: list[Step]
    last_seq: int

    @classmethod
    def of_run(cls, run: Run, *, pausing: bool) -> Self:
        """Return a recorded run's; one that will pause says so by its steps."""
        return cls(
            **_summary(run),
            site=run.site,
            rig=run.rig,
            simulation=run.simulation,
            software=run.software,
            prediction=run.prediction,
            result=run.result,
            steps=steps_of(run, pausing=pausing),
            last_seq=run.last_seq,
        )


class RunPage(BaseModel):
    """A page of the history, newest first; the cursor leads to the next."""

    runs: list[Summary]
    next_cursor: str | None
    total: int


class Visits(BaseModel):
    """A run's visits in time order."""

    visits: list[JsonObject]


class Stopped(BaseModel):
    """The table stands; the run that was ended by it."""

    stopped: bool
    run_id: str | None


class Table(BaseModel):
    """The table, counter-clockwise seen from above."""

    angle_deg: float
    moving: bool
    homed: bool
    target_deg: float | None


class Identity(BaseModel):
    """Who answered."""

    vendor: str
    model: str
    serial_number: str
    firmware: str


class Counters(BaseModel):
    """What has come over a link since it was opened."""

    frames: int
    crc_errors: int
    lost: int
    reconnects: int


class Device(BaseModel):
    """One instrument; what it has not told yet is null."""

    role: str
    driver: str
    link: str
    identity: Identity | None
    state: Literal["ok", "silent", "offline", "fault"]
    detail: str | None
    rate_hz: float | None
    temperature_deg_c: float | None
    reading: float | None
    reading_unit: str | None
    counters: Counters


class Database(BaseModel):
    """Whether runs can be recorded."""

    ok: bool
    detail: str | None


class Rig(BaseModel):
    """The rig as it is now."""

    name: str
    site: JsonObject
    simulated: bool
    speed: float | None
    state: Literal["starting", "ready", "busy", "offline"]
    detail: str | None
    run_id: str | None
    last_run_id: str | None
    table: Table | None
    devices: list[Device]
    database: Database
    software: JsonObject


class SimulationSettings(BaseModel):
    """The simulated world's truth: where the bench really stands, and how its sensors err."""

    azimuth_deg: float
    pitch_deg: float
    roll_deg: float
    gyro_noise_deg_sqrt_h: float
    gyro_bias_deg_h: float
    gyro_drift_deg_h_h: float
    gyro_bias_instability_deg_h: float
    accel_noise_g_sqrt_hz: float
    base: BaseMotion
    seed: int


def _whatever_is_given(schema: JsonObject) -> None:
    """Describe what may be changed: what is left out stays as it is, whatever its default."""
    for fixed in ("seed", "speed"):
        schema["properties"].pop(fixed, None)
    for described in schema["properties"].values():
        described.pop("default", None)


class SimulationChanges(SimulationConfig):
    """Some of the simulated world's truth."""

    model_config = ConfigDict(
        strict=True,
        json_schema_extra=_whatever_is_given,
    )


class FaultChanges(TableFaultSettings, SensorFaultSettings):
    """Some faults of one simulated device: of its wire, and the turntable's or a sensor's own."""

    model_config = ConfigDict(
        strict=True,
        json_schema_extra=_whatever_is_given,
    )

    device: Role


class Faults(BaseModel):
    """The faults of each simulated device."""

    faults: dict[str, JsonObject]


def steps_of(run: RunSummary, *, pausing: bool) -> list[Step]:
    """Return what may be asked of a run; one that is about to pause may be told to go on."""
    return legal_steps(run.state, pausing=pausing, resumable=PROCEDURES[run.kind].RESUMABLE)


def legal_steps(state: State, *, pausing: bool, resumable: bool = True) -> list[Step]:
    """Return what may be asked of a run in a state."""
    steps: list[Step] = []
    legal = LEGAL_STEPS[state]
    if resumable and "paused" in legal and not pausing:
        steps.append("pause")
    waits = state in {"paused", "failed", "interrupted"} or (state == "running" and pausing)
    if resumable and waits:
        steps.append("resume")
    if "aborted" in legal:
        steps.append("abort")
    return steps


def _summary(run: Run | RunSummary) -> JsonObject:
    headline = run.headline or {}
    return {
        "run_id": run.id,
        "kind": run.kind,
        "rig_name": run.rig_name,
        "state": run.state,
        "created": run.created_utc,
        "started": run.started_utc,
        "finished": run.finished_utc,
        "progress": run.progress,
        "plan": run.plan,
        "azimuth_deg": headline.get("azimuth_deg"),
        "azimuth_sigma_deg": headline.get("azimuth_sigma_deg"),
        "figure": headline.get("figure"),
        "checks": headline.get("checks"),
        "attention": headline.get("attention", []),
        "error": run.error,
    }
