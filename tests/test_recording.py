"""A north-seek in the records: durable visit by visit, whatever ends it, and computable again."""

import asyncio
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from sqlalchemy.orm import Session

from northfinder.errors import AcquisitionError, ConfigError
from northfinder.procedures.north_seek import Plan
from northfinder.procedures.north_seek_json import JsonObject
from northfinder.recording import Ending, RecordedRun, begin, resume
from northfinder.records import Records, RecordsError, Run, RunEvent, Writer
from northfinder.replay import recompute
from northfinder.wiring import build_rig
from sim.world import World
from tests.procedures.rigs import SHORT, config_of, virtually, world_of


class Life(NamedTuple):
    """What a watcher may meddle with."""

    world: World
    run: RecordedRun
    main: "asyncio.Task[Any]"


Watch = Callable[[Life, RunEvent], None]


def nothing(_: Life, __: RunEvent) -> None: ...


def record(
    url: str, watch: Watch = nothing, *, resumed: str | None = None, **sections: dict[str, Any]
) -> JsonObject:
    """Record a run, or carry one on, as the command line does it, in virtual time."""
    config = config_of(**sections)

    async def seek() -> JsonObject:
        with Records.open(url) as store:
            async with Writer(store) as writer, build_rig(config) as rig:
                runs: list[RecordedRun] = []
                main = asyncio.current_task()
                assert main is not None

                def publish(event: RunEvent) -> None:
                    if runs:
                        watch(Life(world_of(rig), runs[0], main), event)

                if resumed is None:
                    runs.append(await begin(rig, SHORT, writer, publish))
                else:
                    runs.append(await resume(rig, store, store.run(resumed), writer, publish))
                return await runs[0].carry_out()

    return virtually(config, seek())


def visit_of(event: RunEvent) -> int | None:
    return event.data["index"] if event.event == "visit" else None


def the_run(url: str) -> tuple[Run, int]:
    with Records.open(url) as store:
        (summary,) = store.page(2).runs
        return store.run(summary.id), len(store.visits(summary.id))


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'records.db'}"


def test_every_visit_is_durable_before_the_next_begins(url: str) -> None:
    """A second connection looks whenever a visit is announced."""
    seen: list[tuple[str, int, int]] = []

    def look(_: Life, event: RunEvent) -> None:
        if event.event == "visit":
            run, visits = the_run(url)
            with Records.open(url) as store:
                samples = store.samples(run.id, event.data["index"])["gyro"]
            seen.append((run.state, visits, len(samples) - event.data["samples"]))

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
    def block(life: Life, event: RunEvent) -> None:
        if visit_of(event) == 3:
            life.world.plate.fall_short_by(0.1)

    with pytest.raises(AcquisitionError) as caught:
        record(url, block)
    run, visits = the_run(url)
    assert (run.state, run.error, visits) == ("failed", str(caught.value), 5)
    with Records.open(url) as store:
        partial = recompute(store, run.id)
    assert (partial["state"], len(partial["visits"])) == ("failed", 5)


def test_a_table_that_does_not_confirm_its_stop_is_part_of_the_recorded_reason(url: str) -> None:
    def silence(life: Life, event: RunEvent) -> None:
        if event.event == "visit":
            life.world.faults("turntable").silent = True

    with pytest.raises(AcquisitionError):
        record(url, silence)
    assert "cable. The table did not confirm that it stopped" in str(the_run(url)[0].error)


@pytest.mark.parametrize("ending", ["aborted", "interrupted"])
def test_a_cancelled_run_says_by_whom_it_was_ended_and_keeps_its_visits(
    url: str, ending: Ending
) -> None:
    def cancel(life: Life, event: RunEvent) -> None:
        if visit_of(event) == 2:
            life.run.cancelled_as = ending
            life.main.cancel()

    with pytest.raises(asyncio.CancelledError):
        record(url, cancel)
    run, visits = the_run(url)
    assert (run.state, run.error, visits) == (ending, None, 3)


def test_the_events_tell_the_whole_story_in_order(url: str) -> None:
    result = record(url)
    with Records.open(url) as store:
        events = store.events(result["run_id"])
    assert [event.seq for event in events] == list(range(1, len(events) + 1))
    assert [event.data["state"] for event in events if event.event == "state"] == [
        "queued",
        "running",
        "completed",
    ]
    assert [event.data for event in events if event.event == "visit"] == result["visits"]
    (told,) = (event.data for event in events if event.event == "result")
    assert told == {key: value for key, value in result.items() if key != "visits"}
    run, _ = the_run(url)
    assert (run.progress, run.headline and run.headline["azimuth_deg"]) == (
        1.0,
        result["azimuth_deg"],
    )


def interrupt_after(index: int) -> Watch:
    def cut(life: Life, event: RunEvent) -> None:
        if visit_of(event) == index:
            life.run.cancelled_as = "interrupted"
            life.main.cancel()

    return cut


def interrupted_after(url: str, index: int) -> str:
    with pytest.raises(asyncio.CancelledError):
        record(url, interrupt_after(index))
    return the_run(url)[0].id


def test_a_resumed_run_goes_on_in_a_new_segment_and_nothing_is_measured_twice(url: str) -> None:
    run_id = interrupted_after(url, 4)
    result = record(url, resumed=run_id)
    run, visits = the_run(url)
    assert (run.state, run.id, visits) == ("completed", run_id, 10)
    planned = [visit for visit in result["visits"] if visit["repeats"] is None]
    assert [visit["segment"] for visit in planned] == [0] * 5 + [1] * 3
    assert [visit["angle_deg"] for visit in planned] == pytest.approx(
        [0, 90, 180, 270, 270, 180, 90, 0]
    )
    starts_s = [visit["start_s"] for visit in result["visits"]]
    assert starts_s == sorted(starts_s)
    apart_deg = abs(result["azimuth_deg"] - 48.0)
    assert apart_deg < 4 * result["azimuth_sigma_deg"]
    with Records.open(url) as store:
        assert recompute(store, run_id) == result
        seqs = [event.seq for event in store.events(run_id)]
    assert seqs == list(range(1, len(seqs) + 1))


def test_a_run_is_not_resumed_on_a_bench_that_is_configured_otherwise(url: str) -> None:
    run_id = interrupted_after(url, 4)
    with pytest.raises(ConfigError, match=r"\[gyro\] mount_angle_deg was 0.0 and is 90.0 now"):
        record(url, resumed=run_id, gyro={"mount_angle_deg": 90.0})
    assert the_run(url)[0].state == "interrupted"


def test_a_pause_holds_the_run_between_two_visits(url: str) -> None:
    told: list[str] = []

    def pause(life: Life, event: RunEvent) -> None:
        if event.event == "state":
            told.append(event.data["state"])
        if visit_of(event) == 1:
            life.run.gate.close()
        if event.event == "state" and event.data["state"] == "paused":
            asyncio.get_running_loop().call_later(60.0, life.run.gate.open)

    result = record(url, pause)
    assert told == ["running", "paused", "running", "completed"]
    segments = [visit["segment"] for visit in result["visits"]]
    assert segments == [0, 0] + [1] * 8  # two to prove that nothing moved, and the six left


class FailingRecords(Records):
    """Records whose disk is full while ``full``."""

    full = False

    @contextmanager
    def _transaction(self) -> Iterator[Session]:
        if self.full:
            msg = "the records cannot be used (disk full): free some space"
            raise RecordsError(msg)
        with super()._transaction() as session:
            yield session


def test_what_the_records_cannot_take_is_written_once_they_can(url: str) -> None:
    """The disk fills up in mid-run: the run fails, and no measured visit is lost."""
    config = config_of()

    async def seek() -> None:
        with FailingRecords.open(url) as store:
            async with Writer(store) as writer, build_rig(config) as rig:

                def publish(event: RunEvent) -> None:
                    if event.event == "progress" and event.data["visit"] == 4:
                        store.full = True

                run = await begin(rig, SHORT, writer, publish)
                with pytest.raises(RecordsError, match="disk full"):
                    await run.carry_out()
                assert not run.settled
                assert not (await rig.table_state()).moving
                assert the_run(url)[0].state == "running"
                store.full = False
                await run.settle()
                assert run.settled

    virtually(config, seek())
    run, visits = the_run(url)
    assert (run.state, visits) == ("failed", 4)
    assert "free some space" in str(run.error)


def warnings_of(url: str) -> list[str]:
    with Records.open(url) as store:
        (run,) = store.page(2).runs
        events = store.events(run.id)
    return [event.data["message"] for event in events if event.event == "warning"]


def test_what_is_told_in_the_moment_a_write_ends_is_written_once(url: str) -> None:
    """Between the end of the task that writes and the wake-up of whoever waits for it."""

    def tell_then(life: Life, event: RunEvent) -> None:
        if event.event == "visit":
            asyncio.get_running_loop().call_soon(life.run.warn, f"after {visit_of(event)}")

    record(url, tell_then)
    assert warnings_of(url) == [f"after {index}" for index in range(8)]


@pytest.mark.parametrize("later", [False, True])
def test_a_warning_after_the_end_is_no_part_of_the_run(url: str, *, later: bool) -> None:
    def tell_at_the_end(life: Life, event: RunEvent) -> None:
        if event.event == "state" and event.data["state"] == "completed":
            loop = asyncio.get_running_loop()
            loop.call_soon(life.run.warn, "late") if later else life.run.warn("late")

    record(url, tell_at_the_end)
    assert (the_run(url)[0].state, warnings_of(url)) == ("completed", [])


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
    def corrupt(life: Life, _: RunEvent) -> None:
        life.world.faults("gyro").corrupt_per_byte = 1e-4

    result = record(url, corrupt)
    counters = {device["role"]: device["counters"] for device in result["rig"]["devices"]}
    assert counters["gyro"]["crc_errors"] > 10
    assert counters["gyro"]["frames"] > 8 * 400
    assert counters["accelerometer"]["crc_errors"] == 0
    with Records.open(url) as store:
        assert recompute(store, result["run_id"]) == result
