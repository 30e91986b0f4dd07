"""Every way to align on the rocking base, over the same drives."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from northfinder.alignment import Limits
from northfinder.attitude.arrays import FloatArray
from northfinder.studies.rocking_base_drive import DURATION_S, Drive, drive
from northfinder.studies.rocking_base_newton import profile, truncated_rad
from northfinder.studies.rocking_base_seen import (
    Seen,
    Solver,
    by_quest,
    by_taper,
    by_two,
    by_unit_vectors,
    see,
    track_errors,
)
from northfinder.units import ARCMIN, ARCSEC

SEEDS: Final = 20
STEPS: Final = (0, 1, 2, 3, 8)
#: Seconds of the fit after which the paper's figures hold.
LATE_S: Final = np.arange(100.0, 121.0)
_END_S: Final = np.array([DURATION_S])

Pairs = tuple[FloatArray, FloatArray]

#: What the package has: the row's name, the method, and whether its filter is warm.
PRODUCT: Final = {
    "Optimized TRIAD, cold": ("optimized-triad", False),
    "QUEST, cold": ("quest", False),
    "QUEST raw": ("quest-raw", False),
    "QUEST velocity": ("quest-velocity", False),
    "taper, p = 2": ("quest-taper", False),
    "Optimized TRIAD, warm": ("optimized-triad", True),
    "QUEST, warm": ("quest", True),
}
#: What it has not, or only in parts.
OTHERS: Final[dict[str, tuple[Callable[[Seen], Pairs], Solver]]] = {
    "taper, p = 1": (Seen.raw, by_taper(1)),
    "QUEST, unit, cold": (lambda seen: seen.low_passed(warm=False), by_unit_vectors),
    "QUEST, own first": (Seen.started_by_own, by_quest),
}
#: What is followed from 100 s on.
FOLLOWED: Final[dict[str, tuple[Callable[[Seen], Pairs], Solver]]] = {
    "Optimized TRIAD, warm": (lambda seen: seen.low_passed(warm=True), by_two),
    "QUEST, warm": (lambda seen: seen.low_passed(warm=True), by_quest),
    "taper, p = 2": (Seen.raw, by_taper(2)),
}
#: What Newton's method is tried on.
FILTERED: Final[dict[str, Callable[[Seen], Pairs]]] = {
    "low-passed, warm": lambda seen: seen.low_passed(warm=True),
    "low-passed, cold": lambda seen: seen.low_passed(warm=False),
    "raw": Seen.raw,
}


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Errors of one way to align, over all drives of a base.

    Attributes:
        from_equilibrium: Against the equilibrium with the same biases, (E, N, U), rad, ``(n, 3)``.
        from_truth: Against the truth, rad, ``(n, 3)``.
        noise_rad: Predicted sigma of the heading, biases left out, ``(n,)``; empty for none.
        sigma_rad: Predicted sigma of the heading with them, ``(n,)``; empty for none.
    """

    from_equilibrium: FloatArray
    from_truth: FloatArray
    noise_rad: FloatArray
    sigma_rad: FloatArray

    @property
    def heading_arcmin(self) -> FloatArray:
        """Magnitudes against the equilibrium, ``(n,)``."""
        return heading_arcmin(self.from_equilibrium)

    @property
    def level_arcsec(self) -> FloatArray:
        """Magnitudes against the equilibrium, ``(n,)``."""
        return level_arcsec(self.from_equilibrium)


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """All drives of a base.

    Attributes:
        at_end: Errors after 120 s, by the way to align.
        late: Errors after every second from 100 s on, rad, ``(n, 21, 3)``.
        truncated_rad: What Newton's method lacks after each of ``STEPS``, ``(n, 5)``.
    """

    at_end: dict[str, Errors]
    late: dict[str, FloatArray]
    truncated_rad: dict[str, FloatArray]


def heading_arcmin(errors_rad: FloatArray) -> FloatArray:
    """Return magnitudes of the heading's error, ``(...)``."""
    return np.asarray(np.abs(errors_rad[..., 2]) / ARCMIN)


def level_arcsec(errors_rad: FloatArray) -> FloatArray:
    """Return magnitudes of the level's error, ``(...)``."""
    return np.asarray(np.hypot(errors_rad[..., 0], errors_rad[..., 1]) / ARCSEC)


def try_all(base: str, seeds: int = SEEDS) -> Trials:
    """Align in every way on so many drives of a base."""
    product: dict[str, list[tuple[FloatArray, float, float]]] = {name: [] for name in PRODUCT}
    others: dict[str, list[FloatArray]] = {name: [] for name in OTHERS}
    late: dict[str, list[FloatArray]] = {name: [] for name in FOLLOWED}
    truncated: dict[str, list[list[float]]] = {name: [] for name in FILTERED}
    led = []
    for seed in range(seeds):
        one = drive(base, seed)
        seen = see(one, round(LATE_S[0]))
        led.append(one.equilibrium(one.at_end))
        for name, (method, warm) in PRODUCT.items():
            found = one.align(method, warm=warm)
            sigmas = (noise_rad(found.limits), found.heading_sigma_rad)
            product[name].append((one.error(found), *sigmas))
        for name, (pairs, solve) in OTHERS.items():
            others[name].append(track_errors(one, seen, pairs(seen), solve, _END_S)[0])
        for name, (pairs, solve) in FOLLOWED.items():
            late[name].append(track_errors(one, seen, pairs(seen), solve, LATE_S))
        for name, pairs in FILTERED.items():
            truncated[name].append(truncated_rad(profile(*pairs(seen)), STEPS))
    biases = np.array(led)
    return Trials(
        {name: _of_product(rows, biases) for name, rows in product.items()}
        | {name: _of_others(np.array(rows), biases) for name, rows in others.items()},
        {name: np.array(rows) for name, rows in late.items()},
        {name: np.array(rows) for name, rows in truncated.items()},
    )


def shown_drive(base: str) -> tuple[Drive, Seen]:
    """Return the first drive, for the figures."""
    one = drive(base, 0)
    return one, see(one)


def noise_rad(limits: Limits) -> float:
    """Return the heading's predicted sigma without the sensors' biases."""
    return math.hypot(*(line.heading_rad for line in limits.lines if "bias" not in line.source))


def _of_product(rows: list[tuple[FloatArray, float, float]], biases: FloatArray) -> Errors:
    error, noise, sigma = (np.array(column) for column in zip(*rows, strict=True))
    return Errors(error - biases, error, noise, sigma)


def _of_others(error: FloatArray, biases: FloatArray) -> Errors:
    return Errors(error, error + biases, np.empty(0), np.empty(0))
