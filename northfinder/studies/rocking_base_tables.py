"""Tables of `rocking-base`: every way to align, how calm it is, Newton's steps, rounding."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from northfinder.attitude.arrays import FloatArray
from northfinder.studies.claim import Quantity
from northfinder.studies.rocking_base_newton import Rounding
from northfinder.studies.rocking_base_runs import (
    SEEDS,
    STEPS,
    Errors,
    Trials,
    heading_arcmin,
    level_arcsec,
)
from northfinder.studies.study import Cell, Table
from northfinder.units import ARCMIN, ARCSEC

#: As they stand in the tables: cold ones first.
ORDER: Final = (
    "Optimized TRIAD, cold",
    "QUEST, cold",
    "QUEST, unit, cold",
    "QUEST, own first",
    "QUEST raw",
    "QUEST velocity",
    "taper, p = 1",
    "taper, p = 2",
    "Optimized TRIAD, warm",
    "QUEST, warm",
)
_EXACT_ARCMIN = 1e-6  # below this a figure of Newton's steps says nothing but that


def rms(values: FloatArray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def arcmin(value: float, digits: int = 2) -> Quantity:
    """Return arc minutes as they are written here."""
    return Quantity(value, "arcmin", f".{digits}f")


def arcsec(value: float) -> Quantity:
    """Return arc seconds as they are written here."""
    return Quantity(value, "arcsec", ".1f")


def errors_table(base: str, trials: Trials) -> Table:
    """Return every way's errors after 120 s."""
    columns = ("way to align", "heading, mean", "largest", "level, mean", "largest")
    drives = f"{base.capitalize()} base, {SEEDS} drives"
    title = f"{drives}, after 120 s, against the same-bias equilibrium"
    return Table(title, columns, tuple((name, *_row(trials.at_end[name])) for name in ORDER))


def _row(errors: Errors) -> tuple[Cell, ...]:
    heading, level = errors.heading_arcmin, errors.level_arcsec
    return (
        arcmin(heading.mean()),
        arcmin(heading.max()),
        arcsec(level.mean()),
        arcsec(level.max()),
    )


def sigma_table(trials: dict[str, Trials]) -> Table:
    """Return what the package predicts beside what came out, with the sensors' biases and without.

    Root mean squares over the drives, of errors and of predicted sigmas.
    """
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (
            f"{base}, {name}",
            arcmin(rms(heading_arcmin(errors.from_truth))),
            arcmin(rms(errors.sigma_rad / ARCMIN)),
            arcmin(rms(errors.heading_arcmin)),
            arcmin(rms(errors.noise_rad / ARCMIN)),
        )
        for base, tried in trials.items()
        for name, errors in tried.at_end.items()
        if errors.noise_rad.size
    )
    columns = ("base, way to align", "from truth", "predicted", "from equilibrium", "predicted")
    title = f"Heading against truth and against the same-bias equilibrium, rms of {SEEDS} drives"
    return Table(title, columns, rows)


def late_table(trials: dict[str, Trials]) -> Table:
    """Return how calm three ways are from 100 to 120 s."""
    columns = ("base, way to align", "peak to peak", "largest, mean", "largest", "level, largest")
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (
            f"{base}, {name}",
            arcmin(peak_to_peak_arcmin(late).mean()),
            arcmin(heading_arcmin(late).max(axis=1).mean()),
            arcmin(heading_arcmin(late).max()),
            arcsec(level_arcsec(late).max()),
        )
        for base, tried in trials.items()
        for name, late in tried.late.items()
    )
    title = (
        f"Heading from 100 to 120 s, second by second, {SEEDS} drives; peak to peak is their mean"
    )
    return Table(title, columns, rows)


def peak_to_peak_arcmin(late: FloatArray) -> FloatArray:
    """Return the range of the heading's error on each drive, ``(n,)``."""
    return np.asarray(np.ptp(late[..., 2], axis=1) / ARCMIN)


def newton_table(trials: dict[str, Trials]) -> Table:
    """Return what the largest eigenvalue still lacks after so many steps, as an attitude."""
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (f"{base}, {name}", *(_lacking(float(x) / ARCMIN) for x in lacking.max(axis=0)))
        for base, tried in trials.items()
        for name, lacking in tried.truncated_rad.items()
    )
    columns = ("unit vectors", *(f"{n} step{'s' * (n != 1)}" for n in STEPS))
    return Table(f"What Newton's method lacks, from 1, the worst of {SEEDS} drives", columns, rows)


def _lacking(value_arcmin: float) -> Quantity:
    if value_arcmin < _EXACT_ARCMIN:
        return Quantity(value_arcmin, "arcmin", below=_EXACT_ARCMIN)
    return Quantity(value_arcmin, "arcmin", ".2g" if value_arcmin < 10.0 else ".0f")


def rounding_table(found: Sequence[Rounding]) -> Table:
    """Return errors by rounding alone; the last digits differ from machine to machine."""
    columns = ("fit", "eqs 13-17: median", "worst tenth", "worst", "ours, worst")
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (
            f"{one.duration_s:g} s",
            *(
                Quantity(float(x) / ARCSEC, "arcsec", ".2f")
                for x in np.percentile(one.published, [50.0, 90.0, 100.0])
            ),
            Quantity(float(one.ours.max()) / ARCSEC, "arcsec", ".1e"),
        )
        for one in found
    )
    title = "Rounding in double precision: perfect sensors at rest in 200 attitudes"
    return Table(title, columns, rows, repeatable=False)
