"""The writer thread as a loop sees it: awaited, in order, undisturbed by cancellation."""

import asyncio
import gc
import threading
from typing import Any

import numpy as np
import pytest

from northfinder.records import NewRun, Records, RecordsError, Run, UnknownRunError, Writer
from sim.clock import run_virtual
from tests.records.examples import RUN, samples, visit


class SlowRecords(Records):
    """Records whose disk waits for a word."""

    def __init__(self, records: Records) -> None:
        super().__init__(records._engine, records._holder)
        self.begun = threading.Event()
        self.may_commit = threading.Event()
        self.threads: set[int] = set()

    def create_run(self, new: NewRun) -> Run:
        self.begun.set()
        self.threads.add(threading.get_ident())
        assert self.may_commit.wait(10.0)
        return super().create_run(new)


async def record_a_run(writer: Writer) -> str:
    run_id = (await writer.create_run(RUN)).id
    await writer.set_state(run_id, "running")
    for index in range(3):
        await writer.add_visit(run_id, visit(index), samples(index), {}, 0.5)
    await writer.finish(run_id, {"azimuth_deg": 48.0}, None)
    return run_id


def test_a_run_is_recorded_while_virtual_time_stands_still(records: Records) -> None:
    async def main() -> tuple[str, float]:
        async with Writer(records) as writer:
            run_id = await record_a_run(writer)
        return run_id, asyncio.get_running_loop().time()

    run_id, elapsed_s = run_virtual(main())
    assert elapsed_s == 0.0
    assert records.run(run_id).state == "completed"
    assert [kept.index for kept in records.visits(run_id)] == [0, 1, 2]
    np.testing.assert_array_equal(
        records.samples(run_id, 2)["gyro"].value, samples(2)["gyro"].value
    )


def test_an_error_in_the_thread_reaches_the_caller(records: Records) -> None:
    async def main() -> None:
        async with Writer(records) as writer:
            await writer.fail("20261122T034512Z-7f3a9c", "the table stalled")

    with pytest.raises(UnknownRunError, match="nothing has been recorded yet"):
        asyncio.run(main())


def test_a_cancelled_caller_leaves_at_once_and_the_commit_completes(records: Records) -> None:
    slow = SlowRecords(records)

    async def main() -> None:
        async with Writer(slow) as writer:
            caller = asyncio.create_task(writer.create_run(RUN))
            await asyncio.to_thread(slow.begun.wait, 10.0)
            caller.cancel()
            with pytest.raises(asyncio.CancelledError):
                await caller
            assert records.page(50).runs == []
            slow.may_commit.set()

    asyncio.run(main())
    assert len(records.page(50).runs) == 1


def test_closing_waits_for_all_that_was_submitted_in_order(records: Records, running: str) -> None:
    async def main() -> None:
        writer = Writer(records)
        callers = [
            asyncio.create_task(writer.add_visit(running, visit(index), samples(index), {}, 0.5))
            for index in range(40)  # more than the queue holds
        ]
        await asyncio.sleep(0)
        await writer.close()
        await asyncio.gather(*callers)

    asyncio.run(main())
    assert len(records.visits(running)) == 40


def test_the_queue_is_bounded_and_one_thread_works_it_off(records: Records) -> None:
    slow = SlowRecords(records)

    async def main() -> None:
        async with Writer(slow) as writer:
            callers = [asyncio.create_task(writer.create_run(RUN)) for _ in range(40)]
            await asyncio.sleep(0)
            for caller in callers:
                caller.cancel()
            await asyncio.gather(*callers, return_exceptions=True)
            slow.may_commit.set()

    asyncio.run(main())
    assert len(records.page(50).runs) == 16  # those that waited for room were never submitted
    assert len(slow.threads) == 1


def test_a_failure_that_no_caller_awaits_any_more_is_reported(records: Records) -> None:
    reports: list[dict[str, Any]] = []

    async def main() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, report: reports.append(report))
        async with Writer(records) as writer:
            caller = asyncio.create_task(writer.fail("no such run", "the table stalled"))
            await asyncio.sleep(0)
            caller.cancel()
            await asyncio.gather(caller, return_exceptions=True)

    asyncio.run(main())
    gc.collect()
    assert [type(report["exception"]) for report in reports] == [UnknownRunError]


def test_the_thread_renews_leases_by_itself_and_survives_a_failure(
    records: Records,
    running: str,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """A paused run writes nothing for hours."""
    calls = threading.Semaphore(0)

    class Unlucky(SlowRecords):
        def renew_leases(self) -> int:
            calls.release()
            msg = "the database is locked"
            raise RecordsError(msg)

    async def main() -> None:
        async with Writer(Unlucky(records)) as writer:
            for _ in range(3):
                assert await asyncio.to_thread(calls.acquire, timeout=10.0)
            await writer.set_state(running, "paused")

    monkeypatch.setattr("northfinder.records.writer._RENEW_EVERY_S", 0.01)
    asyncio.run(main())
    assert "leases of the runs in progress are not renewed: the database is locked" in caplog.text
    assert records.run(running).state == "paused"
