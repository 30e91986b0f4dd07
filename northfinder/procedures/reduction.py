"""From visits to north: a pure function of the samples, the plan and the configuration.

A live run and ``northfinder runs recompute`` call the same function, so the same samples give
the identical result.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from northfinder.config import RigConfig
from northfinder.estimators.azimuth import (
    AzimuthSolution,
    EarthRate,
    measure_earth_rate,
    solve_azimuth,
)
from northfinder.estimators.checks import Check
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.solvers import SOLVERS, Method
from northfinder.estimators.tilt import TiltEstimate
from northfinder.estimators.uncertainty import AzimuthBudget, azimuth_budget
from northfinder.procedures.fits import Search, configured_or_seen, fit_visits
from northfinder.procedures.plan import Plan, systematic
from northfinder.procedures.plan_checks import check_plan
from northfinder.procedures.verdicts import verdicts
from northfinder.procedures.visits import Visit
from northfinder.units import DEG


@dataclass(frozen=True, slots=True)
class NorthSeek:
    """Everything that the visits tell.

    Attributes:
        visits: All of them, in time order.
        used: What it was computed from: those of segments that were proved, less the disturbed.
        searches: Which visits were left out, by sensor.
        gyro: Fit of the rate, rad/s.
        accelerometer: Fit of the specific force, standard gravities.
        tilt: Of the table.
        solutions: The azimuth by each solver.
        budgets: Its uncertainty by each solver.
        earth_rate: The self-check of scale factor and latitude.
        checks: Verdicts in words.
        reference_offset_rad: From the index mark to the line whose azimuth is wanted.
    """

    visits: Sequence[Visit]
    used: Sequence[Visit]
    searches: Sequence[Search]
    gyro: HarmonicFit
    accelerometer: HarmonicFit
    tilt: TiltEstimate
    solutions: dict[Method, AzimuthSolution]
    budgets: dict[Method, AzimuthBudget]
    earth_rate: EarthRate
    checks: list[Check]
    reference_offset_rad: float


def reduce_visits(visits: Sequence[Visit], plan: Plan, config: RigConfig) -> NorthSeek:
    """Fit both sensors, estimate the tilt, solve the azimuth by every method, and judge it all.

    The noise is absolute where the configuration gives it, else it is estimated from the
    residuals; with no visit to spare for that, the scatter within the visits stands in.

    Raises:
        EstimationError: The visits do not determine north.
    """
    fitted = fit_visits(visits, plan, config, configured_or_seen)
    gyro, tilt, latitude_rad = fitted.gyro, fitted.tilt, fitted.latitude_rad
    known, dwell_s = systematic(config), [visit.duration_s for visit in fitted.used]
    solutions = {method: solve_azimuth(gyro, tilt, latitude_rad, method) for method in SOLVERS}
    budgets = {
        method: azimuth_budget(solution, gyro, tilt, known, dwell_s)
        for method, solution in solutions.items()
    }
    earth_rate = measure_earth_rate(
        gyro, tilt, latitude_rad, known.latitude_rad, known.scale_factor
    )
    return NorthSeek(
        visits,
        fitted.used,
        fitted.searches,
        gyro,
        tilt.fit,
        tilt,
        solutions,
        budgets,
        earth_rate,
        [
            *verdicts(fitted, earth_rate, solutions["coordinate_transform"], config),
            *check_plan(plan, fitted, budgets["coordinate_transform"]),
        ],
        config.site.reference_offset_deg * DEG,
    )
