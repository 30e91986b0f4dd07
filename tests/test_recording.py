"""A north-seek in the records: durable visit by visit, whatever ends it, and computable again."""

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from northfinder.errors import AcquisitionError
from northfinder.procedures.events import Event, VisitCompleted
from northfinder.procedures.north_seek import Plan
from northfinder.procedures.north_seek_json import JsonObject
from northfinder.recording import recompute, record_north_seek
from northfinder.records import Records, Run, Writer
from northfinder.wiring import build_rig
from sim.world import World
from tests.procedures.rigs import SHORT, config_of, virtually, world_of

Watch = Callable[[World, Event], None]


def record(url: str, watch: Watch | None = None, **sections: dict[str, Any]) -> JsonObject:
    config = config_of(**sections)

    async def seek() -> JsonObject:
        with Records.open(url) as store:
            async with Writer(store) as writer, build_rig(config) as rig:

                async def emit(event: Event) -> None:
                    if watch is not None:
                        watch(world_of(rig), event)

                return await record_north_seek(rig, SHORT, writer, emit)

    return virtually(config, seek())


def the_run(url: str) -> tuple[Run, int]:
    with Records.open(url) as store:
        (run,) = store.runs()
        return run, len(store.visits(run.id))


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'records.db'}"


def test_every_visit_is_durable_before_the_next_begins(url: str) -> None:
    """A second connection looks whenever a visit is announced."""
    seen: list[tuple[str, int, int]] = []

    def look(_: World, event: Event) -> None:
        if isinstance(event, VisitCompleted):
            run, visits = the_run(url)
            with Records.open(url) as store:
                samples = store.samples(run.id, event.visit.index)["gyro"]
            seen.append((run.state, visits, len(samples) - len(event.visit.gyro)))

    record(url, look)
    assert seen == [("running", visits, 0) for visits in range(1, 9)]


def test_a_completed_run_holds_the_result_that_was_returned(url: str) -> None:
    result = record(url)
    run, visits = the_run(url)
    assert (run.state, run.result, visits) == ("completed", result, 8)
    assert result["run_id"] == run.id


def test_recompute_gives_the_identical_result_from_the_stored_samples(url: str) -> None:
    result = record(url, gyro={"mount_angle_deg": 30.0, "axis": "-y"}, site={"height_m": 300.0})
    with Records.open(url) as store:
        again = recompute(store, result["run_id"])
    assert json.dumps(again, sort_keys=True) == json.dumps(result, sort_keys=True)


def test_a_failed_run_keeps_its_reason_and_its_visits_and_can_be_looked_at(url: str) -> None:
    def block(world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 3:
            world.plate.fall_short_by(0.1)

    with pytest.raises(AcquisitionError) as caught:
        record(url, block)
    run, visits = the_run(url)
    assert (run.state, run.error, visits) == ("failed", str(caught.value), 5)
    with Records.open(url) as store:
        partial = recompute(store, run.id)
    assert (partial["state"], len(partial["visits"])) == ("failed", 5)


def test_a_table_that_does_not_confirm_its_stop_is_part_of_the_recorded_reason(url: str) -> None:
    def silence(world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted):
            world.faults("turntable").silent = True

    with pytest.raises(AcquisitionError):
        record(url, silence)
    assert "cable. The table did not confirm that it stopped" in str(the_run(url)[0].error)


def test_a_cancelled_run_is_aborted_and_keeps_its_visits(url: str) -> None:
    def cancel(_: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 2:
            task = asyncio.current_task()
            assert task is not None
            task.cancel()

    with pytest.raises(asyncio.CancelledError):
        record(url, cancel)
    run, visits = the_run(url)
    assert (run.state, run.error, visits) == ("aborted", None, 3)


def test_the_truth_of_the_simulation_is_kept_with_the_run(url: str) -> None:
    result = record(url, simulation={"azimuth_deg": 200.0, "seed": 7})
    run, _ = the_run(url)
    assert run.simulation is not None
    assert (run.simulation["azimuth_deg"], run.simulation["seed"]) == (200.0, 7)
    assert result["simulation"] == run.simulation


def test_a_run_names_its_devices_and_the_chosen_plan(url: str) -> None:
    record(url, accelerometer={"from": "gyro"})
    run, _ = the_run(url)
    devices = {device["role"]: device for device in run.rig["devices"]}
    assert {role: device["driver"] for role, device in devices.items()} == {
        "turntable": "zaber",
        "gyro": "kvh",
        "accelerometer": "kvh",
    }
    assert Plan.model_validate(run.plan) == SHORT


def test_an_infinite_speed_is_no_hindrance_to_a_record(url: str) -> None:
    assert record(url, simulation={"speed": float("inf")})["state"] == "completed"


def test_the_result_tells_what_came_over_each_link(url: str) -> None:
    def corrupt(world: World, _: Event) -> None:
        world.faults("gyro").corrupt_per_byte = 1e-4

    result = record(url, corrupt)
    counters = {device["role"]: device["counters"] for device in result["rig"]["devices"]}
    assert counters["gyro"]["crc_errors"] > 10
    assert counters["gyro"]["frames"] > 8 * 400
    assert counters["accelerometer"]["crc_errors"] == 0
    with Records.open(url) as store:
        assert recompute(store, result["run_id"]) == result
