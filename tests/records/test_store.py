"""What goes into the records comes out of them, and nothing else does."""

import math
import re
import threading
from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from northfinder.records import NewRun, Records, RecordsError
from tests.records.examples import RUN, execute, samples, visit

RESULT = {"azimuth_deg": 0.1 + 0.2, "tilt": {"zeta_deg": None}, "visits": [1, 2.5, "out"]}
HEADLINE = {"azimuth_deg": 0.1 + 0.2, "checks": {"pass": 6}, "attention": ["tilt"]}


def test_a_run_is_recorded_from_its_first_moment_to_its_result(records: Records) -> None:
    before_utc = datetime.now(UTC)
    queued = records.create_run(RUN)
    run_id = queued.id
    assert records.run(run_id) == queued
    assert {name: getattr(queued, name) for name in asdict(RUN)} == asdict(RUN)
    assert (queued.state, queued.started_utc, queued.result) == ("queued", None, None)
    assert re.fullmatch(r"\d{8}T\d{6}Z-[0-9a-f]{6}", run_id)

    records.set_state(run_id, "running")
    records.finish(run_id, RESULT, HEADLINE)
    done = records.run(run_id)
    assert (done.state, done.result, done.error) == ("completed", RESULT, None)
    assert (done.progress, done.headline) == (1.0, HEADLINE)
    assert done.started_utc is not None
    assert done.finished_utc is not None
    assert before_utc <= done.created_utc <= done.started_utc <= done.finished_utc
    assert done.finished_utc.utcoffset() == timedelta(0)


def test_a_resumed_run_has_no_end_and_no_error_any_more(records: Records, running: str) -> None:
    started_utc = records.run(running).started_utc
    records.fail(running, "the table stalled at 45 deg; clear it")
    assert records.run(running).error == "the table stalled at 45 deg; clear it"
    assert records.run(running).finished_utc is not None
    records.resume(running)
    resumed = records.run(running)
    assert (resumed.started_utc, resumed.finished_utc, resumed.error) == (started_utc, None, None)


def test_visits_and_samples_come_back_as_they_were(records: Records, running: str) -> None:
    for index in (1, 0):
        records.add_visit(running, visit(index), samples(index), {}, 0.5)
    assert records.visits(running) == [visit(0), visit(1)]
    for stream, expected in samples(1).items():
        np.testing.assert_equal(asdict(records.samples(running, 1)[stream]), asdict(expected))


def test_the_same_visit_twice_is_refused_and_the_first_one_stays(
    records: Records, running: str
) -> None:
    records.add_visit(running, visit(0), samples(0), {}, 0.5)
    with pytest.raises(RecordsError, match=f"run {running} has visit 0 already"):
        records.add_visit(running, replace(visit(0), angle_rad=3.0), samples(1), {}, 0.5)
    assert records.visits(running) == [visit(0)]
    assert records.samples(running, 0)["gyro"].tick[0] == 10


def test_only_a_running_run_takes_visits(records: Records) -> None:
    run_id = records.create_run(RUN).id
    with pytest.raises(RecordsError, match="is queued and takes no visits"):
        records.add_visit(run_id, visit(0), samples(0), {}, 0.5)


def test_a_unique_beginning_of_an_id_is_enough_to_read(records: Records, running: str) -> None:
    assert records.run(running[:-3]).id == running
    records.add_visit(running, visit(0), samples(0), {}, 0.5)
    assert records.visits(running[:-3]) == [visit(0)]
    assert set(records.samples(running[:-3], 0)) == {"gyro", "accelerometer"}


def test_a_beginning_that_several_share_names_them(records: Records) -> None:
    ids = [records.create_run(RUN).id for _ in range(2)]
    with pytest.raises(RecordsError, match="several runs begin with '20'") as caught:
        records.run("20")
    assert all(run_id in str(caught.value) for run_id in ids)


@pytest.mark.parametrize("percent", ["%", "_"])
def test_a_wildcard_is_no_beginning(records: Records, running: str, percent: str) -> None:
    with pytest.raises(RecordsError, match=f"no run '{percent}'; the newest is {running}"):
        records.run(percent)


def test_an_unknown_id_is_answered_with_near_ones(records: Records) -> None:
    with pytest.raises(RecordsError, match="nothing has been recorded yet"):
        records.run("20261122T034512Z-7f3a9c")
    run_id = records.create_run(RUN).id
    with pytest.raises(RecordsError, match=f"near it are {run_id}"):
        records.visits(run_id[:-1] + "x")
    with pytest.raises(RecordsError, match=f"near it are {run_id}"):
        records.set_state(run_id[:-1], "running")  # to change a run takes its whole id
    with pytest.raises(RecordsError, match="has no visit 3"):
        records.samples(run_id, 3)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, np.float64("nan")])
def test_numbers_that_json_does_not_have_are_refused(
    records: Records, running: str, value: float
) -> None:
    with pytest.raises(ValueError, match=r"^result\.budget\[1\]\.u_deg is -?(nan|inf), which"):
        records.finish(running, {"budget": [{"u_deg": 1.0}, {"u_deg": value}]}, None)
    with pytest.raises(ValueError, match=r"^plan\.dwell_s is -?(nan|inf)"):
        replace(RUN, plan={"dwell_s": value})
    assert records.run(running).state == "running"


def test_keys_and_values_that_json_does_not_have_are_refused() -> None:
    with pytest.raises(ValueError, match="site has the key 1; JSON keys are strings"):
        NewRun(**{**asdict(RUN), "site": {1: "x"}})
    with pytest.raises(ValueError, match=r"rig\.data is a ndarray"):
        replace(RUN, rig={"data": np.zeros(2)})


def test_a_visit_without_a_mean_is_refused() -> None:
    with pytest.raises(ValueError, match="visit 3: accel_mean_g is nan"):
        replace(visit(3), accel_mean_g=math.nan)


def test_damaged_samples_are_found_out(records: Records, running: str, url: str) -> None:
    records.add_visit(running, visit(0), samples(0), {}, 0.5)
    execute(url, "UPDATE samples SET arrow = :other WHERE stream = 'gyro'", other=b"0")
    with pytest.raises(RecordsError, match=f"gyro samples of run {running}, visit 0 are damaged"):
        records.samples(running, 0)


def test_a_reader_sees_whole_visits_while_others_are_written(
    records: Records, running: str, url: str
) -> None:
    wrong: list[str] = []
    done = threading.Event()

    def read() -> None:
        with Records.open(url) as others:
            while not done.is_set():
                indices = [visit.index for visit in others.visits(running)]
                if indices != list(range(len(indices))):
                    wrong.append(f"visits {indices}")
                if indices and len(others.samples(running, indices[-1])) != 2:
                    wrong.append(f"visit {indices[-1]} without samples")

    reader = threading.Thread(target=read)
    reader.start()
    try:
        for index in range(40):
            records.add_visit(running, visit(index), samples(index), {}, 0.5)
    finally:
        done.set()
        reader.join()
    assert wrong == []


def test_a_page_says_how_many_runs_there_are_in_all(records: Records) -> None:
    for _ in range(3):
        records.create_run(RUN)
    records.set_state(records.create_run(RUN).id, "running")
    assert records.page(2).total == 4
    assert records.page(2, records.page(2).next_cursor).total == 4
    assert records.page(2, state="running").total == 1
