"""What is left after kill -9, SIGTERM and Ctrl-C, and how it goes on."""

import signal
import threading
import time
from pathlib import Path

import pytest

from tests.evidence import Record
from tests.service.process import (
    LONG,
    JsonObject,
    ServiceProcess,
    serving,
    stored,
    wait_until_ready,
)

PLAN = {"kind": "north-seek", "positions": 12, "dwell_s": 2, "settle_s": 0.1}


def begin(service: ServiceProcess, visits: int, plan: JsonObject = PLAN) -> str:
    wait_until_ready(service)
    run_id = service.start(plan)
    service.wait_for_visits(run_id, visits)
    return run_id


def test_a_killed_run_is_interrupted_at_the_next_start_and_can_be_resumed(tmp_path: Path) -> None:
    noise = {"NORTHFINDER_GYRO__NOISE_DEG_SQRT_H": "0.001"}
    with serving(tmp_path, **noise) as service:
        run_id = begin(service, 14)
        service.kill()
    with stored(tmp_path) as records:
        before = records.visits(run_id)
        assert records.run(run_id).state == "running"
        samples = [records.samples(run_id, visit.index) for visit in before]
    with serving(tmp_path, **noise) as service:
        wait_until_ready(service)
        run = service.run(run_id)
        assert (run["state"], run["steps"]) == ("interrupted", ["resume", "abort"])
        assert service.api.post(f"/runs/{run_id}/resume").status_code == 202
        result = service.wait(run_id, "completed", "failed")["result"]
        events = list(service.events(run_id))
    assert len(before) >= 14
    with stored(tmp_path) as records:
        after = records.visits(run_id)
        assert after[: len(before)] == before
        for visit, kept in zip(before, samples, strict=True):
            again = records.samples(run_id, visit.index)
            assert again["gyro"].value.tobytes() == kept["gyro"].value.tobytes()
    planned = [visit["angle_deg"] for visit in result["visits"] if visit["repeats"] is None]
    assert len(planned) == 24  # there and back: nothing twice, nothing missing
    assert [event.id for event in events] == list(range(1, len(events) + 1))
    assert abs(result["azimuth_deg"] - 48.0) < 4 * result["azimuth_sigma_deg"]


def test_only_the_own_rigs_run_is_interrupted(tmp_path: Path) -> None:
    """Two rigs share the records; the other one's run goes on."""
    with serving(tmp_path, "--sim-speed", "10", NORTHFINDER_SITE__NAME="North") as north:
        run_id = begin(north, 1, {**LONG, "dwell_s": 20})
        with serving(tmp_path, NORTHFINDER_SITE__NAME="South") as south:
            wait_until_ready(south)
            run = south.run(run_id)
            assert (run["rig_name"], run["state"]) == ("North", "running")
            refused = south.api.post(f"/runs/{run_id}/abort")
            assert (refused.status_code, refused.json()["run_id"]) == (409, run_id)
            north.api.post("/rig/stop")
            *_, last = south.events(run_id)
            assert last.data["state"] == "aborted"


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_an_orderly_end_stops_the_table_first_and_leaves_the_run_interrupted(
    tmp_path: Path, how: signal.Signals, record_property: Record
) -> None:
    """With open streams it takes less than 3 s; `serving` looks for tracebacks in the log."""
    seen: list[str] = []
    with serving(tmp_path, "--sim-speed", "20") as service:
        wait_until_ready(service)
        run_id = service.start(LONG)

        def listen() -> None:
            seen.extend(event.data.get("state", "") for event in service.events(run_id, "state"))

        listener = threading.Thread(target=listen)
        listener.start()
        service.wait_for_visits(run_id, 1)
        begun_s = time.monotonic()
        service.process.send_signal(how)
        listener.join(10.0)
        code = service.process.wait(10.0)
        took_s = time.monotonic() - begun_s
    record_property("measured", f"{how.name}: gone after {took_s:.1f} s")
    assert (took_s < 3.0, code) == (True, 0 if how == signal.SIGTERM else 130)
    assert seen == ["queued", "running", "interrupted"]
    with stored(tmp_path) as records:
        assert records.run(run_id).state == "interrupted"


def test_a_bench_that_moved_meanwhile_is_refused_in_words(tmp_path: Path) -> None:
    with serving(tmp_path) as service:
        run_id = begin(service, 13)
        service.kill()
    with serving(tmp_path, "--sim-azimuth", "50") as service:
        wait_until_ready(service)
        assert service.api.post(f"/runs/{run_id}/resume").status_code == 202
        run = service.wait(run_id)
    assert run["state"] == "failed"
    assert "the bench has moved since the visits before the interruption" in run["error"]
