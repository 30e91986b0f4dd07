"""Figures of `levelling`: the paper's 3, 4 and 5, and the tilt that it left out."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.solvers import Method
from northfinder.studies.chart import Chart, Curve, Panel, Style
from northfinder.studies.tilted_table import CIRCLE_RAD, Tilt, largest_deg, revolutions
from northfinder.units import ARCMIN, DEG, DEG_PER_HOUR

_AZIMUTH = "true azimuth, °"
_COMPARED: Final[tuple[Method, ...]] = ("vector_published", "vector")
_QUARTERS = tuple((float(deg), f"{deg}") for deg in range(0, 361, 90))
_CIRCLE_DEG: FloatArray = CIRCLE_RAD / DEG


def levelling_charts(
    rows_arcmin: FloatArray, transform_deg: Sequence[float], vector_deg: Sequence[float]
) -> tuple[Chart, ...]:
    """Return every figure; Table 1's rows stand beside as many simulated sets of seven."""
    return (
        _figure_3(),
        _figure_4(),
        _figure_5(),
        _between_the_axes(),
        _table_1(rows_arcmin, transform_deg, vector_deg),
    )


def _figure_3() -> Chart:
    ideal = revolutions(Tilt(10.0 * DEG, 0.0))
    curves = (
        Curve("eq 10", _CIRCLE_DEG, ideal.errors_rad("vector_published") / DEG),
        Curve("eq 11", _CIRCLE_DEG, ideal.errors_rad("vector_uncorrected") / DEG, "second"),
    )
    largest = largest_deg(ideal.errors_rad("vector_uncorrected"))
    said = f"Eq 11 swings by {largest:.2f} degrees twice round the circle; eq 10 stays at 0."
    panel = Panel(_AZIMUTH, "error of azimuth, °", curves, ticks=_QUARTERS)
    return Chart("fig-3", "Fig 3: eq 10 and eq 11 at 10° of tilt along one axis", said, (panel,))


def _figure_4() -> Chart:
    ideal = revolutions(Tilt(10.0 * DEG, 0.0))
    noisy = ideal.noisy(0.02 * DEG_PER_HOUR, 2e-5, np.random.default_rng(4))
    left = Curve("", _CIRCLE_DEG, noisy.errors_rad("uncompensated") / DEG, "second")
    exact = noisy.errors_rad("coordinate_transform") / ARCMIN
    largest = largest_deg(ideal.errors_rad("uncompensated"))
    said = (
        f"Left, without compensation, a swing of {largest:.2f} "
        "degrees once round the circle. Right, with it, only the gyro's noise of a few arc minutes."
    )
    panels = (
        Panel(
            _AZIMUTH, "without compensation, °", (left,), ((8.4, "8.4 printed"),), ticks=_QUARTERS
        ),
        Panel(
            _AZIMUTH,
            "compensated by eq 3, ′",
            (Curve("", _CIRCLE_DEG, exact, "dots"),),
            ticks=_QUARTERS,
        ),
    )
    return Chart("fig-4", "Fig 4: error with and without compensation", said, panels, 2)


def _figure_5() -> Chart:
    ideal = revolutions(Tilt(10.0 * DEG, 0.0))
    noisy = ideal.noisy(0.02 * DEG_PER_HOUR, 2e-5, np.random.default_rng(5))
    apart = noisy.errors_rad("vector_published") - noisy.errors_rad("coordinate_transform")
    said = (
        "One noisy determination at each azimuth: the methods differ by less than 0.0001 degrees "
        "for the most part near 0 and 180 degrees, and not at all at 90 and 270."
    )
    curve = Curve("", _CIRCLE_DEG, apart / DEG * 1e6, "dots")
    levels = ((100.0, "100 printed"), (-100.0, ""))
    panel = Panel(
        _AZIMUTH, "eq 10 less eq 3, millionths of a degree", (curve,), levels, ticks=_QUARTERS
    )
    return Chart("fig-5", "Fig 5: difference of the two methods", said, (panel,))


def _between_the_axes() -> Chart:
    tilted = revolutions(Tilt(10.0 * DEG, 45.0 * DEG))
    zeta_deg = np.arange(0.0, 361.0, 5.0)
    sparse = np.arange(0.0, 360.0, 5.0) * DEG
    largest = {
        method: [
            largest_deg(revolutions(Tilt(10.0 * DEG, z * DEG), sparse).errors_rad(method))
            for z in zeta_deg
        ]
        for method in _COMPARED
    }
    left = (
        Curve("ours", _CIRCLE_DEG, tilted.errors_rad("vector") / DEG),
        Curve("eq 10", _CIRCLE_DEG, tilted.errors_rad("vector_published") / DEG, "second"),
        Curve("eq 11", _CIRCLE_DEG, tilted.errors_rad("vector_uncorrected") / DEG, "third"),
    )
    right = (
        Curve("ours", zeta_deg, largest["vector"]),
        Curve("eq 10", zeta_deg, largest["vector_published"], "second"),
    )
    said = (
        "Downhill at 45 degrees from the index mark eq 10 errs by up to "
        f"{max(largest['vector_published']):.2f} degrees, as much as eq 11; it is exact only "
        "where the tilt points along an axis. Our form stays at 0."
    )
    panels = (
        Panel(_AZIMUTH, "error of azimuth, °, downhill at 45°", left, ticks=_QUARTERS),
        Panel("downhill direction, °", "largest error, °", right, ticks=_QUARTERS),
    )
    return Chart("between-the-axes", "A tilt of 10° between the axes", said, panels, 2)


def _table_1(
    rows_arcmin: FloatArray, transform_deg: Sequence[float], vector_deg: Sequence[float]
) -> Chart:
    sets = np.repeat(np.arange(1.0, len(rows_arcmin) + 1.0), rows_arcmin.shape[1])
    columns: tuple[tuple[str, float, Sequence[float], Style], ...] = (
        ("printed, eq 3", -1.0, transform_deg, "printed"),
        ("printed, eq 10", -3.0, vector_deg, "rings"),
    )
    printed = [
        Curve(name, np.full(7, place), 60.0 * (np.array(column) - 48.0), style)
        for name, place, column, style in columns
    ]
    said = (
        "Seven determinations of each printed column at the left, forty simulated sets of seven "
        "beside them: the same spread."
    )
    simulated = Curve("simulated sets of seven", sets, rows_arcmin.ravel(), "dots")
    panel = Panel("set", "azimuth less 48°, ′", (simulated, *printed))
    return Chart("table-1", "Table 1 beside the same by Monte Carlo", said, (panel,))
