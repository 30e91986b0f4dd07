"""Durations compared within one run; the absolute ones belong to the proof."""

import time
from collections.abc import Callable
from importlib import import_module

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from northfinder.attitude import integrate
from northfinder.attitude.kernels import integrate_compiled
from tests.attitude.motions import Array
from tests.evidence import Record

DT_S = 0.005
UPDATES = 1_000_000
RATE: Array = 0.3 * np.random.default_rng(11).normal(size=(2 * UPDATES + 1, 3))


def updates_s(job: Callable[[], object], updates: int, repeats: int = 7) -> float:
    """Updates in a second, at best."""

    def once() -> float:
        start_s = time.perf_counter()
        job()
        return time.perf_counter() - start_s

    return updates / min(once() for _ in range(repeats))


def compiled_updates_s() -> float:
    return updates_s(lambda: integrate_compiled(RATE, DT_S, "rate-vector"), UPDATES)


def plain_updates_s() -> float:
    return updates_s(lambda: integrate(RATE, DT_S, "rate-vector"), UPDATES, 3)


@pytest.mark.alone
def test_the_bulk_scan_is_twenty_times_as_fast_as_scipys_rotations_in_a_loop() -> None:
    steps = Rotation.from_rotvec(DT_S * RATE[:2000])

    def looped() -> None:
        now = Rotation.identity()
        for step in steps:
            now *= step

    assert plain_updates_s() > 20.0 * updates_s(looped, 2000)


@pytest.mark.alone
def test_compiled_it_is_several_times_as_fast_as_pyins(record_property: Record) -> None:
    """From rates to attitudes, as pyins does it: rotation vectors, then its compiled loop."""
    pandas, strapdown = import_module("pandas"), import_module("pyins.strapdown")
    util, compiled = import_module("pyins.util"), import_module("pyins._numba_integrate")
    count = 200_000
    rows = np.hstack([RATE[:count], np.zeros((count, 3))])
    columns = [*util.GYRO_COLS, *util.ACCEL_COLS]
    imu = pandas.DataFrame(rows, index=DT_S * np.arange(count), columns=columns)
    place, velocity, attitude = (np.zeros((count, *s)) for s in ((3,), (3,), (3, 3)))
    attitude[0] = np.eye(3)

    def theirs() -> None:
        made = strapdown.compute_increments_from_imu(imu, "rate").to_numpy()
        theta, gained = made[:, 1:4].copy(), made[:, 4:].copy()
        compiled.integrate(made[:, 0].copy(), place, velocity, attitude, theta, gained, 0, False)

    ratio = compiled_updates_s() / updates_s(theirs, count - 1)
    record_property("measured", f"compiled {ratio:.1f} times python-ins")
    assert ratio > 5.0


@pytest.mark.alone
@pytest.mark.proof
def test_bulk_integration_makes_four_million_updates_a_second(record_property: Record) -> None:
    updates = plain_updates_s()
    record_property("measured", f"NumPy {updates / 1e6:.1f} million/s")
    assert updates >= 4e6


@pytest.mark.alone
@pytest.mark.proof
def test_compiled_integration_makes_fifty_million_updates_a_second(
    record_property: Record,
) -> None:
    updates = compiled_updates_s()
    record_property("measured", f"compiled {updates / 1e6:.0f} million/s")
    assert updates >= 50e6
