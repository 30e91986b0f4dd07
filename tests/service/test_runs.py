"""Runs over REST: one at a time, followed live, paused, resumed, aborted."""

import re
import time
from contextlib import closing
from itertools import islice, pairwise
from typing import Any

import httpx
import pytest

from tests.service.process import LONG, SHORT, ServiceProcess, events_of


@pytest.fixture(autouse=True)
def idle(service: ServiceProcess) -> None:
    """No test leaves a run behind for the next."""
    run_id = service.api.get("/rig").json()["run_id"]
    if run_id is not None:
        service.api.post("/rig/stop")
        service.wait(run_id)
    service.api.delete("/rig/simulation/faults")


def test_a_run_is_accepted_and_brings_north(service: ServiceProcess) -> None:
    answer = service.api.post("/runs", json={"kind": "north-seek", "positions": 24, "dwell_s": 1})
    assert answer.status_code == 202
    assert answer.headers["location"] == f"/api/v1/runs/{answer.json()['run_id']}"
    run = service.wait(answer.json()["run_id"])
    assert (run["state"], run["progress"], run["error"]) == ("completed", 1.0, None)
    result = run["result"]
    assert abs(result["azimuth_deg"] - 48.0) < 4 * result["azimuth_sigma_deg"]
    assert (run["azimuth_deg"], run["steps"]) == (result["azimuth_deg"], [])


def test_a_second_run_is_refused_and_the_first_is_named(service: ServiceProcess) -> None:
    first = service.start(LONG)
    answer = service.api.post("/runs", json=SHORT)
    assert answer.status_code == 409
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["run_id"] == first
    assert first in answer.json()["detail"]


def test_the_stream_tells_every_event_once_and_ends_with_the_run(service: ServiceProcess) -> None:
    run_id = service.start()
    events = list(service.events(run_id))
    assert [event.id for event in events] == list(range(1, len(events) + 1))
    assert all(event.data["seq"] == event.id and event.data["time"] for event in events)
    assert {event.event for event in events} == {"state", "progress", "visit", "estimate", "result"}
    assert events[-1].data["state"] == "completed"
    assert service.run(run_id)["last_seq"] == len(events)


def test_a_stream_that_was_cut_goes_on_without_loss_or_repeat(service: ServiceProcess) -> None:
    run_id = service.start()
    seen: list[int | None] = []
    while not seen or seen[-1] != service.run(run_id)["last_seq"]:
        after = seen[-1] if seen else None
        with closing(service.events(run_id, after=after)) as stream:
            seen += [event.id for event in islice(stream, 3)]
    assert seen == list(range(1, len(seen) + 1))


def test_the_stream_of_a_finished_run_is_its_record(service: ServiceProcess) -> None:
    run_id = service.start()
    live = [event.data for event in service.events(run_id)]
    assert [event.data for event in service.events(run_id)] == live
    assert list(service.events(run_id, after=len(live))) == []


def test_a_repeated_request_starts_no_second_run(service: ServiceProcess) -> None:
    headers = {"Idempotency-Key": f"request-{time.monotonic_ns()}"}
    first = service.api.post("/runs", json=SHORT, headers=headers)
    again = service.api.post("/runs", json=SHORT, headers=headers)
    assert (first.status_code, again.status_code) == (202, 202)
    assert again.json()["run_id"] == first.json()["run_id"]
    other = service.api.post("/runs", json=LONG, headers=headers)
    assert other.status_code == 422
    assert first.json()["run_id"] in other.json()["detail"]


def test_a_paused_run_waits_and_goes_on(service: ServiceProcess) -> None:
    run_id = service.start({**SHORT, "positions": 8})
    service.wait_for_visits(run_id, 2)
    assert service.api.post(f"/runs/{run_id}/pause").status_code == 202
    paused = service.wait(run_id, "paused")
    assert paused["steps"] == ["resume", "abort"]
    assert service.api.post(f"/runs/{run_id}/resume").status_code == 202
    assert service.wait(run_id)["state"] == "completed"


def test_an_aborted_run_keeps_its_visits_and_stays_aborted(service: ServiceProcess) -> None:
    run_id = service.start(LONG)
    service.wait_for_visits(run_id, 2)
    assert service.api.post(f"/runs/{run_id}/abort").json()["state"] == "aborted"
    assert service.api.post(f"/runs/{run_id}/abort").status_code == 202
    assert len(service.api.get(f"/runs/{run_id}/visits").json()["visits"]) >= 2
    refused = service.api.post(f"/runs/{run_id}/resume")
    assert (refused.status_code, refused.json()["steps"]) == (409, [])


def test_stop_stops_the_table_and_aborts_the_run(service: ServiceProcess) -> None:
    run_id = service.start(LONG)
    service.wait_for_visits(run_id, 1)
    answer = service.api.post("/rig/stop")
    assert answer.json() == {"stopped": True, "run_id": run_id}
    assert service.run(run_id)["state"] == "aborted"
    rig = service.api.get("/rig").json()
    assert (rig["state"], rig["run_id"], rig["table"]["moving"]) == ("ready", None, False)
    assert service.api.post("/rig/stop").json() == {"stopped": True, "run_id": None}


def test_a_stalled_table_fails_the_run_in_words_and_it_can_be_resumed(
    service: ServiceProcess,
) -> None:
    run_id = service.start(SHORT)
    fault = {"device": "turntable", "short_by_deg": 0.31}
    assert service.api.post("/rig/simulation/faults", json=fault).status_code == 200
    run = service.wait(run_id)
    assert (run["state"], run["steps"]) == ("failed", ["resume", "abort"])
    # The plate still swings by some thousandths when its stop is read.
    assert re.search(r"0\.3\d? deg short of", run["error"])
    service.api.delete("/rig/simulation/faults")
    assert service.api.post(f"/runs/{run_id}/resume").status_code == 202
    assert service.wait(run_id)["state"] == "completed"


def test_a_failed_run_can_be_ended_for_good(service: ServiceProcess) -> None:
    run_id = service.start(SHORT)
    service.api.post("/rig/simulation/faults", json={"device": "turntable", "short_by_deg": 1})
    service.wait(run_id, "failed")
    assert service.api.post(f"/runs/{run_id}/abort").json()["state"] == "aborted"
    *_, last = service.events(run_id)
    assert last.data["state"] == "aborted"


def test_the_history_comes_in_pages_newest_first(service: ServiceProcess) -> None:
    for _ in range(3):
        service.wait(service.start())
    everything = service.api.get("/runs", params={"limit": 200}).json()
    ids = [run["run_id"] for run in everything["runs"]]
    created = [run["created"] for run in everything["runs"]]
    assert all(newer > older for newer, older in pairwise(created))
    paged: list[str] = []
    cursor: str | None = None
    while True:
        params: dict[str, Any] = {"limit": 2} | ({"cursor": cursor} if cursor else {})
        page = service.api.get("/runs", params=params).json()
        paged += [run["run_id"] for run in page["runs"]]
        cursor = page["next_cursor"]
        if cursor is None:
            break
    assert paged == ids
    states = service.api.get("/runs", params={"state": "completed"}).json()["runs"]
    assert {run["state"] for run in states} == {"completed"}
    assert service.api.get("/runs", params={"rig": "elsewhere"}).json()["runs"] == []


@pytest.mark.parametrize(
    ("body", "field", "says"),
    [
        ({}, "body.kind", "required"),
        ({"kind": "north-seek", "positions": 2}, "body.positions", "3"),
        ({"kind": "north-seek", "dwell_s": -1}, "body.dwell_s", "0"),
        ({"kind": "north-seek", "order": "zigzag"}, "body.order", "out-and-back"),
        ({"kind": "north-seek", "latitude_deg": 89.5}, "body.latitude_deg", "89"),
        ({"kind": "north-seek", "speed": 3}, "body.speed", "not a known field"),
        ({"kind": "south-seek"}, "body.kind", "north-seek"),
    ],
)
def test_a_wrong_field_is_named_with_its_limits(
    service: ServiceProcess, body: dict[str, Any], field: str, says: str
) -> None:
    for path in ("/runs", "/plans"):
        answer = service.api.post(path, json=body)
        assert answer.status_code == 422
        (error,) = answer.json()["errors"]
        assert error["field"] == field
        assert says in error["message"]


@pytest.mark.parametrize("run_id", ["nothing", "20200101T000000Z-abcdef", "%00", "a" * 300])
def test_an_unknown_run_is_404_everywhere(service: ServiceProcess, run_id: str) -> None:
    for path in ("", "/events", "/visits", "/samples", "/report.html", "/result.json"):
        assert service.api.get(f"/runs/{run_id}{path}").status_code == 404
    for step in ("pause", "resume", "abort"):
        assert service.api.post(f"/runs/{run_id}/{step}").status_code == 404


def test_a_plan_promises_what_the_run_then_does(service: ServiceProcess) -> None:
    plan = service.api.post("/plans", json=SHORT).json()
    run = service.wait(service.start())
    assert run["prediction"]["duration_s"] == plan["duration_s"]
    assert [visit["angle_deg"] for visit in plan["schedule"]] == pytest.approx(
        [visit["angle_deg"] for visit in run["result"]["visits"]]
    )


def test_the_rig_is_told_as_it_moves(service: ServiceProcess) -> None:
    angles = set()
    with httpx.stream("GET", f"{service.address}/api/v1/rig/events", timeout=20.0) as stream:
        service.start(LONG)
        for event in events_of(stream):
            assert event.event == "rig"
            angles.add(event.data["table"]["angle_deg"])
            if len(angles) > 10:
                break
    roles = [device["role"] for device in event.data["devices"]]
    assert roles == ["turntable", "gyro", "accelerometer"]
    assert {device["state"] for device in event.data["devices"]} == {"ok"}


def test_the_simulated_truth_can_be_changed_and_shows_in_the_result(
    service: ServiceProcess,
) -> None:
    service.api.patch("/rig/simulation", json={"azimuth_deg": 100.0})
    try:
        result = service.wait(service.start({**SHORT, "dwell_s": 2}))["result"]
    finally:
        service.api.patch("/rig/simulation", json={"azimuth_deg": 48.0})
    # Four angles estimate their sigma from four degrees of freedom: a fixed bound does not flicker.
    assert result["azimuth_deg"] == pytest.approx(100.0, abs=5.0)
    assert result["simulation"]["azimuth_deg"] == 100.0
    wrong = service.api.patch("/rig/simulation", json={"pitch_deg": 99})
    assert wrong.status_code == 422
    assert "pitch_deg" in wrong.json()["detail"]


def test_everything_that_a_run_left_can_be_fetched(service: ServiceProcess) -> None:
    run_id = service.start()
    result = service.wait(run_id)["result"]
    assert service.api.get(f"/runs/{run_id}/result.json").json() == result
    assert service.api.get(f"/runs/{run_id}/visits").json()["visits"] == result["visits"]
    visits = service.api.get(f"/runs/{run_id}/visits", params={"format": "csv"})
    assert len(visits.text.splitlines()) == 1 + len(result["visits"])
    samples = service.api.get(f"/runs/{run_id}/samples", params={"format": "csv"})
    assert len(samples.text.splitlines()) > sum(visit["samples"] for visit in result["visits"])
    assert service.api.get(f"/runs/{run_id}/samples?format=parquet").content[:4] == b"PAR1"
    report = service.api.get(f"/runs/{run_id}/report.html")
    assert (report.status_code, run_id in report.text) == (200, True)
    for name in ("fit", "residuals", "dial", "convergence", "budget"):
        figure = service.api.get(f"/runs/{run_id}/figures/{name}.svg")
        assert (figure.status_code, figure.headers["content-type"]) == (200, "image/svg+xml")
    assert service.api.get(f"/runs/{run_id}/figures/pie.svg").status_code == 404
