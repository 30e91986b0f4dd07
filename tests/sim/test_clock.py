"""Minutes of dwell pass in milliseconds, and threads do not let time slip by."""

import asyncio
import threading
import time
from collections.abc import Coroutine
from typing import Any, TypeVar

import numpy as np
import pytest

from sim.clock import PacedTimeLoop, ScaledTimeLoop, run_virtual

T = TypeVar("T")
SPEED = 20.0


def test_sleeps_cost_no_wall_time_and_wake_in_order() -> None:
    async def survey() -> tuple[float, list[str]]:
        log: list[str] = []

        async def pause(name: str, dwell_s: float) -> None:
            await asyncio.sleep(dwell_s)
            log.append(name)

        await asyncio.gather(pause("late", 600.0), pause("early", 30.0))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(120.0):
                await asyncio.sleep(1e6)
        return asyncio.get_running_loop().time(), log

    start_s = time.perf_counter()
    elapsed_s, log = run_virtual(survey())
    assert elapsed_s == pytest.approx(720.0)
    assert log == ["early", "late"]
    assert time.perf_counter() - start_s < 5.0


def test_time_stands_still_while_a_thread_job_is_pending() -> None:
    async def commit() -> float:
        ticker = asyncio.create_task(asyncio.sleep(1e6))
        await asyncio.to_thread(time.sleep, 0.05)
        ticker.cancel()
        return asyncio.get_running_loop().time()

    assert run_virtual(commit()) == 0.0


def test_scaled_time_runs_faster_by_the_stated_factor() -> None:
    async def nap() -> float:
        start_s = time.monotonic()
        await asyncio.sleep(2.0)
        return time.monotonic() - start_s

    with asyncio.Runner(loop_factory=lambda: ScaledTimeLoop(20.0)) as runner:
        assert 0.1 <= runner.run(nap()) < 0.6


def paced(main: Coroutine[Any, Any, T]) -> T:
    with asyncio.Runner(loop_factory=lambda: PacedTimeLoop(SPEED)) as runner:
        return runner.run(main)


def test_a_stall_makes_paced_time_lag_and_no_deadline_is_jumped() -> None:
    async def tick() -> list[float]:
        loop = asyncio.get_running_loop()
        times_s = [loop.time()]
        for number in range(100):
            if number == 50:
                time.sleep(0.3)  # noqa: ASYNC251 - the stall is the point
            await asyncio.sleep(0.05)
            times_s.append(loop.time())
        return times_s

    assert np.diff(paced(tick())) == pytest.approx(0.05)


def test_paced_time_never_runs_ahead_and_does_not_race_after_a_long_stall() -> None:
    async def stall_and_sleep() -> tuple[float, float]:
        start_s = time.monotonic()
        await asyncio.sleep(4.0)
        before_s = time.monotonic() - start_s
        time.sleep(0.5)  # noqa: ASYNC251 - the stall is the point
        await asyncio.sleep(0.05)  # steps out of the stall
        start_s = time.monotonic()
        await asyncio.sleep(4.0)
        return before_s, time.monotonic() - start_s

    before_s, after_s = paced(stall_and_sleep())
    assert before_s >= 4.0 / SPEED
    assert after_s >= 0.9 * 4.0 / SPEED  # ordinary lag is made good


@pytest.mark.alone
def test_paced_time_keeps_its_pace_within_two_percent() -> None:
    async def measure() -> float:
        loop = asyncio.get_running_loop()
        start_s, wall_s = loop.time(), time.monotonic()
        for _ in range(400):
            await asyncio.sleep(0.05)
        return (loop.time() - start_s) / (time.monotonic() - wall_s)

    # The best of three: after a longer pause of the computer time lags, as it shall.
    assert min(abs(paced(measure()) / SPEED - 1.0) for _ in range(3)) < 0.02


@pytest.mark.parametrize("scheduled_s", [None, 1e6])
def test_another_thread_wakes_a_paced_loop_at_once_and_at_the_right_time(
    scheduled_s: float | None,
) -> None:
    async def wait() -> tuple[float, float]:
        loop = asyncio.get_running_loop()
        woken, called_s = asyncio.Event(), []

        def call() -> None:
            called_s.append(time.monotonic())
            loop.call_soon_threadsafe(woken.set)

        if scheduled_s is not None:
            loop.call_later(scheduled_s, print)
        began_s, wall_s = loop.time(), time.monotonic()
        timer = threading.Timer(1.0, call)
        timer.start()
        await woken.wait()
        timer.join()
        late_s = time.monotonic() - called_s[0]
        return late_s, (loop.time() - began_s) / SPEED - (called_s[0] - wall_s)

    late_s, error_s = paced(wait())
    assert late_s < 0.5
    assert abs(error_s) < 0.5


def test_paced_time_goes_on_while_a_thread_job_is_pending() -> None:
    async def commit() -> tuple[float, int]:
        ticks = 0

        async def tick() -> None:
            nonlocal ticks
            while True:
                await asyncio.sleep(0.05)
                ticks += 1

        ticker = asyncio.create_task(tick())
        await asyncio.to_thread(time.sleep, 0.2)
        ticker.cancel()
        return asyncio.get_running_loop().time(), ticks

    elapsed_s, ticks = paced(commit())
    assert elapsed_s > 1.0
    assert ticks == pytest.approx(elapsed_s / 0.05, abs=1.5)
