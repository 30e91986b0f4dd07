"""North so far, while the run goes on."""

from collections.abc import Sequence

from northfinder.config import RigConfig
from northfinder.errors import EstimationError
from northfinder.estimators.azimuth import measure_earth_rate, solve_azimuth
from northfinder.estimators.uncertainty import azimuth_budget
from northfinder.procedures.events import Estimate
from northfinder.procedures.fits import fit_visits, scatter_within
from northfinder.procedures.plan import Plan, systematic
from northfinder.procedures.verdicts import verdicts_so_far
from northfinder.procedures.visits import Visit


def estimate_so_far(visits: Sequence[Visit], plan: Plan, config: RigConfig) -> Estimate | None:
    """Return north of an unfinished run; None while it is not determined.

    The noise is that within the visits: the residuals of the first few would make the sigma
    jump about. The result's own comes from the residuals.
    """
    try:
        fitted = fit_visits(visits, plan, config, scatter_within)
        solution = solve_azimuth(fitted.gyro, fitted.tilt, fitted.latitude_rad)
    except EstimationError:
        return None
    known = systematic(config)
    dwell_s = [visit.duration_s for visit in fitted.used]
    budget = azimuth_budget(solution, fitted.gyro, fitted.tilt, known, dwell_s)
    earth_rate = measure_earth_rate(
        fitted.gyro, fitted.tilt, fitted.latitude_rad, known.latitude_rad, known.scale_factor
    )
    return Estimate(
        azimuth_rad=float(solution.azimuth_rad),
        sigma_rad=float(budget.sigma_rad),
        visits=len(fitted.used),
        searches=fitted.searches,
        gyro=fitted.gyro,
        tilt=fitted.tilt,
        checks=verdicts_so_far(fitted, earth_rate, solution),
    )
