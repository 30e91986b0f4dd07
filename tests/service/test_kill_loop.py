"""`kill -9` at any moment of a run: what was measured stays, and the run can be carried on."""

import os
import random
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import pytest
from click.testing import CliRunner

from northfinder.cli import cli
from northfinder.records import Records, VisitStatistics
from tests.evidence import Record
from tests.service.process import JsonObject, ServiceProcess, serving, stored, wait_until_ready

PLAN: JsonObject = {"kind": "north-seek", "positions": 12, "dwell_s": 2, "settle_s": 0.1}
VISITS = 24
MOST_EVENTS = 60  # of such a run; each visit is told by a progress, a visit and an estimate
PROGRAM_VISITS = 20
SEEK = ("seek", "--positions", "12", "--dwell", "2", "--json")
NOISE = ("noise", "--duration", "300", "--json")  # 60 stretches
RIG = "Bench"
# A sigma from the scatter would be Student's, which 4 do not hold.
NOISE_GIVEN = {"NORTHFINDER_GYRO__NOISE_DEG_SQRT_H": "0.001"}
AZIMUTH_DEG = 48.0  # of the simulated rig


class Kept(NamedTuple):
    """What the records hold of a run when its process is dead."""

    run_id: str
    visits: list[VisitStatistics]
    samples: list[bytes]

    @classmethod
    def of(cls, records: Records, run_id: str, count: int | None = None) -> "Kept":
        visits = records.visits(run_id)[:count]
        blobs = [
            samples.value.tobytes() + samples.tick.tobytes()
            for visit in visits
            for _, samples in sorted(records.samples(run_id, visit.index).items())
        ]
        return cls(run_id, visits, blobs)


def kill_amid(service: ServiceProcess, run_id: str, after: int, moment: random.Random) -> int:
    """Kill the service after some of a run's events and some thousandths more.

    Returns:
        How many visits it had told of.
    """
    with closing(service.events(run_id, after=after)) as events:
        told = list(islice(events, moment.randint(1, MOST_EVENTS)))
        assert told
        time.sleep(moment.uniform(0.0, 0.03))  # the moment is what is tried here
        service.kill()
    return sum(event.event == "visit" for event in told)


def require_north(run: JsonObject) -> None:
    assert run["state"] == "completed", run["error"]
    result = run["result"]
    assert abs(result["azimuth_deg"] - AZIMUTH_DEG) < 4 * result["azimuth_sigma_deg"]
    planned = [visit for visit in result["visits"] if visit["repeats"] is None]
    assert len(planned) == VISITS


def require_kept(records: Records, kept: Kept, last_seq: int) -> None:
    """Hold the record against what was there when the process was dead."""
    assert Kept.of(records, kept.run_id, len(kept.visits)) == kept
    seqs = [event.seq for event in records.events(kept.run_id)]
    assert seqs == list(range(1, last_seq + 1))


def resume(service: ServiceProcess, kept: Kept) -> JsonObject:
    """Resume the run that was killed, and return what it was before."""
    run = service.run(kept.run_id)
    assert (run["state"], run["steps"]) == ("interrupted", ["resume", "abort"])
    assert service.api.post(f"/runs/{kept.run_id}/resume").status_code == 202
    return run


def carry_on(service: ServiceProcess, kept: Kept, folder: Path) -> None:
    """Resume the run until it has found north."""
    resume(service, kept)
    run = service.wait(kept.run_id)
    require_north(run)
    with stored(folder) as records:
        require_kept(records, kept, run["last_seq"])


def kill_and_carry_on(folder: Path, kills: int, seed: int = 50) -> None:
    """Kill as often, each time a new process; of three runs two are killed again when resumed.

    A kill that came after the end does not count.
    """
    moment, kept, survived = random.Random(seed), None, 0
    while True:
        with serving(folder, "--sim-speed", "200", **NOISE_GIVEN) as service:
            wait_until_ready(service)
            survived += kept is not None
            if kept is not None and survived < kills and moment.random() < 2 / 3:
                run_id, after = kept.run_id, resume(service, kept)["last_seq"]
            else:
                if kept is not None:
                    carry_on(service, kept, folder)
                if survived == kills:
                    return
                run_id, after, kept = service.start(PLAN), 0, None
            told = kill_amid(service, run_id, after, moment)
        kept = what_is_kept(folder, run_id, kept, told)


def what_is_kept(folder: Path, run_id: str, before: Kept | None, told: int) -> Kept | None:
    """Return what the records hold after a kill, no visit less than was told; None at the end."""
    with stored(folder) as records:
        if before is not None:
            assert Kept.of(records, run_id, len(before.visits)) == before
        kept = Kept.of(records, run_id)
        assert len(kept.visits) >= told + (0 if before is None else len(before.visits))
        run = records.run(run_id)
        if run.state != "completed":
            return kept
        assert run.result is not None
        assert abs(run.result["azimuth_deg"] - AZIMUTH_DEG) < 4 * run.result["azimuth_sigma_deg"]
        return None


def kill_program(folder: Path, arguments: tuple[str, ...], moment: random.Random) -> Kept:
    """Kill a program of its own some visits and some thousandths after its run began."""
    url = f"sqlite:///{folder / 'records.db'}"
    command = (sys.executable, "-m", "northfinder", *arguments, "--database", url)
    environ = {**os.environ, **NOISE_GIVEN}
    with stored(folder) as records:
        before = {run.id for run in records.page(1).runs}
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environ) as program:
            try:
                run_id = run_begun(records, before, moment.randrange(PROGRAM_VISITS))
                time.sleep(moment.uniform(0.0, 0.03))  # the moment is what is tried here
                seen = len(records.visits(run_id))
            finally:
                program.kill()
        kept = Kept.of(records, run_id)
    assert len(kept.visits) >= seen
    assert [visit.index for visit in kept.visits] == list(range(len(kept.visits)))
    return kept


def run_begun(records: Records, before: set[str], visits: int) -> str:
    """Wait until a new run has so many visits."""
    end_s = time.monotonic() + 60.0
    while True:
        begun = [run.id for run in records.page(1).runs if run.id not in before]
        if begun and len(records.visits(begun[0])) >= visits:
            return begun[0]
        assert time.monotonic() < end_s, f"no {visits} visits within a minute"
        time.sleep(0.002)


def kill_programs(folder: Path, kills: int) -> None:
    """Kill `seek` and `noise` in turn; a seek is carried on, a noise record is kept as it is."""
    moment, survived = random.Random(51), 0
    while survived < kills:
        seeks = survived % 2 == 0
        kept = kill_program(folder, SEEK if seeks else NOISE, moment)
        with stored(folder) as records:
            records.interrupt_abandoned(RIG)
            run = records.run(kept.run_id)
            assert Kept.of(records, kept.run_id) == kept
        if run.state == "completed":
            continue
        assert run.state == "interrupted"
        survived += 1
        if seeks:
            carry_on_alone(folder, kept)


def carry_on_alone(folder: Path, kept: Kept) -> None:
    """Resume with `northfinder runs resume`, in this process: its start is tried elsewhere."""
    url = f"sqlite:///{folder / 'records.db'}"
    command = ["runs", "resume", kept.run_id, "--json", "--database", url]
    done = CliRunner().invoke(cli, command, env=NOISE_GIVEN, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    with stored(folder) as records:
        run = records.run(kept.run_id)
        require_north({"state": run.state, "error": run.error, "result": run.result})
        require_kept(records, kept, run.last_seq)


@pytest.mark.slow
def test_three_killed_services_keep_their_visits_and_find_north(tmp_path: Path) -> None:
    kill_and_carry_on(tmp_path, 3)


@pytest.mark.slow
def test_two_killed_programs_keep_their_visits(tmp_path: Path) -> None:
    kill_programs(tmp_path, 2)


@pytest.mark.proof
@pytest.mark.timeout(1800)
def test_140_killed_services_keep_their_visits_and_find_north(
    tmp_path: Path, record_property: Record
) -> None:
    """With the programs', 200 kills; two benches at a time."""
    folders = [tmp_path / str(seed) for seed in (50, 51)]
    for folder in folders:
        folder.mkdir()
    with ThreadPoolExecutor(len(folders)) as pool:
        loops = [pool.submit(kill_and_carry_on, each, 70, int(each.name)) for each in folders]
        for loop in loops:
            loop.result()
    record_property("measured", "140 of 140 services")


@pytest.mark.proof
@pytest.mark.timeout(900)
def test_60_killed_programs_keep_their_visits_and_find_north(
    tmp_path: Path, record_property: Record
) -> None:
    kill_programs(tmp_path, 60)
    record_property("measured", "60 of 60 programs")
