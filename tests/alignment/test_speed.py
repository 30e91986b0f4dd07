"""Durations compared within one run."""

import time
from collections.abc import Callable
from importlib import import_module

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from northfinder.alignment import Aligner, quest
from tests.alignment.bases import LATITUDE_RAD, SENSORS
from tests.alignment.fans import apart_rad, gravity_fan
from tests.evidence import Record

COUNT = 15_000


def best_s(job: Callable[[], object], repeats: int) -> float:
    def once() -> float:
        start_s = time.perf_counter()
        job()
        return time.perf_counter() - start_s

    return min(once() for _ in range(repeats))


@pytest.mark.alone
def test_fifteen_thousand_pairs_take_a_third_of_scipys_time(record_property: Record) -> None:
    _, V = gravity_fan(120.0, COUNT)
    rng = np.random.default_rng(1)
    W = Rotation.random(rng=rng).apply(V) + 1e-4 * rng.normal(size=V.shape)
    theirs = best_s(lambda: Rotation.align_vectors(W, V), 40)
    ratio = theirs / best_s(lambda: quest(W, V), 40)
    record_property("measured", f"one attitude: {ratio:.1f} times scipy")
    assert ratio > 3.0


@pytest.mark.alone
def test_fifteen_thousand_attitudes_take_a_twentieth_of_ahrs_time(
    record_property: Record,
) -> None:
    truth = Rotation.random(COUNT, rng=np.random.default_rng(2))
    known = np.array([[0.0, 0.0, 1.0], [0.5, 0.0, -np.sqrt(0.75)]])
    seen = np.stack([truth.inv().apply(v) for v in known], axis=1)
    V = np.broadcast_to(known, seen.shape)
    found = quest(seen, V)
    assert max(apart_rad(q, t.inv()) for q, t in zip(found[:50], truth[:50], strict=True)) < 1e-14
    solver = import_module("ahrs.filters").QUEST
    theirs = best_s(lambda: solver(acc=seen[:, 0], mag=seen[:, 1], magnetic_dip=60.0), 1)
    ratio = theirs / best_s(lambda: quest(seen, V), 7)
    record_property("measured", f"15 000 attitudes: {ratio:.0f} times ahrs")
    assert ratio > 20.0


@pytest.mark.alone
@pytest.mark.parametrize("method", ["quest-taper", "quest"])
def test_a_stream_at_1_khz_takes_a_fifth_of_a_core_at_most(method: str) -> None:
    """Blocks of 50 samples, and a solution ten times a second after two minutes."""
    rng = np.random.default_rng(3)
    angle = 1e-6 * rng.normal(size=(120_000, 3))
    velocity = 1e-6 * rng.normal(size=angle.shape) + [0.0, 0.0, 1e-3]
    aligner = Aligner(method, LATITUDE_RAD, 1e-3, sensors=SENSORS)
    start_s = time.process_time()
    for i in range(0, len(angle), 50):
        aligner.add(angle[i : i + 50], velocity[i : i + 50])
    adding = (time.process_time() - start_s) / 120.0
    start_s = time.process_time()
    for _ in range(10):
        aligner.solve()
    assert adding + time.process_time() - start_s < 0.2
