"""From the records back to a run: computed again, or carried on."""

from datetime import UTC, datetime
from typing import NamedTuple

from pydantic import BaseModel

from northfinder import records
from northfinder.config import RigConfig
from northfinder.errors import ConfigError, NorthfinderError
from northfinder.procedures.inertial import restored
from northfinder.procedures.kinds import PROCEDURES
from northfinder.procedures.visits import Visit
from northfinder.rig import JsonObject, Rig
from northfinder.validation import validated


class Past(NamedTuple):
    """What a resumed run brings along.

    Attributes:
        visits: The completed ones, in time order.
        elapsed_s: From the start of the run to now.
    """

    visits: tuple[Visit, ...]
    elapsed_s: float


def recompute(store: records.Records, run_id: str) -> JsonObject:
    """Compute a recorded run's result again from its stored samples.

    Raises:
        RecordsError: No such run, or its samples are damaged.
        NorthfinderError: It has no visits, or they do not determine the result.
    """
    run = store.run(run_id)
    config = validated(RigConfig, run.rig["config"], f"run {run.id}")
    procedure = PROCEDURES[run.kind]
    visits = visits_of(store, run)
    if not visits:
        msg = f"run {run.id} is {run.state} and has no visit to compute anything from"
        raise NorthfinderError(msg)
    result = procedure.reduce_visits(visits, plan_of(run), config)
    rig_after = run.result["rig"] if run.result is not None else run.rig
    return {**frame(run, run.state), "rig": rig_after, **procedure.result_json(result)}


def plan_of(run: records.Run) -> BaseModel:
    """Return a recorded run's plan."""
    plan: BaseModel = validated(PROCEDURES[run.kind].Plan, run.plan, f"run {run.id}")
    return plan


def past_of(store: records.Records, run: records.Run) -> Past:
    """Return what a run has measured, to carry on from there.

    Raises:
        RecordsError: Its samples are damaged.
    """
    visits = visits_of(store, run)
    since_utc = run.started_utc or run.created_utc
    clock_s = (datetime.now(UTC) - since_utc).total_seconds()
    # In simulated time more may have passed than the clock says.
    measured_s = max((visit.start_s + visit.duration_s for visit in visits), default=0.0)
    return Past(tuple(visits), max(clock_s, measured_s))


def visits_of(store: records.Records, run: records.Run) -> list[Visit]:
    """Return a run's visits with their samples, in time order.

    Raises:
        RecordsError: Its samples are damaged.
    """
    return [_with_samples(store, run, entry) for entry in store.visits(run.id)]


def estimates_of(store: records.Records, run_id: str) -> list[JsonObject]:
    """Return what a run told of north so far, in time order; the certificate draws it.

    Raises:
        UnknownRunError: No such run.
    """
    found: list[JsonObject] = []
    after = 0
    while events := store.events(run_id, after):
        found += [event.data for event in events if event.event == "estimate"]
        after = events[-1].seq
    return found


#: What decides what a reading means; a port may change between two lives of a run.
_MUST_BE_EQUAL = {
    "site": ("latitude_deg", "latitude_sigma_deg", "height_m", "gravity_m_s2"),
    "turntable": ("driver", "angle_sigma_deg", "positive_direction"),
    "gyro": ("driver", "axis", "mount_angle_deg", "noise_deg_sqrt_h", "scale_factor_sigma_ppm"),
    "accelerometer": ("driver", "from", "axis", "mount_angle_deg", "noise_g_sqrt_hz"),
}


def require_same_bench(rig: Rig, run: records.Run) -> None:
    """Refuse to carry a run on with another configuration or other instruments.

    Raises:
        ConfigError: They differ; the message says in what.
    """
    now = rig.config.model_dump(mode="json", by_alias=True)
    then = run.rig["config"]
    for section, keys in _MUST_BE_EQUAL.items():
        for key in keys:
            if now[section][key] != then[section][key]:
                _refuse(run, f"[{section}] {key}", then[section][key], now[section][key])
    for device_then, device_now in zip(run.rig["devices"], rig.devices(), strict=True):
        for key in ("model", "serial_number"):
            was, is_now = device_then["identity"][key], device_now["identity"][key]
            if was != is_now:
                _refuse(run, f"the {device_now['role']}'s {key.replace('_', ' ')}", was, is_now)


def _refuse(run: records.Run, what: str, then: object, now: object) -> None:
    msg = (
        f"run {run.id} cannot be resumed: {what} was {then} and is {now} now, so that its visits "
        f"do not belong together; change it back, or end the run and start a new one"
    )
    raise ConfigError(msg)


def frame(run: records.Run, state: records.State) -> JsonObject:
    """Return what surrounds the numbers of a result; it comes from the record alone."""
    return {
        "kind": run.kind,
        "state": state,
        "run_id": run.id,
        "plan": run.plan,
        "site": run.site,
        "rig": run.rig,
        "simulation": run.simulation,
        "software": run.software,
    }


def _with_samples(
    store: records.Records, run: records.Run, entry: records.VisitStatistics
) -> Visit:
    return restored(
        store.samples(run.id, entry.index),
        run.rig["config"]["gyro"]["axis"],
        index=entry.index,
        segment=entry.segment,
        repeats=entry.repeats,
        direction="back" if entry.direction == "back" else "out",
        angle_rad=entry.angle_rad,
        start_s=entry.start_s,
        turned_rad=entry.turned_rad,
    )
