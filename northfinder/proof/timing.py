"""Durations, and what this machine can do at most, measured in the same run."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

_COPIED = 16_000_000  # 128 MB: beyond every cache
_SIDE = 1000


def best_of(job: Callable[[], object], repeats: int) -> float:
    """Return the least of several durations in s: whatever disturbs one only adds to it."""
    durations_s = []
    for _ in range(repeats):
        start_s = time.perf_counter()
        job()
        durations_s.append(time.perf_counter() - start_s)
    return min(durations_s)


class Machine(NamedTuple):
    """What numpy reaches here when it does nothing else.

    Attributes:
        bytes_s: Read and written by a copy that no cache holds.
        flops: Of a product of two matrices, in double precision.
    """

    bytes_s: float
    flops: float

    @classmethod
    def measured(cls) -> "Machine":
        """Copy 128 MB and multiply two matrices of 1000 by 1000."""
        source = np.ones(_COPIED)
        target = np.empty_like(source)
        square = np.ones((_SIDE, _SIDE))
        copied_s = best_of(lambda: np.copyto(target, source), 7)
        multiplied_s = best_of(lambda: square @ square, 7)
        return cls(2 * source.nbytes / copied_s, 2 * _SIDE**3 / multiplied_s)

    def memory_limit(self, moved_bytes: float, duration_s: float) -> str:
        """Say what share of a copy's bandwidth this is: what must be read and written, once."""
        share = moved_bytes / duration_s / self.bytes_s
        return f"memory {self.bytes_s / 1e9:.1f} GB/s: {_percent(share)} of it"

    def flops_limit(self, operations: float, duration_s: float) -> str:
        """Say what share of a matrix product's speed this is."""
        share = operations / duration_s / self.flops
        return f"{self.flops / 1e9:.1f} Gflop/s: {_percent(share)} of it"


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"
