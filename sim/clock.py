"""Event loops whose time is virtual or scaled; drivers and procedures only ever ask the loop."""

import asyncio
import math
import selectors
import time
from asyncio import AbstractEventLoop, Future
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from typing import Any, TypeVar, TypeVarTuple

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
_Ready = list[tuple[selectors.SelectorKey, int]]


class _JumpingSelector(selectors.DefaultSelector):
    """Poll instead of waiting, and credit the skipped wait to the clock.

    While a thread job is pending the wait is real and the clock stands still: otherwise a
    commit of 50 ms would let seconds of samples pass.
    """

    def __init__(self) -> None:
        super().__init__()
        self.now_s = 0.0
        self.pending_jobs = 0

    def select(self, timeout: float | None = None) -> _Ready:
        ready = super().select(0)
        if ready or timeout == 0:
            return ready
        if timeout is None or self.pending_jobs:
            return super().select(None)
        self.now_s += timeout
        return ready


class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """Event loop whose time jumps to the next deadline whenever every task sleeps."""

    def __init__(self) -> None:
        self._jumping = _JumpingSelector()
        super().__init__(self._jumping)

    def time(self) -> float:
        """Return virtual seconds since the loop was made."""
        return self._jumping.now_s

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[*Ts], T], *args: *Ts
    ) -> Future[T]:
        """Run a thread job; virtual time stands still until it is done."""
        future = super().run_in_executor(executor, func, *args)
        self._jumping.pending_jobs += 1
        future.add_done_callback(self._job_done)
        return future

    async def shutdown_default_executor(self, timeout: float | None = None) -> None:  # noqa: ARG002, ASYNC109
        """Join the threads in real time: a virtual timeout would be over at once."""
        self._jumping.pending_jobs += 1
        try:
            await super().shutdown_default_executor()
        finally:
            self._jumping.pending_jobs -= 1

    def _job_done(self, _: Future[Any]) -> None:
        self._jumping.pending_jobs -= 1


class _ScaledSelector(selectors.DefaultSelector):
    def __init__(self, speed: float) -> None:
        super().__init__()
        self._speed = speed

    def select(self, timeout: float | None = None) -> _Ready:
        return super().select(timeout if timeout is None else timeout / self._speed)


class ScaledTimeLoop(asyncio.SelectorEventLoop):
    """Event loop whose time runs ``speed`` times as fast as the wall's."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._start_s = time.monotonic()
        super().__init__(_ScaledSelector(speed))

    def time(self) -> float:
        """Return scaled seconds since the loop was made."""
        return (time.monotonic() - self._start_s) * self._speed


def loop_factory(speed: float) -> Callable[[], AbstractEventLoop]:
    """Choose the loop for a speed: infinite is virtual time, any other a multiple of real time."""
    return VirtualTimeLoop if math.isinf(speed) else lambda: ScaledTimeLoop(speed)


def run_virtual(main: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in virtual time."""
    with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        return runner.run(main)
