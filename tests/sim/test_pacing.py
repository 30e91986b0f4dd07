"""Samples are taken by the device's own clock, however late the computer wakes up."""

import asyncio
from asyncio import AbstractEventLoop, TimerHandle
from collections.abc import Callable
from contextvars import Context
from typing import TypeVarTuple

import numpy as np
import pytest

from drivers.interfaces import FloatArray
from sim.clock import VirtualTimeLoop
from sim.pacing import bursts

Ts = TypeVarTuple("Ts")
MICROSECOND = 1e-6
LATEST_S = 0.03


class SleepyLoop(VirtualTimeLoop):
    """A computer that wakes up late, by up to 30 ms."""

    def __init__(self) -> None:
        super().__init__()
        self._random = np.random.default_rng(1)

    def call_at(
        self,
        when: float,
        callback: Callable[[*Ts], object],
        *args: *Ts,
        context: Context | None = None,
    ) -> TimerHandle:
        late_s = self._random.uniform(0.0, LATEST_S)
        return super().call_at(when + late_s, callback, *args, context=context)


def collect(
    rate_hz: float,
    burst_s: float,
    duration_s: float,
    loop_factory: Callable[[], AbstractEventLoop] = VirtualTimeLoop,
) -> list[FloatArray]:
    """Return the bursts of some time, each of samples that are past, up to the latest."""

    async def session() -> list[FloatArray]:
        loop = asyncio.get_running_loop()
        collected: list[FloatArray] = []
        async for time_s in bursts(rate_hz, burst_s):
            assert -MICROSECOND < loop.time() - time_s[-1] < 1 / rate_hz + MICROSECOND
            collected.append(time_s)
            if loop.time() >= duration_s:
                break
        return collected

    with asyncio.Runner(loop_factory=loop_factory) as runner:
        return runner.run(session())


def test_bursts_hold_the_samples_of_the_time_between_them() -> None:
    sizes = [len(burst) for burst in collect(1000.0, 0.05, 10.0)]
    assert set(sizes) == {50}


def test_where_samples_are_rarer_than_bursts_each_comes_alone_and_at_once() -> None:
    collected = collect(10.0, 0.05, 5.0)
    assert [len(burst) for burst in collected] == [1] * 50
    assert np.concatenate(collected) == pytest.approx(np.arange(1, 51) / 10.0)


@pytest.mark.parametrize(("rate_hz", "burst_s"), [(1000.0, 0.01), (500.0, 0.05), (7.3, 0.001)])
def test_samples_stand_exactly_one_period_apart_under_late_wake_ups(
    rate_hz: float, burst_s: float
) -> None:
    collected = collect(rate_hz, burst_s, 20.0, SleepyLoop)
    time_s = np.concatenate(collected)
    assert time_s == pytest.approx(np.arange(1, len(time_s) + 1) / rate_hz, abs=1e-9)
    longest = max(len(burst) for burst in collected)
    assert longest <= 1 + np.ceil((max(burst_s, 1 / rate_hz) + LATEST_S) * rate_hz)


def test_the_samples_of_an_hour_are_neither_more_nor_fewer() -> None:
    collected = collect(1000.0, 1.0, 3600.0, SleepyLoop)
    time_s = np.concatenate(collected)
    assert len(time_s) == pytest.approx(3600.0 * 1000, abs=1000 * (1.0 + LATEST_S))
    assert time_s[-1] == pytest.approx(len(time_s) / 1000.0, abs=MICROSECOND)
