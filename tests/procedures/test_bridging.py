"""Short gaps in a stream are bridged by straight lines, long ones told; nothing twice."""

import numpy as np
import pytest

from drivers.interfaces import FloatArray, SampleBlock
from northfinder.procedures.bridging import BRIDGED_S, Bridge, Increments

PERIOD_S = 0.01
SECOND = 100
LONGEST = round(BRIDGED_S / PERIOD_S)


def ramp(tick: FloatArray) -> FloatArray:
    """Six readings that all grow with time, each by a slope of its own: a line bridges them."""
    return np.outer(tick, np.arange(1.0, 7.0))


def block(missing: set[int], begin: int = 0, invalid: int | None = None) -> SampleBlock:
    tick = np.array([t for t in range(begin, begin + SECOND) if t not in missing], dtype=np.int64)
    time_s: FloatArray = PERIOD_S * tick.astype(np.float64)
    readings, valid = ramp(time_s / PERIOD_S), np.ones((len(tick), 3), dtype=np.bool_)
    force_valid = valid.copy()
    if invalid is not None:
        force_valid[tick == invalid, 2] = False
    nothing = np.full(len(tick), np.nan)
    return SampleBlock(tick, time_s, readings[:, :3], readings[:, 3:], valid, force_valid, nothing)


def bridged(*blocks: SampleBlock) -> tuple[list[Increments], Bridge]:
    bridge = Bridge(PERIOD_S)
    parts = [
        part
        for second, samples in enumerate(blocks)
        for part in bridge.increments(samples, second * SECOND, SECOND)
    ]
    return parts, bridge


def angles(parts: list[Increments]) -> FloatArray:
    return np.vstack([part.angle_rad for part in parts])


@pytest.mark.parametrize(
    "missing", [set(), {5}, {50, 51, 52}, {98, 99}, {99, 100, 101}, {100}, {0}]
)
def test_a_line_stands_for_what_is_missing(missing: set[int]) -> None:
    parts, bridge = bridged(block(missing), block(missing, SECOND))
    first = 1 if 0 in missing else 0
    whole = ramp(np.arange(float(first), 2 * SECOND))[:, :3] * PERIOD_S
    assert angles(parts) == pytest.approx(whole)
    assert bridge.bridged == len(missing - {0})
    assert not any(part.after_gap for part in parts)


def test_a_sample_that_one_axis_is_not_vouched_for_counts_as_lost() -> None:
    parts, bridge = bridged(block(set(), invalid=40))
    assert bridge.bridged == 1
    assert angles(parts) == pytest.approx(ramp(np.arange(100.0))[:, :3] * PERIOD_S)


def test_the_longest_gap_is_bridged_and_a_longer_one_is_told() -> None:
    within = set(range(20, 20 + LONGEST))
    parts, _ = bridged(block(within))
    assert [part.after_gap for part in parts] == [False]
    parts, bridge = bridged(block(within | {20 + LONGEST}))
    assert [part.after_gap for part in parts] == [False, True]
    assert [len(part.angle_rad) for part in parts] == [20, SECOND - 20 - LONGEST - 1]
    assert bridge.bridged == 0


def test_a_gap_over_the_edge_of_two_stretches_and_over_a_whole_one() -> None:
    over = set(range(97, 97 + LONGEST + 1))
    parts, _ = bridged(block(over), block(over, SECOND))
    assert [part.after_gap for part in parts] == [False, True]
    nothing = block(set(range(SECOND, 2 * SECOND)), SECOND)
    parts, _ = bridged(block(set()), nothing, block(set(), 2 * SECOND))
    assert [part.after_gap for part in parts] == [False, True]
    assert len(angles(parts)) == 2 * SECOND
