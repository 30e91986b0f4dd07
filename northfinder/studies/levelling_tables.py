"""Tables of `levelling`: what a tilt costs by each form, and Table 1 by Monte Carlo."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.solvers import Method
from northfinder.studies.claim import Quantity
from northfinder.studies.study import Cell, Table
from northfinder.studies.tilted_table import ANGLES_RAD, Tilt, largest_deg, repeated, revolutions
from northfinder.units import ARCMIN, DEG, DEG_PER_HOUR

#: Table 1: seven determinations of 48 deg by each method, in degrees (printed as arc minutes).
TRANSFORM_DEG: Final = (48.02834, 47.98618, 48.00919, 47.98778, 48.00302, 47.98692, 47.97895)
VECTOR_DEG: Final = (47.99560, 48.01329, 47.99187, 48.00816, 48.00093, 47.98188, 47.98054)
TRUE_DEG: Final = 48.0
_FORMS: Final[tuple[Method, ...]] = (
    "uncompensated",
    "vector_uncorrected",
    "vector_published",
    "vector",
    "coordinate_transform",
)
_SETS = 4000  # of seven determinations


@dataclass(frozen=True, slots=True, eq=False)
class TableOne:
    """What Table 1's setting gives.

    Attributes:
        sigma_arcmin: Scatter of one determination.
        std_range_arcmin: Where the scatter of seven lies 95 times in 100.
        mean_arcmin: Half the range in which the mean of seven lies 95 times in 100.
        rows_arcmin: Errors of the first sets, ``(k, 7)``.
    """

    sigma_arcmin: float
    std_range_arcmin: tuple[float, float]
    mean_arcmin: float
    rows_arcmin: FloatArray


def largest_of_tilt_deg(epsilon_deg: float, zeta_deg: float, method: Method) -> float:
    """Return the largest error over the whole circle of azimuth."""
    tilt = Tilt(epsilon_deg * DEG, zeta_deg * DEG)
    return largest_deg(revolutions(tilt).errors_rad(method))


def simulate_table_one() -> TableOne:
    """Determine 48 deg seven times, again and again, under Table 1's conditions."""
    still = repeated(Tilt(5.0 * DEG, 0.0), TRUE_DEG * DEG, 7 * _SETS)
    noisy = still.noisy(0.01 * DEG_PER_HOUR, 5e-4, np.random.default_rng(1))
    rows = (noisy.errors_rad("coordinate_transform") / ARCMIN).reshape(_SETS, 7)
    low, high = np.percentile(rows.std(axis=1, ddof=1), [2.5, 97.5])
    mean = float(np.percentile(np.abs(rows.mean(axis=1)), 95.0))
    return TableOne(float(rows.std()), (float(low), float(high)), mean, rows[:40])


def tilt_table() -> Table:
    """Return what each form leaves of a tilt along one axis, and between two."""
    rows: Sequence[Sequence[Cell]] = tuple(
        (
            f"{epsilon:g} deg towards {zeta:g} deg",
            *(Quantity(largest_of_tilt_deg(epsilon, zeta, m), "deg", ".4f") for m in _FORMS),
        )
        for epsilon in (1.0, 5.0, 10.0)
        for zeta in (0.0, 45.0)
    )
    columns = ("tilt", "none", "eq 11", "eq 10", "vector, ours", "eq 3")
    return Table("Largest error of azimuth by each form", columns, rows)


def latitude_table() -> Table:
    """Return what a tilt costs where nothing is done about it."""
    tilt = Tilt(1.0 * DEG, 0.0)
    rows = tuple(
        (
            f"{latitude:g} deg",
            Quantity(
                60.0
                * largest_deg(
                    revolutions(tilt, latitude_rad=latitude * DEG).errors_rad("uncompensated")
                ),
                "arcmin",
                ".1f",
            ),
            Quantity(60.0 * np.tan(latitude * DEG), "arcmin", ".1f"),
        )
        for latitude in (0.0, 20.0, 40.0, 60.0, 80.0)
    )
    return Table("What a tilt of 1 deg costs", ("latitude", "largest error", "tan L"), rows)


def table_one_table(table_one: TableOne) -> Table:
    """Return the printed columns beside the range that chance gives them."""
    low, high = table_one.std_range_arcmin
    half = table_one.mean_arcmin
    columns = ("seven determinations", "mean less 48 deg", "standard deviation")
    rows: list[tuple[str | Quantity, ...]] = []
    for name, printed in (("coordinate transform", TRANSFORM_DEG), ("vector", VECTOR_DEG)):
        column = 60.0 * (np.array(printed) - TRUE_DEG)
        mean, std = float(column.mean()), float(column.std(ddof=1))
        rows.append(
            (
                f"{name}, its rows",
                Quantity(mean, "arcmin", "+.3f"),
                Quantity(std, "arcmin", ".3f"),
            )
        )
    rows.append(
        (
            f"simulated, 95 of 100 of {_SETS} sets",
            f"-{half:.2f} to {half:.2f} arcmin",
            f"{low:.2f} to {high:.2f} arcmin",
        )
    )
    return Table(f"Table 1, {len(ANGLES_RAD)} positions", columns, tuple(rows))
