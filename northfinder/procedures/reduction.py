"""From visits to north: a pure function of the samples, the plan and the configuration.

A live run and ``northfinder runs recompute`` call the same function, so the same samples give
the identical result.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from northfinder.config import RigConfig
from northfinder.errors import EstimationError
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.azimuth import (
    AzimuthSolution,
    EarthRate,
    measure_earth_rate,
    solve_azimuth,
)
from northfinder.estimators.checks import (
    Check,
    check_drift,
    check_earth_rate,
    check_invalid_samples,
    check_latitude,
    check_lost_samples,
    check_outliers,
    check_residuals,
    check_tilt,
)
from northfinder.estimators.drift import unmodelled_drift
from northfinder.estimators.harmonic import HarmonicFit, fit_harmonic
from northfinder.estimators.solvers import SOLVERS, Method
from northfinder.estimators.table_check import check_table
from northfinder.estimators.tilt import TiltEstimate, estimate_tilt
from northfinder.estimators.uncertainty import AzimuthBudget, azimuth_budget
from northfinder.procedures.plan import Plan, chosen_order, drift_order, systematic
from northfinder.procedures.visits import Visit
from northfinder.samples import Samples
from northfinder.units import DEG, DEG_PER_SQRT_HOUR


@dataclass(frozen=True, slots=True)
class NorthSeek:
    """Everything that the visits tell.

    Attributes:
        visits: What it was computed from.
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
    gyro, accelerometer = _fit_both(visits, plan, config, _noise_model)
    tilt = estimate_tilt(accelerometer, config.site.gravity_g)
    latitude_rad, known, dwell_s = plan.latitude_rad(config), systematic(config), _dwell_s(visits)
    solutions = {method: solve_azimuth(gyro, tilt, latitude_rad, method) for method in SOLVERS}
    budgets = {
        method: azimuth_budget(solution, gyro, tilt, known, dwell_s)
        for method, solution in solutions.items()
    }
    earth_rate = measure_earth_rate(
        gyro, tilt, latitude_rad, known.latitude_rad, known.scale_factor
    )
    rates, forces = _of_both(visits)
    checks = [
        check_residuals(gyro, _scatter(rates), "gyro"),
        check_residuals(accelerometer, _scatter(forces), "accelerometer"),
        check_outliers(gyro),
        check_earth_rate(earth_rate),
        check_drift(gyro, solutions["coordinate_transform"]),
        check_table(
            [visit.angle_rad for visit in visits],
            [math.nan if visit.turned_rad is None else visit.turned_rad for visit in visits],
        ),
        check_tilt(tilt),
        check_latitude(latitude_rad),
        check_lost_samples(
            [len(visit.gyro) + len(visit.accelerometer) for visit in visits],
            [visit.gyro.lost + visit.accelerometer.lost for visit in visits],
        ),
        check_invalid_samples(
            [len(samples) for samples in rates], [samples.invalid for samples in rates]
        ),
    ]
    offset_rad = config.site.reference_offset_deg * DEG
    return NorthSeek(
        visits, gyro, accelerometer, tilt, solutions, budgets, earth_rate, checks, offset_rad
    )


def estimate_so_far(
    visits: Sequence[Visit], plan: Plan, config: RigConfig
) -> tuple[float, float] | None:
    """Return azimuth and sigma (rad) of an unfinished run; None while north is not determined.

    The noise is that within the visits: the residuals of the first few would make the sigma
    jump about. The result's own comes from the residuals.
    """
    try:
        gyro, accelerometer = _fit_both(visits, plan, config, _scatter_within)
        tilt = estimate_tilt(accelerometer, config.site.gravity_g)
        solution = solve_azimuth(gyro, tilt, plan.latitude_rad(config))
    except EstimationError:
        return None
    budget = azimuth_budget(solution, gyro, tilt, systematic(config), _dwell_s(visits))
    return float(solution.azimuth_rad), float(budget.sigma_rad)


#: rad/s or g. Samples may be all alike, as of a simulated sensor without noise; no mean is exact.
_LEAST_SCATTER = 1e-12

#: Sigma of each visit's mean, or None to estimate it: from the samples, the configured noise
#: (mean over T seconds: noise/sqrt(T)) and the number of parameters.
NoiseModel = Callable[[Sequence[Samples], float | None, int], FloatArray | None]


def _noise_model(
    samples: Sequence[Samples], noise_sqrt_s: float | None, parameters: int
) -> FloatArray | None:
    if noise_sqrt_s is not None:
        return noise_sqrt_s / np.sqrt([_duration_s(part) * _share(part) for part in samples])
    return None if len(samples) > parameters else _scatter_within(samples)


def _scatter_within(samples: Sequence[Samples], *_: object) -> FloatArray:
    return np.maximum(_scatter(samples), _LEAST_SCATTER)


def _fit_both(
    visits: Sequence[Visit], plan: Plan, config: RigConfig, sigma: NoiseModel
) -> tuple[HarmonicFit, HarmonicFit]:
    _, forces = _of_both(visits)
    order = drift_order(chosen_order(plan), len(visits))
    gyro = _fit_gyro(visits, config, sigma, order)
    if order == 0 and unmodelled_drift(gyro)[0].significant:
        # There and back the drift does not touch a and b, but left in the residuals it would
        # pass for noise.
        gyro = _fit_gyro(visits, config, sigma, 1)
    accelerometer = fit_harmonic(
        _angles(visits, config.accelerometer.mount_angle_deg),
        [samples.mean for samples in forces],
        sigma(forces, config.accelerometer.noise_g_sqrt_hz, 3),
    )
    return gyro, accelerometer


def _fit_gyro(
    visits: Sequence[Visit], config: RigConfig, sigma: NoiseModel, order: int
) -> HarmonicFit:
    rates, _ = _of_both(visits)
    segment = [visit.segment for visit in visits]
    parameters = 2 + len(set(segment)) * (1 + order)
    return fit_harmonic(
        _angles(visits, config.gyro.mount_angle_deg),
        [samples.mean for samples in rates],
        sigma(rates, _gyro_noise(config), parameters),
        [float(np.mean(samples.time_s)) for samples in rates],
        order,
        segment,
    )


def _of_both(visits: Sequence[Visit]) -> tuple[list[Samples], list[Samples]]:
    return [visit.gyro for visit in visits], [visit.accelerometer for visit in visits]


def _angles(visits: Sequence[Visit], mount_angle_deg: float) -> FloatArray:
    return np.array([visit.angle_rad for visit in visits]) + mount_angle_deg * DEG


def _gyro_noise(config: RigConfig) -> float | None:
    noise_deg_sqrt_h = config.gyro.noise_deg_sqrt_h
    return None if noise_deg_sqrt_h is None else noise_deg_sqrt_h * DEG_PER_SQRT_HOUR


def _scatter(samples: Sequence[Samples]) -> FloatArray:
    return np.array([part.sigma for part in samples])


def _dwell_s(visits: Sequence[Visit]) -> FloatArray:
    return np.array([_duration_s(visit.gyro) for visit in visits])


def _duration_s(samples: Samples) -> float:
    """Return the length of the visit by the device's clock."""
    ticks = int(samples.tick[-1] - samples.tick[0])
    return float(samples.time_s[-1] - samples.time_s[0]) / ticks * samples.expected


def _share(samples: Samples) -> float:
    return (len(samples) - samples.invalid) / samples.expected
