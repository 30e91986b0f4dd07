"""Samples that a record lacks: filled where that cannot show, refused where it could."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.arrays import FloatArray, IntArray, as_finite

LONGEST_GAP = 100
LARGEST_SHARE = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class FilledRecord:
    """An equidistant record.

    Attributes:
        value: In the readings' unit, ``(k,)``.
        filled: How many of them nobody measured.
        gaps: In how many places.
        longest: Samples in the longest.
    """

    value: FloatArray
    filled: int
    gaps: int
    longest: int


def fill_gaps(tick: ArrayLike, value: ArrayLike, longest: int = LONGEST_GAP) -> FilledRecord:
    """Bridge the missing samples of a record by straight lines.

    A gap of g is a line from the mean of the g samples before it to that of the g after it (as
    many as there are without a gap): as uncertain as white noise would have it, where single
    neighbours would carry their noise g times. The line has no noise of its own, and its
    neighbours count half as much again: under white noise the Allan variance is short by the
    share of filled samples at the shortest tau, and too large by one and a half times that share
    at taus well above the gap. So at most one sample in a hundred is filled: 0.75 % of the
    deviation.

    Args:
        tick: Number of each sample, ascending, ``(n,)``: a counter, unwrapped.
        value: Readings, ``(n,)``.
        longest: Missing samples in a row that may be bridged.

    Raises:
        ValueError: A gap is too long, too much is missing, or the ticks do not ascend.
    """
    ticks, values = _as_ticks(tick), as_finite("value", value)
    if values.shape != ticks.shape:
        msg = f"each reading needs its tick; got {ticks.shape} ticks and {values.shape} values"
        raise ValueError(msg)
    missing = np.diff(ticks) - 1
    before = np.flatnonzero(missing)
    _check(ticks, missing, longest)
    record = np.full(int(ticks[-1] - ticks[0]) + 1, np.nan)
    record[ticks - ticks[0]] = values
    measured = record.copy()  # so that no gap is filled from another
    for index in before:
        start, gap = int(ticks[index] - ticks[0]) + 1, int(missing[index])
        end = start + gap
        left = _nearest(measured[max(0, start - gap) : start][::-1])
        right = _nearest(measured[end : end + gap])
        record[start:end] = left + (right - left) * np.arange(1, gap + 1) / (gap + 1)
    return FilledRecord(record, int(missing.sum()), len(before), int(missing.max(initial=0)))


def _as_ticks(tick: ArrayLike) -> IntArray:
    ticks = np.asarray(tick)
    if ticks.ndim != 1 or len(ticks) == 0 or not np.issubdtype(ticks.dtype, np.integer):
        msg = f"ticks need integers of shape (n,), one a sample; got {ticks.dtype} {ticks.shape}"
        raise ValueError(msg)
    ascending = ticks.astype(np.int64)
    back = np.flatnonzero(np.diff(ascending) <= 0)
    if len(back):
        first, second = ascending[back[0]], ascending[back[0] + 1]
        msg = f"ticks must ascend, but {second} follows {first}: unwrap the counter, drop repeats"
        raise ValueError(msg)
    return ascending


def _check(ticks: IntArray, missing: IntArray, longest: int) -> None:
    worst = int(missing.max(initial=0))
    if worst > longest:
        msg = (
            f"{worst} samples are missing after tick {ticks[int(missing.argmax())]}, more than the "
            f"{longest} that may be bridged: measure again, or use the longer part"
        )
        raise ValueError(msg)
    lost, whole = int(missing.sum()), int(ticks[-1] - ticks[0]) + 1
    if lost > LARGEST_SHARE * whole:
        msg = (
            f"{lost} of {whole} samples are missing, more than the {LARGEST_SHARE:.0%} that may be "
            "filled without showing: mend the link and measure again"
        )
        raise ValueError(msg)


def _nearest(values: FloatArray) -> float:
    """Mean of the samples up to the next gap; the first is there."""
    gap = np.flatnonzero(np.isnan(values))
    return float(values[: gap[0] if len(gap) else None].mean())
