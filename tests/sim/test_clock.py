"""Minutes of dwell pass in milliseconds, and threads do not let time slip by."""

import asyncio
import time

import pytest

from sim.clock import ScaledTimeLoop, run_virtual


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
