"""Which SYNC an answer belongs to, when answers come late, or not at all."""

import asyncio
from collections.abc import Callable

import numpy as np
import pytest

from drivers.canopen.node import CanopenNode
from drivers.canopen.sync_clock import SyncClock
from drivers.interfaces import CanFrame, Counters
from drivers.links.can_port import CanPort
from drivers.links.memory_can import MemoryBus
from sim.clock import run_virtual

PERIOD_S = 0.01


def placed(
    answers: Callable[[list[float]], list[list[float]]], *, syncs: int = 60
) -> tuple[list[int], list[float], Counters]:
    """Send some SYNCs, and place the deliveries that a bus makes of them."""
    sent_s: list[float] = []
    counters = Counters()

    async def session() -> tuple[list[int], list[float]]:
        bus = MemoryBus("bus")
        bus.attach(lambda _: sent_s.append(asyncio.get_running_loop().time()))
        port = CanPort(bus)
        await port.open()
        clock = SyncClock(_Node(port), PERIOD_S, counters)
        clock.start()
        await asyncio.sleep((syncs - 0.5) * PERIOD_S)
        await clock.stop()
        placings = [clock.place(np.array(part)) for part in answers(sent_s)]
        ticks = [int(tick) for tick, _ in placings for tick in tick]
        return ticks, [float(time_s) for _, times in placings for time_s in times]

    ticks, times_s = run_virtual(session())
    assert np.diff(sent_s) == pytest.approx(PERIOD_S)
    return ticks, times_s, counters


class _Node(CanopenNode):
    """One that is not there: only its bus is needed."""

    def __init__(self, port: CanPort) -> None:
        super().__init__(port, 6)
        self._port = port

    async def send(self, frame: CanFrame) -> None:
        await self._port.write(frame)


def test_each_answer_has_the_number_and_the_time_of_its_sync() -> None:
    ticks, times_s, counters = placed(lambda sent: [[t + 0.001] for t in sent])
    assert ticks == list(range(60))
    assert times_s == pytest.approx([n * PERIOD_S for n in range(60)])
    assert (counters.frames, counters.lost) == (60, 0)


def test_answers_that_come_after_the_next_sync_keep_their_places() -> None:
    """A bus that is busy for a moment: three answers after the third of their SYNCs."""

    def late(sent: list[float]) -> list[list[float]]:
        held = [t + 0.001 for t in sent]
        held[20] = held[21] = held[22]
        return [held[:20], held[20:40], held[40:]]

    ticks, _, counters = placed(late)
    assert ticks == list(range(60))
    assert counters.lost == 0


@pytest.mark.parametrize("each_s", [0.0, 0.003, 0.006], ids=lambda each_s: f"{each_s:g} s each")
def test_a_device_that_was_held_up_and_catches_up_has_lost_nothing(each_s: float) -> None:
    """For half a second it answers nothing, then all that waits, one after the other."""
    ticks, _, counters = placed(lambda sent: [[t] for t in held_up(sent, each_s)], syncs=200)
    assert ticks == list(range(200))
    assert counters.lost == 0


def test_what_is_lost_while_answers_wait_is_counted_once_they_have_caught_up() -> None:
    def one_fewer(sent: list[float]) -> list[list[float]]:
        return [[t] for n, t in enumerate(held_up(sent, 0.003)) if n != 30]

    ticks, _, counters = placed(one_fewer, syncs=200)
    assert counters.lost == 1
    assert ticks[-1] == 199


def held_up(sent: list[float], each_s: float) -> list[float]:
    """Return when a device answers that cannot from the 20th SYNC to the 70th."""
    answered_s: list[float] = []
    for n, asked_s in enumerate(sent):
        free_s = sent[70] if n == 20 else answered_s[-1] + each_s if n > 20 else 0.0
        answered_s.append(max(asked_s + 0.001, free_s))
    return answered_s


def test_a_lost_answer_is_counted_once_the_others_stay_ahead() -> None:
    ticks, _, counters = placed(lambda sent: [[t + 0.001] for n, t in enumerate(sent) if n != 20])
    assert counters.lost == 1
    assert ticks[-1] == 59
    assert len(set(ticks)) == 59


def test_a_long_silence_is_counted() -> None:
    ticks, _, counters = placed(
        lambda sent: [[t + 0.001] for n, t in enumerate(sent) if not 10 <= n < 50], syncs=80
    )
    assert ticks[:10] == list(range(10))
    assert ticks[-1] == 79
    assert counters.lost == 40


def test_a_second_answer_to_one_sync_keeps_its_number() -> None:
    ticks, _, counters = placed(lambda sent: [[sent[0] + 0.001, sent[0] + 0.002]], syncs=1)
    assert ticks == [0, 0]
    assert counters.lost == 0
