"""`levelling`: two ways to level by calculation, and what the tilt costs each."""

from typing import Final

import numpy as np

from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.estimators.solvers import Method
from northfinder.studies.claim import Claim, Quantity, Verdict, agrees
from northfinder.studies.levelling_charts import levelling_charts
from northfinder.studies.levelling_tables import (
    TRANSFORM_DEG,
    TRUE_DEG,
    VECTOR_DEG,
    TableOne,
    largest_of_tilt_deg,
    latitude_table,
    simulate_table_one,
    table_one_table,
    tilt_table,
)
from northfinder.studies.study import Study
from northfinder.studies.tilted_table import (
    LATITUDE_RAD,
    Tilt,
    largest_deg,
    printed_eq_10,
    repeated,
    revolutions,
)
from northfinder.units import ARCMIN, DEG, DEG_PER_HOUR

_EXACT: Final[tuple[Method, ...]] = ("coordinate_transform", "vector", "two_vector")


def run() -> Study:
    """Work the paper through."""
    simulated = simulate_table_one()
    return Study(
        name="levelling",
        summary=(
            "The coordinate transform (eq 3) is exact. The vector form (eq 10) is exact only where "
            "the table tilts along one of its axes, as in the paper's own simulation; tilted "
            "between them it errs as much as the eq 11 that it was to replace. Our vector form "
            "takes the angle between the projected axes into account and is exact for every tilt."
        ),
        conditions=(
            "latitude 40 deg (the paper states none; 40 fits its figures), 24 positions, azimuth "
            "over the whole circle"
        ),
        claims=(*_tilt_claims(), *_figure_claims(), *_table_claims(simulated), *_misprints()),
        tables=(tilt_table(), latitude_table(), table_one_table(simulated)),
        charts=levelling_charts(simulated.rows_arcmin, TRANSFORM_DEG, VECTOR_DEG),
    )


def _tilt_claims() -> tuple[Claim, ...]:
    one_arcmin = 60.0 * _uncompensated_deg(1.0)
    ratio = 100.0 * largest_of_tilt_deg(10.0, 0.0, "vector_uncorrected") / 10.0
    single = max(
        largest_of_tilt_deg(10.0, zeta, "vector_published") for zeta in (0.0, 90.0, 180.0, 270.0)
    )
    between = largest_of_tilt_deg(10.0, 45.0, "vector_published")
    return (
        Claim(
            where="introduction",
            says="a tilt of 1 deg moves the azimuth by at most 50'",
            conditions="",
            printed=Quantity(50.0, "arcmin", ".0f"),
            ours=Quantity(one_arcmin, "arcmin", ".1f"),
            verdict=Verdict.REPRODUCED,
            reason=(
                "It is tilt times tan L, so 50' belongs to 40 deg of latitude alone: at 60 deg "
                "the same tilt costs 104' (second table)."
            ),
            holds=agrees(one_arcmin, 50.0, 0.02),
        ),
        Claim(
            where="Fig 3, eq 11",
            says="without the axes' own elevation (eq 11) the error is about 5 % of the tilt",
            conditions="tilt 10 deg along one axis",
            printed=Quantity(5.0, "%", ".0f"),
            ours=Quantity(ratio, "%", ".2f"),
            verdict=Verdict.REPRODUCED,
            reason=(
                "0.4386 deg of 10 deg. The share itself grows with the tilt: eq 11 errs by half "
                "its square."
            ),
            holds=agrees(ratio, 5.0, 0.15),
        ),
        Claim(
            where="Fig 3, eq 10",
            says="eq 10 compensates the tilt fully",
            conditions="tilt 10 deg along one axis, as the paper simulates it",
            printed=Quantity(0.0, "deg", ".0f"),
            ours=Quantity(single, "deg", below=1e-9),
            verdict=Verdict.REPRODUCED,
            reason="With the tilt along either axis eq 10 is exact.",
            holds=single < 1e-9,
        ),
        Claim(
            where="eq 10",
            says="eq 10 compensates the tilt fully",
            conditions="tilt 10 deg, downhill at 45 deg from the index mark",
            printed=Quantity(0.0, "deg", ".0f"),
            ours=Quantity(between, "deg", ".4f"),
            verdict=Verdict.NOT_REPRODUCED,
            reason=(
                "Where both axes are tilted their horizontal projections are not perpendicular, "
                "which eq 10 takes them to be: it then errs exactly as much as eq 11."
            ),
            holds=between > 0.8,
        ),
        Claim(
            where="ours, after eq 10",
            says="the vector form with the angle between the projections is exact for every tilt",
            conditions="tilt up to 30 deg in any direction: largest difference of three solvers",
            printed=None,
            ours=Quantity(_solvers_apart_rad(), "rad", below=1e-13),
            verdict=Verdict.BEYOND,
            reason=(
                "Coordinate transform, our vector form and a third route through the two measured "
                "vectors share no formula, and agree to rounding."
            ),
            holds=True,
        ),
    )


def _figure_claims() -> tuple[Claim, ...]:
    largest = _uncompensated_deg(10.0)
    anywhere = largest_of_tilt_deg(10.0, 45.0, "uncompensated")
    random = np.random.default_rng(2011)
    sweep = repeated(Tilt(10.0 * DEG, 0.0), 48.0 * DEG, 20_000)
    noisy = sweep.noisy(0.02 * DEG_PER_HOUR, 2e-5, random)
    sigma = float(noisy.errors_rad("coordinate_transform").std()) / ARCMIN
    bound = 0.02 * DEG_PER_HOUR * np.sqrt(2.0 / 24.0) / (EARTH_RATE_RAD_S * np.cos(LATITUDE_RAD))
    apart = {azimuth: _methods_apart_deg(azimuth) for azimuth in (0.0, 90.0, 180.0)}
    return (
        Claim(
            where="Fig 4",
            says="without compensation the azimuth errs by at most 8.4 deg",
            conditions="tilt 10 deg along one axis",
            printed=Quantity(8.4, "deg", ".1f"),
            ours=Quantity(largest, "deg", ".2f"),
            verdict=Verdict.REPRODUCED,
            reason=(
                "8.4 is 10 tan 40 deg, the first order; the full error is a little more, and over "
                f"all directions of the tilt {anywhere:.2f} deg."
            ),
            holds=agrees(largest, 8.4, 0.03),
        ),
        Claim(
            where="Fig 4",
            says="with compensation the error is within the gyro's own",
            conditions="gyro 0.02 deg/h, accelerometer 2e-5 g, tilt 10 deg, 20 000 determinations",
            printed=None,
            ours=Quantity(sigma, "arcmin", ".2f"),
            verdict=Verdict.REPRODUCED,
            reason=(
                f"One sigma; the gyro alone, on a level table, is bound to {bound / ARCMIN:.2f}' "
                "by Cramer and Rao."
            ),
            holds=agrees(sigma, bound / ARCMIN, 0.02),
        ),
        Claim(
            where="Fig 5",
            says="the two methods differ by less than 1e-4 deg",
            conditions="as Fig 4, at azimuth 0, where they differ most; one sigma",
            printed=Quantity(1e-4, "deg", ".0e"),
            ours=Quantity(apart[0.0], "deg", ".1e"),
            verdict=Verdict.REPRODUCED,
            reason=(
                "The difference is the accelerometer's noise across the tilt, which makes the tilt "
                "one between the axes; without noise it would be none, and with a real tilt "
                "between the axes it is 0.88 deg."
            ),
            holds=apart[0.0] < 1e-4,
        ),
        Claim(
            where="Fig 5",
            says="they differ least at azimuth 90 deg, most near 0 and 180 deg",
            conditions="as Fig 4, at azimuth 90; one sigma",
            printed=None,
            ours=Quantity(apart[90.0], "deg", below=1e-9),
            verdict=Verdict.REPRODUCED,
            reason="It goes with the square of the azimuth's cosine, for a tilt along the mark.",
            holds=min(apart[0.0], apart[180.0]) > 100.0 * apart[90.0],
        ),
    )


def _table_claims(table_one: TableOne) -> tuple[Claim, ...]:
    transform, vector = (np.array(rows) for rows in (TRANSFORM_DEG, VECTOR_DEG))
    std_transform, std_vector = (60.0 * float(rows.std(ddof=1)) for rows in (transform, vector))
    low, high = table_one.std_range_arcmin
    deviation = 60.0 * (float(vector.mean()) - TRUE_DEG)
    expected = (
        f"Seven determinations scatter by {low:.2f} to {high:.2f}' 95 times in 100, when one "
        f"scatters by {table_one.sigma_arcmin:.2f}' as simulated."
    )
    conditions = "gyro 0.01 deg/h, accelerometer 5e-4 g, tilt 5 deg, true azimuth 48 deg"
    return (
        Claim(
            where="Table 1",
            says="seven determinations by the coordinate transform scatter by 1.04'",
            conditions=conditions,
            printed=Quantity(1.03816, "arcmin", ".3f"),
            ours=Quantity(table_one.sigma_arcmin, "arcmin", ".2f"),
            verdict=Verdict.REPRODUCED,
            reason=expected,
            holds=low < std_transform < high,
        ),
        Claim(
            where="Table 1",
            says="seven determinations by the vector method scatter by 0.75'",
            conditions=conditions,
            printed=Quantity(0.74567, "arcmin", ".3f"),
            ours=Quantity(table_one.sigma_arcmin, "arcmin", ".2f"),
            verdict=Verdict.REPRODUCED,
            reason="The difference to the other column is chance: both have the same sigma.",
            holds=low < std_vector < high,
        ),
        Claim(
            where="Table 1",
            says="the rows are arc minutes",
            conditions="standard deviation of the first column, its rows taken as degrees",
            printed=Quantity(1.03816, "arcmin", ".5f"),
            ours=Quantity(std_transform, "arcmin", ".5f"),
            verdict=Verdict.MISPRINT,
            reason="They are degrees: only so do the printed deviations follow from them.",
            holds=agrees(std_transform, 1.03816, 1e-4) and agrees(std_vector, 0.74567, 1e-4),
        ),
        Claim(
            where="Table 1",
            says="the vector column's mean is 47.99724 deg",
            conditions="mean of its seven rows",
            printed=Quantity(47.99724, "deg", ".5f"),
            ours=Quantity(float(vector.mean()), "deg", ".5f"),
            verdict=Verdict.MISPRINT,
            reason=(
                f"The rows average {vector.mean():.5f} deg, {deviation:.3f}' from the truth and "
                "not -0.166'; the other column's mean is right."
            ),
            holds=not agrees(float(vector.mean()), 47.99724, 1e-5)
            and agrees(float(transform.mean()), 47.99720, 1e-7),
        ),
    )


def _misprints() -> tuple[Claim, ...]:
    aside = revolutions(Tilt(1.0 * DEG, 90.0 * DEG))
    sign, quotient = (largest_deg(printed_eq_10(aside, by_gyro=by)) for by in (False, True))
    return (
        Claim(
            where="eqs 5 and 9",
            says="b_A = -g sin(epsilon) sin(zeta), and zeta = -arctan(...)",
            conditions="tilt 1 deg, downhill at 90 deg from the mark; error of eq 10 fed by them",
            printed=Quantity(0.0, "deg", ".0f"),
            ours=Quantity(sign, "deg", ".2f"),
            verdict=Verdict.MISPRINT,
            reason=(
                "Their signs contradict eq 10, so that the correction doubles the error that it "
                "should take away. Consistent: epsilon = asin(hypot(a_A, b_A)/g), "
                "zeta = atan2(-b_A, -a_A)."
            ),
            holds=agrees(sign, 2.0 * _uncompensated_deg(1.0), 0.02),
        ),
        Claim(
            where="eq 9",
            says="zeta follows from b/a",
            conditions="as the line above",
            printed=Quantity(0.0, "deg", ".0f"),
            ours=Quantity(quotient, "deg", ".2f"),
            verdict=Verdict.MISPRINT,
            reason="b_A/a_A of the accelerometer is meant: b/a of the gyro is the azimuth.",
            holds=quotient > 0.8,
        ),
    )


def _uncompensated_deg(epsilon_deg: float) -> float:
    return largest_of_tilt_deg(epsilon_deg, 0.0, "uncompensated")


def _solvers_apart_rad() -> float:
    apart = []
    for epsilon_deg in (1.0, 10.0, 30.0):
        for zeta_deg in range(0, 360, 30):
            tilted = revolutions(Tilt(epsilon_deg * DEG, zeta_deg * DEG), np.arange(36.0) * 0.1745)
            first, *others = (tilted.errors_rad(method) for method in _EXACT)
            apart += [float(np.abs(other - first).max()) for other in others]
    return max(apart)


def _methods_apart_deg(azimuth_deg: float) -> float:
    """One sigma of the vector form as published less the coordinate transform, under noise."""
    still = repeated(Tilt(10.0 * DEG, 0.0), azimuth_deg * DEG, 20_000)
    noisy = still.noisy(0.02 * DEG_PER_HOUR, 2e-5, np.random.default_rng(5))
    apart = noisy.errors_rad("vector_published") - noisy.errors_rad("coordinate_transform")
    return float(apart.std()) / DEG
