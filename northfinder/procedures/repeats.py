"""The visits that measured an angle again beside those of the first time, for the comparison."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from northfinder.config import RigConfig
from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.drift import SIGNIFICANT_SIGMAS
from northfinder.estimators.flicker import flicker_covariance
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.stillness import Repeated, Stillness, judge_stillness
from northfinder.procedures.fits import Fitted, of_both, scatter, scatter_within
from northfinder.procedures.plan import systematic
from northfinder.procedures.segments import taking_part
from northfinder.procedures.visits import Visit
from northfinder.units import DEG, DEG_PER_HOUR

#: What no bench repeats better, whatever its sensors' noise: the play of a bearing, 2 arc seconds.
_LEAST_FORCE_SIGMA_G = 1e-5
_LEAST_RATE_SIGMA_RAD_S = 1e-3 * DEG_PER_HOUR
#: An accelerometer's bias from one hour to the next; twice a STIM300's bias instability.
_FORCE_BIAS_SIGMA_G = 1e-4
_CHANCE = 0.01  # that noise alone scatters so: then it is taken for noise alone


@dataclass(frozen=True, slots=True)
class Noise:
    """Of the mean over T seconds: these over sqrt(T); rad/s and standard gravities."""

    rate_sqrt_s: float
    force_sqrt_s: float

    @classmethod
    def of(cls, used: Sequence[Visit], fitted: Fitted | None) -> "Noise":
        """Take what all visits show within; more where they clearly differ by more between."""
        rates, forces = of_both(used)
        rate, force = _pooled(used, scatter(rates)), _pooled(used, scatter(forces))
        if fitted is not None:
            rates, forces = of_both(fitted.used)
            rate *= _excess(fitted.gyro, scatter_within(rates))
            force *= _excess(fitted.tilt.fit, scatter_within(forces))
        return cls(rate, force)

    def rate_variance(self, visits: Sequence[Visit]) -> FloatArray:
        """Return the variance of each visit's rate."""
        return np.maximum(self.rate_sqrt_s**2 / _durations(visits), _LEAST_RATE_SIGMA_RAD_S**2)

    def force_variance(self, visits: Sequence[Visit]) -> FloatArray:
        """Return the variance of each visit's force."""
        return np.maximum(self.force_sqrt_s**2 / _durations(visits), _LEAST_FORCE_SIGMA_G**2)


def judge_segment(
    fitted: Fitted | None, visits: Sequence[Visit], segment: int, config: RigConfig
) -> Stillness:
    """Hold a segment's repeats against the first time.

    Args:
        fitted: The fits, for the slopes, the noise and the drift; None before three angles.
        visits: All visits, each at its index.
        segment: Whose repeats.
        config: For mount angles, gravity and bias instability.
    """
    again = [v for v in visits if v.segment == segment and v.repeats is not None]
    first = [visits[v.repeats] for v in again if v.repeats is not None]
    signal, slope = np.zeros((2, len(again)))
    vertical_rad_s = 0.0
    if fitted is not None:
        signal, slope = signal_of(fitted, again, config)
        vertical_rad_s = EARTH_RATE_RAD_S * math.sin(fitted.latitude_rad)
    noise = Noise.of(taking_part(visits), fitted)
    rate_variance = noise.rate_variance(first) + noise.rate_variance(again)
    force_variance = noise.force_variance(first) + noise.force_variance(again)
    gravity_g = config.site.gravity_g
    rate_change, by_drift = _less_drift(fitted, first, again)
    by_flicker = _flicker(first, again, systematic(config).bias_instability_rad_s)
    force_covariance = np.diag(force_variance) + _FORCE_BIAS_SIGMA_G**2
    return judge_stillness(
        Repeated(
            rate_change=rate_change,
            rate_covariance=np.diag(rate_variance) + by_drift + by_flicker,
            signal=signal,
            slope=slope,
            gyro_angle_rad=_angles(again, config.gyro.mount_angle_deg),
            force_change=_force_changes_g(first, again) / gravity_g,
            force_covariance=force_covariance / gravity_g**2,
            accelerometer_angle_rad=_angles(again, config.accelerometer.mount_angle_deg),
            vertical_rate_rad_s=vertical_rad_s,
        )
    )


def signal_of(
    fitted: Fitted, visits: Sequence[Visit], config: RigConfig
) -> tuple[FloatArray, FloatArray]:
    """Return what the gyro feels of the horizontal Earth rate, and its slope by the azimuth."""
    vertical = EARTH_RATE_RAD_S * math.sin(fitted.latitude_rad)
    a, b = fitted.gyro.parameters[1:3] - vertical * fitted.tilt.level
    angle = _angles(visits, config.gyro.mount_angle_deg)
    return a * np.cos(angle) + b * np.sin(angle), a * np.sin(angle) - b * np.cos(angle)


def _less_drift(
    fitted: Fitted | None, first: Sequence[Visit], again: Sequence[Visit]
) -> tuple[FloatArray, FloatArray]:
    """Return the changes of the rate less the drift of the first time, and what that is unsure by.

    Both first readings are of one segment. A drift that does not stand out of the noise is not
    taken off: part of a revolution tells it too badly, and over two visits it is nothing.
    """
    pairs = list(zip(first, again, strict=True))
    change = np.array([later.gyro.mean - earlier.gyro.mean for earlier, later in pairs])
    waited_s = np.array([later.time_s - earlier.time_s for earlier, later in pairs])
    slope, sigma = _drift(fitted, first[0].segment)
    if abs(slope) <= SIGNIFICANT_SIGMAS * sigma:
        return change, np.zeros((len(change), len(change)))
    return change - slope * waited_s, sigma**2 * np.outer(waited_s, waited_s)


def _drift(fitted: Fitted | None, segment: int) -> tuple[float, float]:
    """Return a segment's fitted drift and its sigma, rad/s^2; zeros where none is fitted."""
    if fitted is not None:
        for terms in fitted.gyro.segments:
            if terms.label == segment and len(terms.drift):
                return float(terms.drift[0]), math.sqrt(float(terms.covariance[1, 1]))
    return 0.0, 0.0


def _force_changes_g(first: Sequence[Visit], again: Sequence[Visit]) -> FloatArray:
    changes = [
        later.accelerometer.mean - earlier.accelerometer.mean
        for earlier, later in zip(first, again, strict=True)
    ]
    return np.array(changes)


def _flicker(
    first: Sequence[Visit], again: Sequence[Visit], bias_instability_rad_s: float
) -> FloatArray:
    """Return what a wandering bias adds to the covariance of the gyro's changes."""
    visits = [*first, *again]
    duration_s = np.array([visit.duration_s for visit in visits])
    middle_s = np.array([visit.time_s for visit in visits])
    windows = flicker_covariance(middle_s - duration_s / 2.0, duration_s, bias_instability_rad_s)
    difference = np.hstack([-np.eye(len(first)), np.eye(len(again))])
    covariance: FloatArray = difference @ windows @ difference.T
    return covariance


def _angles(visits: Sequence[Visit], mount_angle_deg: float) -> FloatArray:
    return np.array([visit.angle_rad for visit in visits]) + mount_angle_deg * DEG


def _pooled(visits: Sequence[Visit], sigma: FloatArray) -> float:
    return math.sqrt(float(np.mean(sigma**2 * _durations(visits))))


def _durations(visits: Sequence[Visit]) -> FloatArray:
    return np.array([visit.duration_s for visit in visits])


def _excess(fit: HarmonicFit, within: FloatArray) -> float:
    """Return how many times more the visits scatter about the fit than within."""
    chi2 = float(np.sum((fit.residuals / within) ** 2))
    by_chance = fit.dof == 0 or float(chdtrc(fit.dof, chi2)) > _CHANCE
    return 1.0 if by_chance else math.sqrt(chi2 / fit.dof)
