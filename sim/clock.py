"""Event loops whose time is virtual, paced or scaled; drivers and procedures only ask the loop."""

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
_LONGEST_LAG_S = 0.2  # by the wall: of ordinary jitter, which is made good so that the pace holds


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


class _PacedSelector(selectors.DefaultSelector):
    """Wait for the wall where time is ahead of it; where it is behind, step without waiting.

    ``now_s`` should be ``_anchor_s`` plus ``speed`` times the wall's seconds since
    ``_anchor_wall_s``. It never exceeds that, and never passes a deadline that is still to come.
    """

    def __init__(self, speed: float) -> None:
        super().__init__()
        self.now_s = 0.0
        self._speed = speed
        self._anchor_s, self._anchor_wall_s = 0.0, time.monotonic()

    def select(self, timeout: float | None = None) -> _Ready:
        self._forget_a_long_stall()
        deadline_s = math.inf if timeout is None else self.now_s + timeout
        wait_s = None if timeout is None else max(0.0, deadline_s - self._due_s()) / self._speed
        ready = super().select(wait_s)
        # After waiting in full, the deadline itself: how late the wake-up was is lag.
        reached_s = self._due_s() if ready or timeout is None else deadline_s
        self.now_s = max(self.now_s, min(reached_s, deadline_s))
        return ready

    def _due_s(self) -> float:
        """Return what time it should be by the wall."""
        return self._anchor_s + (time.monotonic() - self._anchor_wall_s) * self._speed

    def _forget_a_long_stall(self) -> None:
        """Let time go on from where it stands: catching up would run everything too fast."""
        if self._due_s() - self.now_s > _LONGEST_LAG_S * self._speed:
            self._anchor_s, self._anchor_wall_s = self.now_s, time.monotonic()


class PacedTimeLoop(asyncio.SelectorEventLoop):
    """Event loop whose time runs ``speed`` times as fast as the wall's, deadline by deadline.

    Time advances only while the loop waits, never past the next deadline. So a process that
    stalls (a busy machine, another thread that keeps the interpreter) makes time lag, in order;
    it does not make a second of device time pass unseen, in which every deadline fails although
    nothing is wrong. A short lag is made good, a long one forgotten.

    Time goes on while thread jobs are pending, as it does with hardware.

    Args:
        speed: Multiple of real time, finite and positive.
    """

    def __init__(self, speed: float) -> None:
        self._paced = _PacedSelector(speed)
        super().__init__(self._paced)

    def time(self) -> float:
        """Return paced seconds since the loop was made."""
        return self._paced.now_s


class _ScaledSelector(selectors.DefaultSelector):
    def __init__(self, speed: float) -> None:
        super().__init__()
        self._speed = speed

    def select(self, timeout: float | None = None) -> _Ready:
        return super().select(timeout if timeout is None else timeout / self._speed)


class ScaledTimeLoop(asyncio.SelectorEventLoop):
    """Event loop whose time is the wall's, ``speed`` times as fast: for whom others talk to."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._start_s = time.monotonic()
        super().__init__(_ScaledSelector(speed))

    def time(self) -> float:
        """Return scaled seconds since the loop was made."""
        return (time.monotonic() - self._start_s) * self._speed


def loop_factory(speed: float) -> Callable[[], AbstractEventLoop]:
    """Choose a simulation's loop: infinite speed is virtual time, any other is paced."""
    return VirtualTimeLoop if math.isinf(speed) else lambda: PacedTimeLoop(speed)


def run_virtual(main: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in virtual time."""
    with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        return runner.run(main)
