"""Messages of 1 kHz with a counter of eight bits: what a pause hid is told, and only that."""

import numpy as np

from drivers.arrival_account import ArrivalAccount
from drivers.interfaces import Counters, FloatArray

PERIOD_S = 0.001
WRAP = 256
BURST = 50


def lost(number: FloatArray, arrival_s: FloatArray) -> list[int]:
    """Return how many are counted as lost, burst by burst, of messages with these numbers."""
    counters = Counters()
    account = ArrivalAccount(WRAP, PERIOD_S, counters)
    account.restart()
    told = []
    for begin in range(0, len(number), BURST):
        burst = slice(begin, begin + BURST)
        account.place((number[burst] % WRAP).astype(np.int64), arrival_s[burst], 0)
        told.append(counters.lost)
    return told


def test_a_computer_that_was_held_up_has_lost_nothing() -> None:
    """It stood still from the second second on for 0.6 s, and took 0.1 s to catch up."""
    number = np.arange(5000.0)
    due_s = number * PERIOD_S
    late = (due_s > 2.0) & (due_s < 2.7)
    arrival_s = np.where(late, 2.6 + (due_s - 2.0) / 7, due_s)
    assert set(lost(number, arrival_s)) == {0}


def test_a_loss_of_whole_wraps_is_told_a_second_later() -> None:
    number = np.concatenate([np.arange(2000), np.arange(2000 + 3 * WRAP, 6000)]).astype(float)
    told = lost(number, number * PERIOD_S)
    begun = 2000 // BURST
    assert set(told[: begun + 20]) == {0}
    assert set(told[begun + 21 :]) == {3 * WRAP}


def test_any_other_loss_is_told_at_once() -> None:
    number = np.concatenate([np.arange(2000), np.arange(2700, 6000)]).astype(float)
    told = lost(number, number * PERIOD_S)
    assert set(told[2000 // BURST :]) == {700}
