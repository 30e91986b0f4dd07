"""What a plan will achieve, before anything moves."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.estimators.azimuth import solve_azimuth
from northfinder.estimators.design import HarmonicDesign
from northfinder.estimators.harmonic import fit_design
from northfinder.estimators.tilt import estimate_tilt
from northfinder.estimators.uncertainty import (
    AzimuthBudget,
    BudgetLine,
    SystematicUncertainty,
    azimuth_budget,
)
from northfinder.units import DEG

_AZIMUTHS_RAD = np.arange(0.0, 360.0, 2.0) * DEG


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """The budget at the least favourable azimuth, and which that is."""

    azimuth_rad: float
    budget: AzimuthBudget


def predict_azimuth(
    gyro: HarmonicDesign,
    accelerometer: HarmonicDesign,
    latitude_rad: float,
    systematic: SystematicUncertainty,
    visit_duration_s: ArrayLike | None = None,
) -> Prediction:
    """Predict the budget of a revolution on a level table, at the worst azimuth of the circle.

    The azimuth is not known before the run, and the order of visits makes some worse than
    others: the promise is kept whichever way the table stands. Without other lines, n equally
    spaced readings of sigma give ``sigma sqrt(2/n) / (Omega_e cos L)``, the Cramer-Rao bound.

    Args:
        gyro: Angles, times and sigma (rad/s) of the gyro's readings.
        accelerometer: The accelerometer's; its sigma in local gravities.
        latitude_rad: Geodetic latitude, positive north.
        systematic: What is known of the other errors.
        visit_duration_s: Length of each visit; needed for the bias instability.

    Raises:
        EstimationError: Beyond 89 deg of latitude.
        ValueError: A design without sigma, or a line without the times that it needs.
    """
    if gyro.sigma is None or accelerometer.sigma is None:
        msg = "a prediction needs the sigma of the gyro's and the accelerometer's readings"
        raise ValueError(msg)
    level_rate = EARTH_RATE_RAD_S * np.cos(latitude_rad)
    readings = level_rate * np.cos(np.subtract.outer(_AZIMUTHS_RAD, gyro.angle_rad))
    fit = fit_design(gyro, readings)
    tilt = estimate_tilt(fit_design(accelerometer, np.zeros(len(accelerometer.angle_rad))))
    solution = solve_azimuth(fit, tilt, latitude_rad)
    budget = azimuth_budget(solution, fit, tilt, systematic, visit_duration_s)
    worst = int(np.argmax(budget.sigma_rad))
    lines = tuple(BudgetLine(line.source, line.u_rad[worst], line.dof) for line in budget.lines)
    return Prediction(float(_AZIMUTHS_RAD[worst]), AzimuthBudget(lines))
