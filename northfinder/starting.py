"""Where a heading hold starts from: a run of the records."""

from typing import TypeVar

from pydantic import BaseModel

from northfinder import records
from northfinder.errors import ConfigError
from northfinder.procedures import heading_hold

P = TypeVar("P", bound=BaseModel)

_FINDS_A_HEADING = ("north-seek", "alignment")


def with_start(plan: P, store: records.Records, rig_name: str) -> P:
    """Fill in the start of a heading hold from the run that it names; leave other plans alone.

    Without a name it is the rig's last north-seek or alignment that was completed.

    Raises:
        ConfigError: No run on this rig has found a heading, or the one that is named has not.
        UnknownRunError: No such run.
        RecordsError: The records cannot be read.
    """
    if not isinstance(plan, heading_hold.Plan) or plan.start is not None:
        return plan
    run = _last(store, rig_name) if plan.from_run is None else store.run(plan.from_run)
    return plan.model_copy(update={"start": _start(run, rig_name), "from_run": run.id})


def _last(store: records.Records, rig_name: str) -> records.Run:
    pages = [
        store.page(1, kind=kind, state="completed", rig_name=rig_name).runs
        for kind in _FINDS_A_HEADING
    ]
    found = [run for page in pages for run in page]
    if not found:
        msg = (
            f"no run on the rig {rig_name} has found a heading yet: find north or align first, "
            f"then hold it"
        )
        raise ConfigError(msg)
    return store.run(max(found, key=lambda run: run.id).id)


def _start(run: records.Run, rig_name: str) -> heading_hold.Start:
    if run.rig_name != rig_name:
        msg = f"run {run.id} was measured on the rig {run.rig_name}, this is {rig_name}"
        raise ConfigError(msg)
    if run.kind not in _FINDS_A_HEADING or run.result is None:
        msg = (
            f"run {run.id}, {run.kind}, is {run.state}: a heading is held from a completed "
            f"north-seek or alignment"
        )
        raise ConfigError(msg)
    table = run.result.get("tilt", run.result)
    latitude_deg = run.plan.get("latitude_deg")
    return heading_hold.Start(
        run_id=run.id,
        kind="alignment" if run.kind == "alignment" else "north-seek",
        azimuth_deg=run.result["azimuth_deg"],
        azimuth_sigma_deg=min(180.0, run.result["azimuth_sigma_deg"]),
        pitch_deg=table["pitch_deg"],
        roll_deg=table["roll_deg"],
        latitude_deg=run.site["latitude_deg"] if latitude_deg is None else latitude_deg,
    )
