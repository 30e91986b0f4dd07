"""Tables of `coning-rate-vector`: drift, an hour of navigation, cost."""

import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from northfinder.attitude import integrate
from northfinder.studies.claim import Quantity
from northfinder.studies.cone import drift_deg_h
from northfinder.studies.cone_navigation import Hour
from northfinder.studies.operations import count
from northfinder.studies.study import Cell, Table

_TRAILING: Final = {"kind": "increments"}
#: Name, method, samples in 10 ms, options, leading term over p^2 O with Lambda = O h.
_DRIFTS: Final[tuple[tuple[str, str, int, dict[str, Any], str], ...]] = (
    ("one-sample", "one-sample", 1, {"kind": "increments"}, "-L^2/12"),
    ("two-sample, true increments", "two-sample", 2, {"kind": "increments"}, "-L^4/960"),
    ("two-sample, trapezoids", "two-sample", 2, {"extraction": "trapezoid"}, ""),
    ("two-sample, parabola", "two-sample", 2, {"extraction": "quadratic"}, ""),
    ("three-sample, Taylor", "three-sample-taylor", 3, {"kind": "increments"}, "+L^4/6480"),
    ("three-sample, optimal", "three-sample", 3, {"kind": "increments"}, "-L^6/204120"),
    ("four-sample, Taylor", "four-sample-taylor", 4, {"kind": "increments"}, "+L^6/387072"),
    ("four-sample, optimal", "four-sample", 4, {"kind": "increments"}, "-L^8/82575360"),
    ("eq 16, 3 rates", "rate-vector-taylor", 2, {}, "-L^4/960"),
    ("eq 17, 3 rates", "rate-vector", 2, {}, "+L^4/2880"),
    ("(1/120, 3/40), 3 rates, ours", "rate-vector-optimal", 2, {}, "-37 L^6/967680"),
    ("quaternion RK4, 3 rates", "rk4", 2, {}, "+L^4/960"),
    ("trailing increments, 1 before", "trailing-1", 2, _TRAILING, ""),
    ("trailing increments, 2 before", "trailing-2", 2, _TRAILING, ""),
    ("trailing increments, 3 before", "trailing-3", 2, _TRAILING, ""),
    ("trailing increments, 4 before", "trailing-4", 2, _TRAILING, ""),
    ("functional, blocks of 8", "functional", 2, {"kind": "increments", "n": 8}, ""),
    ("functional, blocks of 10", "functional", 2, {"kind": "increments", "n": 10}, ""),
)
_TIMED_UPDATES = 200_000


def drift_table(eq_17_true_deg_h: float) -> Table:
    """Return the drift of every method under the same cone."""
    rows: list[tuple[Cell, ...]] = [
        (name, _drift(drift_deg_h(method, samples, **options)), leading)
        for name, method, samples, options, leading in _DRIFTS
    ]
    after_eq_17 = 1 + next(i for i, row in enumerate(rows) if row[0] == "eq 17, 3 rates")
    rows.insert(
        after_eq_17, ("eq 17 with the true increment", _drift(eq_17_true_deg_h), "-L^6/80640")
    )
    columns = ("method", "drift", "leading term / p^2 O, L = O h")
    return Table("Drift under the cone", columns, tuple(rows))


def _drift(deg_h: float) -> Quantity:
    """Rounding reaches the third digit of the smallest."""
    return Quantity(deg_h, "deg/h", "+.3g" if abs(deg_h) > 3e-6 else "+.1e")


def hour_table(hours: Sequence[tuple[str, Hour, Hour | None]]) -> Table:
    """Return largest errors of position without and with the paper's sensor errors."""
    rows = tuple(
        (
            name,
            Quantity(ideal.position_m, "m", ".0f"),
            None if real is None else Quantity(real.position_m, "m", ".0f"),
        )
        for name, ideal, real in hours
    )
    columns = ("method", "no sensor errors", "0.01 deg/h and 100 ug")
    return Table("Largest error of position in an hour", columns, rows)


def cost_table() -> Table:
    """Return what an update costs by hand-written formulas."""
    rows = []
    for words, name in (
        ("eq 17, 3 rates", "rate-vector"),
        ("two-sample, increments", "two-sample"),
        ("two-sample, parabola through 3 rates", "two-sample from rates"),
    ):
        tally = count(name)
        rows.append((words, str(tally.multiplications), str(tally.additions)))
    return Table(
        "Operations of one update", ("method", "multiplications", "additions"), tuple(rows)
    )


def duration_table() -> Table:
    """Return how long this machine takes; every machine takes another time."""
    random = np.random.default_rng(7)
    rates = 0.3 * random.normal(size=(2 * _TIMED_UPDATES + 1, 3))
    jobs: dict[str, Callable[[], object]] = {
        "eq 17, 3 rates": lambda: integrate(rates, 0.005, "rate-vector"),
        "two-sample, increments": lambda: integrate(
            0.005 * rates[1:], 0.005, "two-sample", kind="increments"
        ),
        "two-sample, parabola through 3 rates": lambda: integrate(
            rates, 0.005, "two-sample", extraction="quadratic"
        ),
    }
    taken_s = {name: _least_s(job) for name, job in jobs.items()}
    first_s = taken_s["two-sample, increments"]
    rows = tuple(
        (
            name,
            Quantity(1e9 * seconds / _TIMED_UPDATES, "ns", ".0f"),
            Quantity(seconds / first_s, "times", ".2f"),
        )
        for name, seconds in taken_s.items()
    )
    columns = ("method", "one update", "over two-sample")
    return Table("Time of one update", columns, rows, repeatable=False)


def _least_s(job: Callable[[], object]) -> float:
    """Return the least of several durations: whatever disturbs one only adds to it."""
    durations_s = []
    for _ in range(5):
        start_s = time.perf_counter()
        job()
        durations_s.append(time.perf_counter() - start_s)
    return min(durations_s)
