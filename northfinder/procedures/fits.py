"""The fits of both sensors over the visits that take part, and where their noise comes from.

A visit that does not belong to the rest is left out of both fits; what couples the visits (the
gyro's measured flicker and random walk) weighs them, by generalised least squares.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from northfinder.config import RigConfig
from northfinder.errors import EstimationError
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.checks import Sensor
from northfinder.estimators.design import HarmonicDesign, harmonic_design
from northfinder.estimators.drift import unmodelled_drift
from northfinder.estimators.harmonic import HarmonicFit, fit_design
from northfinder.estimators.outliers import Outliers, OutlierSearch
from northfinder.estimators.tilt import TiltEstimate, estimate_tilt
from northfinder.procedures.plan import (
    Plan,
    attenuation_of,
    chosen_order,
    drift_orders,
    systematic,
)
from northfinder.procedures.segments import taking_part
from northfinder.procedures.visits import Visit, duration_s
from northfinder.samples import Samples
from northfinder.units import DEG, DEG_PER_SQRT_HOUR

#: rad/s or g. Samples may be all alike, as of a simulated sensor without noise; no mean is exact.
_LEAST_SCATTER = 1e-12

#: Sigma of each visit's mean, or None to estimate it: from the samples, the configured noise
#: (mean over T seconds: noise/sqrt(T)) and the number of parameters.
NoiseModel = Callable[[Sequence[Samples], float | None, int], FloatArray | None]


def configured_or_seen(
    samples: Sequence[Samples], noise_sqrt_s: float | None, parameters: int
) -> FloatArray | None:
    """Take the configured noise; without one leave it to the residuals, where any are free."""
    if noise_sqrt_s is not None:
        return noise_sqrt_s / np.sqrt([duration_s(part) * _share(part) for part in samples])
    return None if len(samples) > parameters else scatter_within(samples)


def scatter_within(samples: Sequence[Samples], *_: object) -> FloatArray:
    """Take the scatter within each visit, never nothing."""
    return np.maximum(scatter(samples), _LEAST_SCATTER)


def scatter(samples: Sequence[Samples]) -> FloatArray:
    """Return the standard error of each visit's mean by its own samples."""
    return np.array([part.sigma for part in samples])


def of_both(visits: Sequence[Visit]) -> tuple[list[Samples], list[Samples]]:
    """Return the rates and the forces."""
    return [visit.gyro for visit in visits], [visit.accelerometer for visit in visits]


@dataclass(frozen=True, slots=True)
class Search:
    """What was looked for and found among a sensor's readings of the visits that take part."""

    sensor: Sensor
    visits: Sequence[Visit]
    outliers: Outliers

    @property
    def left_out(self) -> list[tuple[Visit, float]]:
        """Return the visits that do not belong, and how many sigma each is off."""
        indices, times = self.outliers.index, self.outliers.times.tolist()
        return [(self.visits[i], t) for i, t in zip(indices, times, strict=True)]


@dataclass(frozen=True, slots=True)
class Fitted:
    """Visits, and what the fits make of them.

    Attributes:
        visits: All of them, in time order.
        used: Those that take part and belong, a row of both fits each.
        searches: What was left out of them, by sensor.
        gyro: Fit of the rate, rad/s.
        tilt: Of the table; its ``fit`` is the accelerometer's, standard gravities.
        latitude_rad: The plan's, or the site's.
    """

    visits: Sequence[Visit]
    used: Sequence[Visit]
    searches: Sequence[Search]
    gyro: HarmonicFit
    tilt: TiltEstimate
    latitude_rad: float


def fit_visits(visits: Sequence[Visit], plan: Plan, config: RigConfig, noise: NoiseModel) -> Fitted:
    """Fit both sensors over the visits that take part.

    Each segment has its own bias, of the accelerometer too: hours may lie between them.

    Raises:
        EstimationError: They do not determine the coefficients.
    """
    used = taking_part(visits)
    if not used:
        msg = "no visit is complete, so there is no north yet"
        raise EstimationError(msg)
    gyro, accelerometer = _fit_both(used, plan, config, noise)
    searches = (_search("gyro", used, gyro), _search("accelerometer", used, accelerometer))
    disturbed = {visit.index for search in searches for visit, _ in search.left_out}
    if disturbed:
        used = [visit for visit in used if visit.index not in disturbed]
        gyro, accelerometer = _fit_both(used, plan, config, noise, whole=False)
    tilt = estimate_tilt(accelerometer, config.site.gravity_g)
    return Fitted(visits, used, searches, gyro, tilt, plan.latitude_rad(config))


def _search(sensor: Sensor, visits: Sequence[Visit], fit: HarmonicFit) -> Search:
    return Search(sensor, visits, OutlierSearch(fit.design).find(fit.reading))


def _fit_both(
    visits: Sequence[Visit], plan: Plan, config: RigConfig, noise: NoiseModel, *, whole: bool = True
) -> tuple[HarmonicFit, HarmonicFit]:
    segment = [visit.segment for visit in visits]
    _, lengths = np.unique(segment, return_counts=True)
    # Without the visits that were left out no order cancels a drift, as a sequential one.
    order = chosen_order(plan) if whole else "sequential"
    orders = drift_orders(order, lengths.tolist())
    gyro = _fit_gyro(visits, plan, config, noise, orders)
    if orders == (0,) and unmodelled_drift(gyro)[0].significant:
        # There and back the drift does not touch a and b, but left in the residuals it would
        # pass for noise.
        gyro = _fit_gyro(visits, plan, config, noise, (1,))
    _, forces = of_both(visits)
    design = harmonic_design(
        _angles(visits, config.accelerometer.mount_angle_deg),
        noise(forces, config.accelerometer.noise_g_sqrt_hz, 2 + len(orders)),
        segment=segment,
        attenuation=attenuation_of(visits, plan),
    )
    return gyro, fit_design(design, [samples.mean for samples in forces])


def _fit_gyro(
    visits: Sequence[Visit],
    plan: Plan,
    config: RigConfig,
    noise: NoiseModel,
    orders: tuple[int, ...],
) -> HarmonicFit:
    rates, _ = of_both(visits)
    sigma = noise(rates, _gyro_noise(config), 2 + len(orders) + sum(orders))
    design = _gyro_design(visits, plan, config, sigma, orders)
    return fit_design(design, [samples.mean for samples in rates])


def _gyro_design(
    visits: Sequence[Visit],
    plan: Plan,
    config: RigConfig,
    sigma: FloatArray | None,
    orders: tuple[int, ...],
) -> HarmonicDesign:
    """Weigh the visits by their white noise, and by what couples them where that is known."""
    angle_rad = _angles(visits, config.gyro.mount_angle_deg)
    time_s = np.array([visit.time_s for visit in visits])
    segment = [visit.segment for visit in visits]
    slow = systematic(config).slow_noise
    attenuation = attenuation_of(visits, plan)
    if not slow.any:
        return harmonic_design(angle_rad, sigma, time_s, orders, segment, attenuation=attenuation)
    lasting_s = np.array([visit.duration_s for visit in visits])
    white = scatter_within([visit.gyro for visit in visits]) if sigma is None else sigma
    between = slow.covariances(time_s - lasting_s / 2, lasting_s)
    covariance = np.diag(white**2) + sum(between.values())
    return harmonic_design(
        angle_rad,
        None,
        time_s,
        orders,
        segment,
        covariance=covariance,
        absolute=sigma is not None,
        attenuation=attenuation,
    )


def _angles(visits: Sequence[Visit], mount_angle_deg: float) -> FloatArray:
    return np.array([visit.angle_rad for visit in visits]) + mount_angle_deg * DEG


def _gyro_noise(config: RigConfig) -> float | None:
    noise_deg_sqrt_h = config.gyro.noise_deg_sqrt_h
    return None if noise_deg_sqrt_h is None else noise_deg_sqrt_h * DEG_PER_SQRT_HOUR


def _share(samples: Samples) -> float:
    return (len(samples) - samples.invalid) / samples.expected
