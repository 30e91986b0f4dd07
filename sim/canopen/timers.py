"""What a node does again and again, in loop time."""

import asyncio
import contextlib
from collections.abc import Callable, Hashable
from dataclasses import dataclass

_JITTER_S = 1e-9  # sums of periods are not exact


@dataclass(slots=True)
class _Timer:
    action: Callable[[], None]
    period_s: float
    due_s: float


class Timers:
    """Periodic actions, each under a key; a changed period counts from the moment of its change."""

    def __init__(self) -> None:
        self._timers: dict[Hashable, _Timer] = {}
        self._changed = asyncio.Event()

    def set(self, key: Hashable, action: Callable[[], None], period_s: float) -> None:
        """Repeat an action, the first time after one period; with 0, no more."""
        if period_s > 0:
            due_s = asyncio.get_running_loop().time() + period_s
            self._timers[key] = _Timer(action, period_s, due_s)
            self._changed.set()
        else:
            self._timers.pop(key, None)

    async def run(self) -> None:
        """Carry the actions out until cancelled; one that raises ends it with its exception."""
        loop = asyncio.get_running_loop()
        while True:
            self._changed.clear()
            due_s = min((timer.due_s for timer in self._timers.values()), default=None)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(due_s):
                    await self._changed.wait()
            now_s = loop.time() + _JITTER_S
            for timer in [timer for timer in self._timers.values() if timer.due_s <= now_s]:
                late = now_s - timer.due_s > timer.period_s  # what was missed is not made up for
                timer.due_s = (now_s if late else timer.due_s) + timer.period_s
                timer.action()
