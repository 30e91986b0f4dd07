"""One thread, jobs in order, and a chore that waits for nobody."""

import threading
from concurrent.futures import Future, wait

import pytest

from northfinder.records.thread import ChoreThread


def nothing() -> None:
    """No chore."""


def test_jobs_are_done_in_order_by_one_thread() -> None:
    done: list[tuple[int, int]] = []
    with ChoreThread("test", nothing, 60.0) as thread:
        for number in range(100):
            thread.submit(lambda number: done.append((number, threading.get_ident())), number)
    assert [number for number, _ in done] == [*range(100)]
    assert len({ident for _, ident in done}) == 1


def test_an_idle_thread_does_its_chore_again_and_again() -> None:
    chores = threading.Semaphore(0)
    with ChoreThread("test", chores.release, 0.001):
        for _ in range(5):
            assert chores.acquire(timeout=10.0)


def test_a_busy_thread_does_its_chore_between_jobs() -> None:
    chored = threading.Event()
    with ChoreThread("test", chored.set, 0.01) as thread:
        job = thread.submit(nothing)
        while not chored.is_set():  # never idle: the next job is always there
            job.result(timeout=10.0)
            job = thread.submit(nothing)


def test_what_a_job_raises_is_its_waiters() -> None:
    with ChoreThread("test", nothing, 60.0) as thread:
        failing = thread.submit(int, "x")
        assert thread.submit(int, "7").result(timeout=10.0) == 7
        with pytest.raises(ValueError, match="invalid literal"):
            failing.result()


def test_a_cancelled_job_is_not_done() -> None:
    may_go = threading.Event()
    with ChoreThread("test", nothing, 60.0) as thread:
        thread.submit(may_go.wait, 10.0)
        cancelled: Future[None] = thread.submit(pytest.fail, "it was cancelled")
        assert cancelled.cancel()
        may_go.set()
        wait([cancelled], timeout=10.0)


def test_after_shutdown_no_job_is_taken() -> None:
    thread = ChoreThread("test", nothing, 60.0)
    thread.shutdown()
    with pytest.raises(RuntimeError, match="has been shut down"):
        thread.submit(nothing)
