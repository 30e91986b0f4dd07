"""One cell of the fault matrix: a whole run by real drivers and bytes, one fault, one moment."""

import asyncio
import math
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, cast

from drivers.errors import DriverError
from northfinder import records
from northfinder.config import RigConfig, load_config
from northfinder.errors import NorthfinderError
from northfinder.formatting import sentence_of
from northfinder.procedures import north_seek
from northfinder.procedures.events import Event, Progress, VisitCompleted
from northfinder.procedures.north_seek import Plan
from northfinder.procedures.plain_json import progress_json
from northfinder.proof.fault_disks import Disk
from northfinder.proof.fault_kinds import Fault, RigName, Scene
from northfinder.recording import begin
from northfinder.rig import JsonObject, Rig
from northfinder.wiring import SimulatedWorld, build_rig, event_loop
from sim.motion import Plate

Moment = Literal["homing", "moving", "settling", "dwelling", "solving"]
Verdict = Literal["harmless", "told", "silent", "defect"]

MOMENTS: Final[tuple[Moment, ...]] = ("homing", "moving", "settling", "dwelling", "solving")
WRONG_SIGMAS: Final = 4.0
_PLAN: Final = Plan(positions=6, dwell_s=1.0, settle_s=0.1)
_STRUCK_VISIT: Final = 4  # of twelve, on the way out
_LATITUDE_DEG: Final = 40.0
_GYRO_NOISE, _FORCE_NOISE = 3e-4, 1e-5  # deg/sqrt(h), g/sqrt(Hz): a good gyro's
_LONGEST_S: Final = 600.0  # of a run that takes half a minute
_LOOK_S, _WATCHED_S = 0.01, 5.0
#: After the table has come to rest at the struck visit.
_AFTER_REST_S: Final = {"settling": 0.15, "dwelling": 0.6}
_PROJECT_ERRORS = (NorthfinderError, DriverError)

_CAN: Final[dict[str, dict[str, Any]]] = {
    "turntable": {"driver": "cia402"},
    "gyro": {
        "driver": "dbc",
        "file": "northfinder-fog.dbc",
        "message": "FOG_RATE",
        "signal": "rate",
        "counter": "counter",
        "status": "status",
        "checksum": "crc",
    },
    "accelerometer": {"driver": "cia410"},
}
_SECTIONS: Final[dict[RigName, dict[str, dict[str, Any]]]] = {"serial": {}, "can": _CAN}


@dataclass(frozen=True, slots=True)
class Cell:
    """One run of the matrix."""

    fault: Fault
    moment: Moment
    rig: RigName
    seed: int


@dataclass(slots=True)
class Outcome:
    """What became of it.

    Attributes:
        verdict: ``harmless``: north within 4 stated sigma. ``told``: the run failed in its own
            words, or north is wrong and a check fails. ``silent``: north is wrong and no check
            fails. ``defect``: something was raised that nobody meant to raise.
        said: The sentence of the failure, or of the checks that did not pass.
        checks: Names of those that warned or failed.
        sigmas: By how many stated sigma north is off; NaN where there is none.
        stood_after_s: From the end of the run to the table's rest; infinite where it was moved
            again.
        kept: Completed visits that are kept.
        lost: Completed visits that are not in the records afterwards.
        noticed_s: From the stroke to the end of the run, loop time; NaN where it did not fail.
    """

    verdict: Verdict = "defect"
    said: str = ""
    checks: tuple[str, ...] = ()
    sigmas: float = math.nan
    stood_after_s: float = math.inf
    kept: int = 0
    lost: int = 0
    noticed_s: float = math.nan


@dataclass(slots=True)
class _Life:
    """A run as it goes on: strikes at its moment, and remembers."""

    cell: Cell
    scene: Scene
    struck_s: float = math.nan
    truth_deg: float = math.nan
    visits: int = 0
    _tasks: list[asyncio.Task[None]] = field(default_factory=list)

    def see(self, event: JsonObject | None) -> None:
        """Take note of progress, or of a visit (None)."""
        if event is None:
            self.visits += 1
            self.truth_deg = float(self.scene.simulation.truth()["azimuth_deg"])
        elif math.isnan(self.struck_s) and not self._tasks and self._is_due(event):
            if event["phase"] == "solving":
                self._strike()
            else:
                self._tasks.append(asyncio.create_task(self._wait_and_strike()))

    async def end(self) -> None:
        """Raise what went wrong with the striking itself."""
        for task in self._tasks:
            task.cancel()
            await asyncio.wait([task])
            if not task.cancelled():
                task.result()

    def _is_due(self, event: JsonObject) -> bool:
        moment = self.cell.moment
        if moment in ("homing", "solving"):
            return bool(event["phase"] == moment)
        return bool(event["phase"] == "measuring" and event["visit"] == _STRUCK_VISIT)

    async def _wait_and_strike(self) -> None:
        loop, plate = asyncio.get_running_loop(), self.scene.world.plate
        while plate.end_s <= loop.time():  # noqa: ASYNC110 -- a plate tells nobody that it turns
            await asyncio.sleep(_LOOK_S)
        left_s = plate.end_s - loop.time()
        later_s = _AFTER_REST_S.get(self.cell.moment)
        await asyncio.sleep(left_s / 2 if later_s is None else left_s + later_s)
        self._strike()

    def _strike(self) -> None:
        self.struck_s = asyncio.get_running_loop().time()
        self.cell.fault.strike(self.scene)


def live(cell: Cell) -> Outcome:
    """Carry the run out in virtual time and judge what became of it."""
    config = _config(cell)
    strays: list[str] = []
    with ExitStack() as stack:
        disk = None
        if cell.fault.is_recorded:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            disk = stack.enter_context(Disk(Path(folder)))
        runner = stack.enter_context(asyncio.Runner(loop_factory=event_loop(config, math.inf)))
        runner.get_loop().set_exception_handler(
            lambda _, context: strays.append(str(context.get("exception") or context["message"]))
        )
        try:
            outcome = runner.run(_live(cell, config, disk))
        except Exception as error:  # noqa: BLE001 -- a traceback is what the matrix looks for
            return Outcome("defect", f"{type(error).__name__}: {error}")
    if strays:
        outcome.verdict, outcome.said = "defect", "; ".join(strays)
    return outcome


def azimuth_deg(seed: int) -> float:
    """Return the truth of a seed: all round the circle."""
    return (48.0 + 73.0 * seed) % 360.0


def _config(cell: Cell) -> RigConfig:
    sections = _SECTIONS[cell.rig]
    return load_config(
        None,
        {},
        {
            **sections,
            "site": {"latitude_deg": _LATITUDE_DEG},
            "gyro": {**sections.get("gyro", {}), "noise_deg_sqrt_h": _GYRO_NOISE},
            "accelerometer": {**sections.get("accelerometer", {}), "noise_g_sqrt_hz": _FORCE_NOISE},
            "simulation": {
                "seed": cell.seed,
                "azimuth_deg": azimuth_deg(cell.seed),
                "gyro_noise_deg_sqrt_h": _GYRO_NOISE,
                "accel_noise_g_sqrt_hz": _FORCE_NOISE,
            },
        },
    )


async def _live(cell: Cell, config: RigConfig, disk: Disk | None) -> Outcome:
    outcome = Outcome()
    async with asyncio.timeout(_LONGEST_S), build_rig(config) as rig:
        simulation = cast("SimulatedWorld", rig.simulation)
        life = _Life(cell, Scene(simulation.world, simulation, disk))
        try:
            carry_out = _carry_out if disk is None else _record
            result = await carry_out(rig, life, outcome)
            _judge(outcome, result, life.truth_deg)
        except _PROJECT_ERRORS as error:
            outcome.verdict, outcome.said = "told", sentence_of(error)
            outcome.noticed_s = asyncio.get_running_loop().time() - life.struck_s
        finally:
            await life.end()
        await _look_at_the_table(simulation.world.plate, outcome)
        outcome.kept = life.visits - outcome.lost
    return outcome


def _plan(cell: Cell) -> Plan:
    latitude_deg = _LATITUDE_DEG + cell.fault.latitude_off_deg
    return _PLAN.model_copy(update={"latitude_deg": latitude_deg})


async def _carry_out(rig: Rig, life: _Life, _: Outcome) -> JsonObject:
    async def emit(event: Event) -> None:
        if isinstance(event, VisitCompleted):
            life.see(None)
        elif isinstance(event, Progress):
            life.see(progress_json(event))

    plan = north_seek.predict(_plan(life.cell), rig).plan
    return north_seek.result_json(await north_seek.run(rig, plan, emit))


async def _record(rig: Rig, life: _Life, outcome: Outcome) -> JsonObject:
    """The same, recorded; afterwards the disk is mended and the record is looked at."""
    disk = life.scene.disk
    assert disk is not None  # noqa: S101 -- for the type checker: the caller has seen to it

    def publish(event: records.RunEvent) -> None:
        if event.event == "visit":
            life.see(None)
        elif event.event == "progress":
            life.see(event.data)

    with records.Records.open(disk.url) as store:
        async with records.Writer(store) as writer:
            run = await begin(rig, _plan(life.cell), writer, publish)
            try:
                return await run.carry_out()
            finally:
                disk.mend()
                await run.settle()
                outcome.lost = life.visits - len(store.visits(run.id))


def _judge(outcome: Outcome, result: JsonObject, truth_deg: float) -> None:
    """Hold a result against where the bench stood when the last visit ended."""
    off_deg = math.remainder(result["azimuth_deg"] - truth_deg, 360.0)
    outcome.sigmas = abs(off_deg) / float(result["azimuth_sigma_deg"])
    remarks = [check for check in result["checks"] if check["status"] != "pass"]
    outcome.checks = tuple(f"{check['name']} {check['status']}s" for check in remarks)
    outcome.said = " ".join(check["detail"] for check in remarks)
    if outcome.sigmas <= WRONG_SIGMAS:
        outcome.verdict = "harmless"
    else:
        failed = any(check["status"] == "fail" for check in remarks)
        outcome.verdict = "told" if failed else "silent"


async def _look_at_the_table(plate: Plate, outcome: Outcome) -> None:
    """A table out of reach may still end the one move it was given; never more than that."""
    ended_s, end_s = asyncio.get_running_loop().time(), plate.end_s
    await asyncio.sleep(max(0.0, end_s - ended_s) + _WATCHED_S)
    if plate.end_s == end_s:
        outcome.stood_after_s = max(0.0, end_s - ended_s)
