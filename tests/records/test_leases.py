"""Who may change a run, and when a run is known to be abandoned."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from northfinder.records import HeldElsewhereError, Holder, Records
from northfinder.records.tables import RunRow
from tests.records.examples import RUN, execute, samples, visit

HERE = Holder.this_process()
#: The highest process number that Linux gives is below 2^22; of Windows, a multiple of four.
GONE = replace(HERE, pid=2**22 + 1)
ELSEWHERE = replace(HERE, host="another-bench")
Opened = Callable[[Holder], Records]


@pytest.fixture
def opened(url: str) -> Iterator[Opened]:
    """Opens the same records as another process would."""
    with ExitStack() as stack:
        yield lambda holder: stack.enter_context(Records.open(url, holder))


def running_run(records: Records) -> str:
    run_id = records.create_run(RUN).id
    records.set_state(run_id, "running")
    return run_id


def let_leases_expire(url: str) -> None:
    execute(url, "UPDATE runs SET lease_expires_utc = '2026-01-01 00:00:00.000000'")


def lease_s(url: str, run_id: str) -> float:
    """How long the lease still lasts."""
    with Records.open(url) as records, records._snapshot() as session:
        expires_utc = session.get_one(RunRow, run_id).lease_expires_utc
    assert expires_utc is not None
    return (expires_utc - datetime.now(UTC)) / timedelta(seconds=1)


def test_this_process_is_not_gone() -> None:
    assert not HERE.is_gone()
    assert Holder.from_text(HERE.to_text()) == HERE
    assert HERE.pid == os.getpid()


def test_a_process_that_has_ended_is_gone() -> None:
    program = "from northfinder.records import Holder; print(Holder.this_process().to_text())"
    command = [sys.executable, "-c", program]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    assert Holder.from_text(answer.stdout).is_gone()


def test_a_killed_process_is_gone_before_its_parent_looks() -> None:
    program = (
        "import sys; from northfinder.records import Holder\n"
        "print(Holder.this_process().to_text(), flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdout is not None
        holder = Holder.from_text(process.stdout.readline())
        assert not holder.is_gone()
        process.kill()
        process.stdout.read()  # ends when the process does
        deadline = datetime.now(UTC) + timedelta(seconds=10)
        while not holder.is_gone():
            assert datetime.now(UTC) < deadline
        assert process.returncode is None


def test_a_later_process_of_the_same_number_is_another_one() -> None:
    assert replace(HERE, started_s=HERE.started_s - 60.0).is_gone()
    assert not replace(HERE, started_s=HERE.started_s + 0.5).is_gone()


def test_of_another_computer_nobody_knows() -> None:
    assert not replace(GONE, host="another-bench").is_gone()


def test_a_run_whose_process_is_gone_is_interrupted_at_once(
    records: Records, opened: Opened
) -> None:
    before = opened(GONE)
    run_ids = [before.create_run(RUN).id, running_run(before), running_run(before)]
    before.set_state(run_ids[2], "paused")
    ended = running_run(before)
    before.fail(ended, "the table stalled")
    events = records.interrupt_abandoned("Lab 3")
    assert [event.run_id for event in events] == sorted(run_ids)
    assert {event.data["state"] for event in events} == {"interrupted"}
    assert {records.run(run_id).state for run_id in run_ids} == {"interrupted"}
    assert records.run(ended).state == "failed"
    assert records.interrupt_abandoned("Lab 3") == []


def test_a_run_of_another_computer_is_interrupted_when_its_lease_expires(
    records: Records, opened: Opened, url: str
) -> None:
    run_id = running_run(opened(ELSEWHERE))
    assert records.interrupt_abandoned("Lab 3") == []
    let_leases_expire(url)
    assert [event.run_id for event in records.interrupt_abandoned("Lab 3")] == [run_id]


def test_a_run_of_another_rig_or_of_this_process_is_left_alone(
    records: Records, running: str, opened: Opened, url: str
) -> None:
    opened(GONE).create_run(replace(RUN, rig_name="Lab 4"))
    let_leases_expire(url)  # as after a minute's sleep of the computer
    assert records.interrupt_abandoned("Lab 3") == []
    assert records.run(running).state == "running"


def test_another_process_may_not_change_a_run_in_progress(
    records: Records, running: str, opened: Opened
) -> None:
    others = opened(ELSEWHERE)
    before = records.run(running)
    for change in (
        lambda: others.set_state(running, "aborted"),
        lambda: others.finish(running, {}, None),
        lambda: others.fail(running, "the table stalled"),
        lambda: others.add_visit(running, visit(0), samples(0), {}, 0.1),
        lambda: others.add_event(running, "warning", {"message": "a frame was lost"}),
    ):
        with pytest.raises(HeldElsewhereError, match=f"held by process {HERE.pid} on"):
            change()
    assert records.run(running) == before


def test_a_process_that_overslept_its_lease_finds_its_run_taken(
    records: Records, running: str, opened: Opened, url: str
) -> None:
    others = opened(ELSEWHERE)
    let_leases_expire(url)
    others.interrupt_abandoned("Lab 3")
    others.resume(running)
    with pytest.raises(HeldElsewhereError, match=f"held by process {HERE.pid} on another-bench"):
        records.add_visit(running, visit(0), samples(0), {}, 0.1)
    assert others.add_visit(running, visit(0), samples(0), {}, 0.1).seq == 5


def test_anybody_may_end_a_failed_or_interrupted_run_for_good(
    records: Records, running: str, opened: Opened
) -> None:
    records.fail(running, "the table stalled")
    opened(ELSEWHERE).set_state(running, "aborted")
    assert records.run(running).state == "aborted"


def test_every_change_renews_the_lease_for_half_a_minute(
    records: Records, running: str, url: str
) -> None:
    for change in (
        lambda: records.add_event(running, "progress", {}),
        lambda: records.add_visit(running, visit(0), samples(0), {}, 0.1),
        lambda: records.set_state(running, "paused"),
        records.renew_leases,
    ):
        let_leases_expire(url)
        change()
        assert 25.0 < lease_s(url, running) < 31.0


def test_only_own_runs_that_go_on_are_renewed(
    records: Records, running: str, opened: Opened
) -> None:
    opened(ELSEWHERE).create_run(RUN)
    assert records.renew_leases() == 1
    records.set_state(running, "aborted")
    assert records.renew_leases() == 0
