"""Alignments, static records and heading holds over REST: begun, followed, ended, kept."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.service.process import SHORT, ServiceProcess, serving, wait_until_ready

ALIGNMENT = {"kind": "alignment", "duration_s": 20}
NOISE = {"kind": "noise", "duration_s": 30}
LONG_NOISE = {"kind": "noise", "duration_s": 3600}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """Not faster: a stream does not wait, and a commit of 50 ms is a second of it here."""
    with serving(tmp_path_factory.mktemp("service"), "--sim-speed", "20") as running:
        wait_until_ready(running)
        yield running


@pytest.fixture(autouse=True)
def idle(service: ServiceProcess) -> Iterator[None]:
    yield
    run_id = service.api.get("/rig").json()["run_id"]
    if run_id is not None:
        service.api.post("/rig/stop")
        service.wait(run_id)


def carried_out(service: ServiceProcess, body: dict[str, Any]) -> dict[str, Any]:
    run = service.wait(service.start(body))
    assert run["state"] == "completed", run["error"]
    return run


def test_an_alignment_is_followed_every_second_and_kept(service: ServiceProcess) -> None:
    run_id = service.start(ALIGNMENT)
    events = list(service.events(run_id))
    told = [event.data for event in events if event.event == "estimate"]
    assert [round(each["time_s"]) for each in told] == list(range(10, 21))
    assert {event.data["phase"] for event in events if event.event == "progress"} == {
        "homing",
        "aligning",
    }
    run = service.run(run_id)
    assert run["azimuth_deg"] == run["result"]["azimuth_deg"]
    assert len(service.api.get(f"/runs/{run_id}/visits").json()["visits"]) == 4
    samples = service.api.get(f"/runs/{run_id}/samples").text
    assert {line.split(",")[4] for line in samples.splitlines()[1:]} == {
        f"{what}-{axis}" for what in ("rate", "force") for axis in "xyz"
    }


def test_the_base_can_be_set_in_motion_while_the_service_runs(service: ServiceProcess) -> None:
    changed = service.api.patch("/rig/simulation", json={"base": "nominal"})
    assert changed.json()["base"] == "nominal"
    try:
        rocking = carried_out(service, ALIGNMENT)["result"]["history"]["roll_deg"]
    finally:
        service.api.patch("/rig/simulation", json={"base": "still"})
    still = carried_out(service, ALIGNMENT)["result"]["history"]["roll_deg"]
    assert max(rocking) - min(rocking) > 10 * (max(still) - min(still))
    assert service.api.patch("/rig/simulation", json={"base": "sea"}).status_code == 422


def test_a_heading_is_held_from_the_last_run_or_the_one_that_is_named(
    service: ServiceProcess,
) -> None:
    first = carried_out(service, SHORT)
    second = carried_out(service, SHORT)
    for named, expected in ((None, second), (first["run_id"], first)):
        held = carried_out(
            service, {"kind": "heading-hold", "from_run": named, "duration_s": 5, "rest_s": 5}
        )
        assert held["plan"]["from_run"] == expected["run_id"]
        assert abs(held["azimuth_deg"] - expected["azimuth_deg"]) < 0.01


@pytest.mark.parametrize("path", ["/plans", "/runs"])
def test_a_hold_from_a_run_that_is_not_there_is_404(service: ServiceProcess, path: str) -> None:
    answer = service.api.post(path, json={"kind": "heading-hold", "from_run": "nowhere"})
    assert answer.status_code == 404
    assert "there is no run 'nowhere'" in answer.json()["detail"]


def test_a_static_record_can_only_be_aborted_and_keeps_what_it_has(
    service: ServiceProcess,
) -> None:
    run_id = service.start(LONG_NOISE)
    service.wait_for_visits(run_id, 1)
    assert service.run(run_id)["steps"] == ["abort"]
    for step in ("pause", "resume"):
        answer = service.api.post(f"/runs/{run_id}/{step}")
        assert answer.status_code == 409
        assert answer.json()["steps"] == ["abort"]
    assert service.api.post(f"/runs/{run_id}/abort").status_code == 202
    run = service.wait(run_id, "aborted")
    assert run["steps"] == []
    assert service.api.get(f"/runs/{run_id}/visits").json()["visits"]


def test_a_static_record_has_figures_and_no_azimuth(service: ServiceProcess) -> None:
    run = carried_out(service, NOISE)
    assert run["azimuth_deg"] is None
    assert run["result"]["gyro"]["angle_random_walk_deg_sqrt_h"]["value"] > 0.0
    listed = service.api.get("/runs", params={"kind": "noise", "limit": 1}).json()["runs"]
    assert (listed[0]["run_id"], listed[0]["figure"]) == (run["run_id"], run["figure"])
    assert run["figure"].endswith("deg/sqrt(h)")


def test_plans_of_every_kind_say_what_they_take(service: ServiceProcess) -> None:
    alignment = service.api.post("/plans", json={"kind": "alignment"}).json()
    assert alignment["duration_s"] == 120.0
    assert alignment["azimuth_sigma_deg"] == pytest.approx(1.49, abs=0.01)  # 0.3 deg/h of bias
    assert sum(line["share"] for line in alignment["budget"]) == pytest.approx(1.0)
    record = service.api.post("/plans", json={"kind": "noise", "duration_s": 60}).json()
    assert record["azimuth_sigma_deg"] is None
    assert "an hour or more" in record["warnings"][0]


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({}, "body.kind"),
        ({"kind": "nose"}, "body.kind"),
        ({"kind": "noise", "positions": 4}, "body.positions"),
        ({"kind": "alignment", "method": "quest", "warm_s": -1}, "body.warm_s"),
        ({"kind": "alignment", "duration_s": True}, "body.duration_s"),
        ({"kind": "heading-hold", "method": "rk4"}, "body.method"),
    ],
)
def test_a_bad_request_names_its_field(
    service: ServiceProcess, body: dict[str, Any], field: str
) -> None:
    answer = service.api.post("/runs", json=body)
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]
