"""Which checks a north-seek is put to, at its end and while it goes on."""

import math

from northfinder.config import RigConfig
from northfinder.estimators.azimuth import AzimuthSolution, EarthRate
from northfinder.estimators.checks import (
    Check,
    Disturbed,
    Sensor,
    check_drift,
    check_earth_rate,
    check_frozen,
    check_invalid_samples,
    check_latitude,
    check_lost_samples,
    check_outliers,
    check_residuals,
    check_spikes,
    check_tilt,
)
from northfinder.estimators.table_check import check_table
from northfinder.estimators.turn_check import check_turned
from northfinder.procedures.fits import Fitted, of_both, scatter
from northfinder.procedures.proving import check_stillness
from northfinder.procedures.repeats import signal_of
from northfinder.samples import SPIKE_SIGMAS, Samples


def verdicts(
    fitted: Fitted, earth_rate: EarthRate, solution: AzimuthSolution, config: RigConfig
) -> list[Check]:
    """Return every check of a finished run."""
    return [
        _residuals("gyro", fitted, given=config.gyro.noise_deg_sqrt_h is not None),
        _residuals("accelerometer", fitted, given=config.accelerometer.noise_g_sqrt_hz is not None),
        _outliers(fitted),
        check_earth_rate(earth_rate),
        check_drift(fitted.gyro, solution),
        _turned(fitted, solution, config),
        *_conditions(fitted, solution),
        *check_stillness(fitted, config),
    ]


def verdicts_so_far(
    fitted: Fitted, earth_rate: EarthRate, solution: AzimuthSolution
) -> list[Check]:
    """Return the checks that can be judged already.

    A drift is not among them: the way back has yet to show it, or to cancel it.
    """
    checks = [check_earth_rate(earth_rate), *_conditions(fitted, solution)]
    if fitted.gyro.dof < 2:  # next to nothing is left to tell the noise by
        return checks
    return [
        _residuals("gyro", fitted, given=False),
        _residuals("accelerometer", fitted, given=False),
        _outliers(fitted),
        *checks,
    ]


def _residuals(sensor: Sensor, fitted: Fitted, *, given: bool) -> Check:
    fit = fitted.gyro if sensor == "gyro" else fitted.tilt.fit
    sigma = fit.design.sigma
    if given and sigma is not None:
        return check_residuals(fit, sigma, "given", sensor)
    within = scatter([getattr(visit, sensor) for visit in fitted.used])
    return check_residuals(fit, within, "seen within the visits", sensor)


def _outliers(fitted: Fitted) -> Check:
    disturbed = [
        Disturbed(visit.index, visit.angle_rad, search.sensor, times)
        for search in fitted.searches
        for visit, times in search.left_out
    ]
    return check_outliers(
        len(fitted.searches[0].visits),
        max(search.outliers.limit for search in fitted.searches),
        max(search.outliers.strange for search in fitted.searches),
        disturbed,
    )


def _turned(fitted: Fitted, solution: AzimuthSolution, config: RigConfig) -> Check:
    _, slope = signal_of(fitted, fitted.used, config)
    visits = [visit.index for visit in fitted.used]
    return check_turned(fitted.gyro, slope, float(solution.sigma_rad), visits)


def _frozen(fitted: Fitted) -> list[Check]:
    visits = [visit.index for visit in fitted.visits]
    rates, forces = of_both(fitted.visits)
    sensors: tuple[tuple[Sensor, list[Samples]], ...] = (("gyro", rates), ("accelerometer", forces))
    found = (
        check_frozen([part.mean for part in samples], scatter(samples), visits, sensor)
        for sensor, samples in sensors
    )
    return [check for check in found if check is not None]


def _conditions(fitted: Fitted, solution: AzimuthSolution) -> list[Check]:
    visits = fitted.visits
    rates, _ = of_both(visits)
    return [
        *_frozen(fitted),
        check_table(
            [visit.angle_rad for visit in visits],
            [math.nan if visit.turned_rad is None else visit.turned_rad for visit in visits],
            [visit.segment for visit in visits],
            float(solution.sigma_rad),
        ),
        check_tilt(fitted.tilt),
        check_latitude(fitted.latitude_rad),
        check_lost_samples(
            [len(visit.gyro) + len(visit.accelerometer) for visit in visits],
            [visit.gyro.lost + visit.accelerometer.lost for visit in visits],
        ),
        check_invalid_samples(
            [len(samples) for samples in rates], [samples.invalid for samples in rates]
        ),
        check_spikes(
            [len(visit.gyro) + len(visit.accelerometer) for visit in visits],
            [visit.gyro.spikes + visit.accelerometer.spikes for visit in visits],
            SPIKE_SIGMAS,
        ),
    ]
