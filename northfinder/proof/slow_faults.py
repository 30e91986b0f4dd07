"""Faults that creep: does the stated sigma, or a failed check, cover them at every size?

Runs are reduced by the same function as a measured one; their samples are made here, from the
simulator's truth, without a bench.
"""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Final, Literal

import numpy as np
from numpy.random import Generator

from drivers.interfaces import FloatArray
from northfinder.config import RigConfig, load_config
from northfinder.procedures.north_seek import Plan, reduce_visits
from northfinder.procedures.visits import Visit, schedule
from northfinder.proof.figure import Figure
from northfinder.samples import Samples
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR, HOUR
from sim.truth import Truth

RUNS = 5000
_WRONG_SIGMAS = 4.0
_PLAN: Final = Plan()
_LATITUDE_DEG = 40.0
_GYRO_NOISE, _FORCE_NOISE = 1e-3, 1e-5  # the simulated rig's: deg/sqrt(h), g/sqrt(Hz)
_SAMPLES = 60
_MOVE_S, _SETTLE_S = 0.8, 0.6
_TURN_SIGMA_RAD = 0.0005 * DEG  # of what a gyro sees of a move
_MOST_TILTED_DEG = (2.0, 2.0, 2.0, 0.05)  # a level table's accelerometer sees no slip
_CHUNK = 25

Zone = Literal["harmless", "between", "visible"]
Kind = Literal["drift that curves", "bench tilted", "table slips", "table creeps"]


@dataclass(frozen=True, slots=True)
class Sizes:
    """Of one kind of fault, as docs/faults.md states them.

    Attributes:
        harmless: Up to here it does not make north wrong.
        visible: From here on a check fails; between the two it may pass.
        unit: Of both.
    """

    harmless: float
    visible: float
    unit: str


SIZES: Final[Mapping[Kind, Sizes]] = {
    "drift that curves": Sizes(50.0, 280.0, "deg/h per h^2"),
    "bench tilted": Sizes(0.03, 0.03, "deg"),
    "table slips": Sizes(0.003, 0.1, "deg a move"),
    "table creeps": Sizes(0.0015, 0.005, "deg a move"),
}
KINDS: Final[tuple[Kind, ...]] = tuple(SIZES)
ZONES: Final[tuple[Zone, ...]] = ("harmless", "visible")


@dataclass(frozen=True, slots=True)
class SlowRun:
    """What became of one run.

    Attributes:
        kind: What was wrong.
        size: In its unit.
        sigmas: By how many stated sigma north is off.
        failed: Whether a check failed.
        checks: Those that did not pass.
    """

    kind: Kind
    size: float
    sigmas: float
    failed: bool
    checks: tuple[str, ...]

    @property
    def silent(self) -> bool:
        """Return whether north is wrong and nothing says so."""
        return self.sigmas > _WRONG_SIGMAS and not self.failed


def slow_faults(runs: int = RUNS, processes: int | None = None) -> Iterator[Figure]:
    """Seeks with a curving drift, a tilt or a slip, at sizes that docs/faults.md calls told.

    What may pass between harmless and visible sizes is measured too, and nothing is promised.
    """
    silent = sum(run.silent for run in slow_runs(runs, ZONES, processes))
    name = f"{runs} runs with slow faults, harmless or visible: silent beyond 4 sigma"
    yield Figure(name, float(silent), "runs", None, 2.0 * runs / RUNS)
    between = slow_runs(runs // 5, ("between",), processes)
    for kind in KINDS:
        alike = [run.silent for run in between if run.kind == kind]
        if SIZES[kind].visible > SIZES[kind].harmless:
            percent = 100.0 * sum(alike) / len(alike)
            sizes = f"{SIZES[kind].harmless:g} to {SIZES[kind].visible:g} {SIZES[kind].unit}"
            yield Figure(f"silent between: {kind}, {sizes}", percent, "%", None, None)


def slow_runs(runs: int, zones: Sequence[Zone], processes: int | None = None) -> list[SlowRun]:
    """Carry runs out, the kinds and the zones in turn; equal numbers give equal runs.

    Args:
        runs: How many.
        zones: What sizes to take.
        processes: How many at a time; by default one a core, and 1 is this one.
    """
    places = [
        (seed, KINDS[seed % len(KINDS)], zones[seed // len(KINDS) % len(zones)])
        for seed in range(runs)
    ]
    if processes == 1:
        return [slow_run(place) for place in places]
    with ProcessPoolExecutor(processes or os.cpu_count(), get_context("spawn")) as pool:
        return list(pool.map(slow_run, places, chunksize=_CHUNK))


def slow_run(place: tuple[int, Kind, Zone]) -> SlowRun:
    """Make and reduce one run: its seed, what is wrong, and how large that is."""
    seed, kind, zone = place
    random = np.random.default_rng([seed, 506])
    size = _size(SIZES[kind], zone, float(random.random()))
    bench = _Bench(random, kind, size * float(random.choice([-1.0, 1.0])))
    seek = reduce_visits(bench.visits(), _PLAN, _config())
    off_rad = float(seek.solutions["coordinate_transform"].azimuth_rad) - bench.azimuth_rad
    sigma_rad = float(seek.budgets["coordinate_transform"].sigma_rad)
    statuses = {check.name: check.status for check in seek.checks if check.status != "pass"}
    return SlowRun(
        kind,
        size,
        abs(math.remainder(off_rad, 2 * math.pi)) / sigma_rad,
        "fail" in statuses.values(),
        tuple(f"{name} {status}s" for name, status in statuses.items()),
    )


def _size(sizes: Sizes, zone: Zone, share: float) -> float:
    """Return a size: visible ones reach to three times where they begin to be."""
    begin, end = {
        "harmless": (0.0, sizes.harmless),
        "between": (sizes.harmless, sizes.visible),
        "visible": (sizes.visible, 3.0 * sizes.visible),
    }[zone]
    return begin + share * (end - begin)


class _Bench:
    """A bench on which one thing creeps.

    Args:
        random: Seeded.
        kind: What is wrong.
        size: Of it, in the unit of ``SIZES``, either way.
    """

    def __init__(self, random: Generator, kind: Kind, size: float) -> None:
        self._random = random
        self._kind, self._size = kind, size
        self.azimuth_rad = float(random.uniform(0.0, 2 * math.pi))
        most_deg = float(random.choice(_MOST_TILTED_DEG))
        self._pitch_rad, self._roll_rad = random.uniform(-most_deg, most_deg, 2) * DEG
        self._bias_rad_s = float(random.normal(0.0, 1.0)) * DEG_PER_HOUR
        self._way_rad = float(random.uniform(0.0, 2 * math.pi))
        self._tilts_at = int(random.integers(1, 2 * _PLAN.positions))

    def visits(self) -> list[Visit]:
        """Go out and back, and return what was measured."""
        stops = schedule(_PLAN.positions, _PLAN.dwell_s, "out-and-back", 1)
        visits: list[Visit] = []
        begin_s, told_rad, away_rad = 0.0, 0.0, 0.0
        for stop in stops:
            moved_rad = stop.angle_rad - told_rad
            slip_rad, told_rad = self._slip_rad(moved_rad), stop.angle_rad
            away_rad += slip_rad
            begin_s += (_MOVE_S if moved_rad else 0.0) + _SETTLE_S
            seen_rad = moved_rad + slip_rad + self._random.normal(0.0, _TURN_SIGMA_RAD)
            rate, force = self._felt(told_rad + away_rad, stop.index)
            rate += self._bias_rad_s + self._drift_rad_s(begin_s + stop.dwell_s / 2)
            visits.append(
                Visit(
                    index=stop.index,
                    segment=0,
                    direction=stop.direction,
                    angle_rad=told_rad,
                    start_s=begin_s,
                    turned_rad=seen_rad,
                    gyro=self._samples(rate, _GYRO_NOISE * DEG_PER_SQRT_HOUR, stop.dwell_s),
                    accelerometer=self._samples(force, _FORCE_NOISE, stop.dwell_s),
                )
            )
            begin_s += stop.dwell_s
        return visits

    def _slip_rad(self, moved_rad: float) -> float:
        """Return what the plate does besides: stay behind the motor, or creep one way."""
        if not moved_rad:
            return 0.0
        slips = -math.copysign(self._size, moved_rad) if self._kind == "table slips" else 0.0
        return (self._size if self._kind == "table creeps" else slips) * DEG

    def _drift_rad_s(self, time_s: float) -> float:
        curvature = self._size if self._kind == "drift that curves" else 0.0
        return curvature * DEG_PER_HOUR * (time_s / HOUR) ** 2

    def _felt(self, angle_rad: float, index: int) -> tuple[float, float]:
        tilted = self._kind == "bench tilted" and index >= self._tilts_at
        tilt_rad = self._size * DEG if tilted else 0.0
        truth = Truth(
            _LATITUDE_DEG * DEG,
            self.azimuth_rad,
            self._pitch_rad + tilt_rad * math.cos(self._way_rad),
            self._roll_rad + tilt_rad * math.sin(self._way_rad),
        )
        along = np.array([-math.sin(angle_rad), math.cos(angle_rad), 0.0])
        return float(along @ truth.earth_rate_t()), float(along @ truth.specific_force_t())

    def _samples(self, mean: float, noise_sqrt_s: float, dwell_s: float) -> Samples:
        tick, period_s = np.arange(_SAMPLES, dtype=np.int64), dwell_s / _SAMPLES
        sigma = noise_sqrt_s / math.sqrt(period_s)
        value: FloatArray = mean + sigma * self._random.standard_normal(_SAMPLES)
        time_s = tick.astype(np.float64) * period_s
        return Samples(tick, time_s, value, np.ones(_SAMPLES, dtype=bool), _SAMPLES)


def _config() -> RigConfig:
    return load_config(
        None,
        {},
        {
            "site": {"latitude_deg": _LATITUDE_DEG},
            "gyro": {"noise_deg_sqrt_h": _GYRO_NOISE},
            "accelerometer": {"noise_g_sqrt_hz": _FORCE_NOISE},
        },
    )
