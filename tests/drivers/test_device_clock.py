"""The counter says which sample it is and the arrival when, whatever the line does to them."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from drivers.device_clock import DeviceClock
from drivers.interfaces import FloatArray, IntArray

PERIOD_S = 0.001
KVH_MODULUS = 128
STIM_MODULUS = 256
MICROSECOND = 1e-6


def kvh_clock() -> DeviceClock:
    return DeviceClock(KVH_MODULUS, counts_per_sample=1, sample_period_s=PERIOD_S)


def deliver(
    clock: DeviceClock, ticks: list[int], late_s: float = 0.0, *, bytes_lost: bool = False
) -> list[int]:
    """Place samples of these true ticks, which arrive ``late_s`` after the last was taken."""
    counter = np.array(ticks) % KVH_MODULUS
    tick, _ = clock.place(counter, ticks[-1] * PERIOD_S + late_s, bytes_lost=bytes_lost)
    return list(tick)


def span(start: int, end: int) -> list[int]:
    return list(range(start, end))


def test_an_unbroken_count_goes_on_across_wraps() -> None:
    clock = kvh_clock()
    for start in range(0, 1000, 50):
        assert deliver(clock, span(start, start + 50)) == span(start, start + 50)


@pytest.mark.parametrize("sample_rate_hz", [125, 250, 500, 1000, 2000])
def test_a_counter_that_steps_by_more_than_one_counts_samples(sample_rate_hz: int) -> None:
    step = 2000 // sample_rate_hz  # the STIM300 counts its 2000 Hz, whatever it sends
    clock = DeviceClock(STIM_MODULUS, step, 1 / sample_rate_hz)
    taken = np.delete(np.arange(1000), [5, 6, 300])
    tick, time_s = clock.place(
        taken * step % STIM_MODULUS, taken[-1] / sample_rate_hz, bytes_lost=True
    )
    assert_array_equal(tick, taken)
    assert time_s == pytest.approx(taken / sample_rate_hz)


def test_samples_lost_within_and_between_deliveries_leave_gaps_in_the_ticks() -> None:
    clock = kvh_clock()
    for ticks in ([0, 1, 2, 7, 8], [9, 10], [120, 121, 130, 131], [258, 259]):
        assert deliver(clock, ticks, bytes_lost=True) == ticks


def test_a_delivery_that_is_merely_late_loses_nothing_and_makes_no_jump() -> None:
    clock = kvh_clock()
    deliver(clock, span(0, 10))
    assert deliver(clock, span(10, 20), late_s=0.7) == span(10, 20)
    counter = np.arange(20, 740) % KVH_MODULUS
    tick, time_s = clock.place(counter, 0.740, bytes_lost=False)
    assert list(tick) == span(20, 740)
    assert time_s == pytest.approx(tick * PERIOD_S)


def test_a_loss_of_more_than_a_wrap_is_told_by_the_arrival() -> None:
    clock = kvh_clock()
    deliver(clock, span(0, 50))
    assert deliver(clock, span(350, 400)) == span(350, 400)


def test_a_loss_of_exactly_one_wrap_is_told_by_the_discarded_bytes() -> None:
    clock = kvh_clock()
    deliver(clock, span(0, 50))
    assert deliver(clock, span(178, 200), bytes_lost=True) == span(178, 200)


def test_the_wraps_of_a_long_loss_belong_to_the_gap_and_not_to_the_samples_before_it() -> None:
    clock = kvh_clock()
    deliver(clock, span(0, 50))
    broken = [*span(50, 60), *span(350, 400)]
    assert deliver(clock, broken) == broken


def test_the_latency_of_the_delivery_before_does_not_hide_a_wrap() -> None:
    clock = kvh_clock()
    deliver(clock, span(0, 50))
    deliver(clock, span(50, 60), late_s=0.1)
    assert deliver(clock, span(360, 400)) == span(360, 400)


@given(
    st.lists(
        st.tuples(
            st.integers(0, KVH_MODULUS - 1),  # lost
            st.integers(1, 400),  # arriving
            st.floats(0.0, 0.7),  # late, in wraps
        ),
        max_size=30,
    )
)
def test_for_any_losses_shorter_than_the_wrap_the_count_is_exact(
    deliveries: list[tuple[int, int, float]],
) -> None:
    clock = kvh_clock()
    deliver(clock, [0])
    tick = 1
    for lost, arriving, late_wraps in deliveries:
        ticks = span(tick + lost, tick + lost + arriving)
        late_s = late_wraps * KVH_MODULUS * PERIOD_S
        assert deliver(clock, ticks, late_s, bytes_lost=lost > 0) == ticks
        tick = ticks[-1] + 1


def jittered(
    count: int, device_period_s: float, random: np.random.Generator
) -> Iterator[tuple[IntArray, FloatArray, float]]:
    """Yield bursts of 50 samples: ticks, the instants at which they were taken, the arrival."""
    for start in range(0, count, 50):
        tick = np.arange(start, start + 50, dtype=np.int64)
        taken_s = 100.0 + tick.astype(np.float64) * device_period_s
        yield tick, taken_s, float(taken_s[-1] + 0.002 + random.exponential(0.01))


def test_under_jitter_times_are_late_by_no_more_than_the_smallest_latency() -> None:
    clock = kvh_clock()
    errors_s = []
    for tick, taken_s, arrival_s in jittered(20_000, PERIOD_S, np.random.default_rng(1)):
        _, time_s = clock.place(tick % KVH_MODULUS, arrival_s, bytes_lost=False)
        assert time_s[-1] <= arrival_s
        errors_s.append(time_s[-1] - taken_s[-1])
    # After 100 bursts the quickest has waited 2.0 ms and, with 99.9 % confidence, < 0.7 ms more.
    assert np.all(np.array(errors_s[100:]) >= 0.002 - MICROSECOND)
    assert np.all(np.array(errors_s[100:]) < 0.002 + 0.0007)


@pytest.mark.parametrize("drift", [50e-6, -50e-6], ids=["slow crystal", "fast crystal"])
def test_the_mapping_follows_a_drifting_crystal(drift: float) -> None:
    clock = kvh_clock()
    device_period_s = PERIOD_S * (1 + drift)  # 30 ms astray after ten minutes
    worst_s = 0.0
    for tick, taken_s, arrival_s in jittered(600_000, device_period_s, np.random.default_rng(2)):
        _, time_s = clock.place(tick % KVH_MODULUS, arrival_s, bytes_lost=False)
        if tick[0] > 20_000:
            worst_s = max(worst_s, abs(float(time_s[-1] - taken_s[-1]) - 0.002))
    # The window's 20 s of drift, and the smallest of 200 latencies.
    assert worst_s < 20.0 * 50e-6 + 0.0007


def test_after_the_device_was_away_ticks_go_on_by_the_time_that_passed() -> None:
    clock = kvh_clock()
    deliver(clock, span(0, 50))
    clock.restart(10.0)
    tick, time_s = clock.place(np.array([77, 78, 79]), 10.002, bytes_lost=False)
    assert list(tick) == [10_000, 10_001, 10_002]
    assert time_s == pytest.approx([10.0, 10.001, 10.002])


def test_a_loss_in_the_first_delivery_after_a_break_does_not_count_the_break_twice() -> None:
    clock = kvh_clock()
    deliver(clock, span(0, 50))
    clock.restart(10.0)
    tick, _ = clock.place(np.array([77, 79]), 10.002, bytes_lost=True)
    assert list(tick) == [10_000, 10_002]


def test_ticks_increase_even_if_the_device_was_away_for_no_time() -> None:
    clock = kvh_clock()
    deliver(clock, span(0, 50))
    clock.restart(0.049)
    tick, _ = clock.place(np.array([0]), 0.050, bytes_lost=False)
    assert list(tick) == [50]


def test_a_restart_before_the_first_sample_changes_nothing() -> None:
    clock = kvh_clock()
    clock.restart(10.0)
    assert deliver(clock, [0, 1, 2]) == [0, 1, 2]


@pytest.mark.parametrize("taken", [1, 20, 50, 100])
def test_a_delivery_that_comes_twice_keeps_its_ticks(taken: int) -> None:
    """A converter repeats a burst: no sample can arrive before it was taken."""
    clock = kvh_clock()
    begin = 0
    for _ in range(10):
        once = span(begin, begin + taken)
        begin += taken
        assert deliver(clock, once) == once
        assert deliver(clock, once + once, late_s=0.002) == once + once
        assert deliver(clock, once, late_s=0.004) == once


def test_messages_that_come_twice_one_by_one_keep_their_ticks() -> None:
    """A bus sends a frame again: in one delivery as often as it likes."""
    clock = kvh_clock()
    deliver(clock, [0])
    for start in range(1, 5000, 50):
        sent = [tick for tick in span(start, start + 50) for _ in range(1 + (tick % 7 == 0))]
        assert deliver(clock, sent) == sent


def test_a_true_loss_is_not_taken_for_a_repeat() -> None:
    """More than half a wrap is missing, and the time for it has passed."""
    clock = kvh_clock()
    assert deliver(clock, span(0, 50)) == span(0, 50)
    assert deliver(clock, span(150, 160), bytes_lost=True) == span(150, 160)
