"""`kill -9` at any moment of a run: what was measured stays, and the run can be carried on."""

import random
import time
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import pytest

from northfinder.records import Records, VisitStatistics
from tests.service.process import JsonObject, ServiceProcess, serving, stored, wait_until_ready

PLAN: JsonObject = {"kind": "north-seek", "positions": 12, "dwell_s": 2, "settle_s": 0.1}
VISITS = 24
MOST_EVENTS = 60  # of such a run; each visit is told by a progress, a visit and an estimate
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


def kill_at(service: ServiceProcess, moment: random.Random) -> str:
    """Begin a run and kill the service after some of its events and some thousandths more."""
    run_id = service.start(PLAN)
    with closing(service.events(run_id)) as events:
        assert list(islice(events, moment.randint(1, MOST_EVENTS)))
        time.sleep(moment.uniform(0.0, 0.03))  # the moment is what is tried here
        service.kill()
    return run_id


def carry_on(service: ServiceProcess, kept: Kept, folder: Path) -> None:
    """Resume the run, and hold its record against what was kept of it."""
    run = service.run(kept.run_id)
    assert (run["state"], run["steps"]) == ("interrupted", ["resume", "abort"])
    assert service.api.post(f"/runs/{kept.run_id}/resume").status_code == 202
    run = service.wait(kept.run_id)
    assert run["state"] == "completed", run["error"]
    result = run["result"]
    assert abs(result["azimuth_deg"] - AZIMUTH_DEG) < 4 * result["azimuth_sigma_deg"]
    planned = [visit for visit in result["visits"] if visit["repeats"] is None]
    assert len(planned) == VISITS
    with stored(folder) as records:
        assert Kept.of(records, kept.run_id, len(kept.visits)) == kept
        seqs = [event.seq for event in records.events(kept.run_id)]
        assert seqs == list(range(1, run["last_seq"] + 1))


def kill_and_carry_on(folder: Path, moments: int) -> None:
    """Do so as often, each time in a new process; a kill that came too late does not count."""
    moment, kept, survived = random.Random(50), None, 0
    while survived < moments:
        # The noise is given: a sigma from the scatter would be Student's, which 4 do not hold.
        with serving(
            folder, "--sim-speed", "200", NORTHFINDER_GYRO__NOISE_DEG_SQRT_H="0.001"
        ) as service:
            wait_until_ready(service)
            if kept is not None:
                carry_on(service, kept, folder)
                survived += 1
            run_id = kill_at(service, moment)
        with stored(folder) as records:
            is_over = records.run(run_id).state == "completed"
            kept = None if is_over else Kept.of(records, run_id)


@pytest.mark.slow
def test_three_killed_runs_keep_their_visits_and_find_north(tmp_path: Path) -> None:
    kill_and_carry_on(tmp_path, 3)


@pytest.mark.proof
@pytest.mark.timeout(1800)
def test_fifty_killed_runs_keep_their_visits_and_find_north(tmp_path: Path) -> None:
    kill_and_carry_on(tmp_path, 50)
