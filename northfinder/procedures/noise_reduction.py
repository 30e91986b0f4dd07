"""From a static record to the noise in it: live, and again from the records."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.interfaces import FloatArray
from northfinder.config import RigConfig
from northfinder.errors import EstimationError
from northfinder.estimators.allan import AllanDeviation, overlapping_allan_deviation
from northfinder.estimators.allan_figures import NoiseFit
from northfinder.estimators.allan_fit import fit_noise
from northfinder.estimators.checks import Check, check_invalid_samples, check_lost_samples
from northfinder.estimators.dwell import DwellSuggestion, suggest_dwell
from northfinder.estimators.gaps import fill_gaps
from northfinder.procedures import plan as north_seek_plan
from northfinder.procedures.noise_plan import Plan
from northfinder.procedures.plan import chosen_order
from northfinder.procedures.visits import Visit, schedule
from northfinder.samples import Samples
from northfinder.units import DEG

_MOVED_RAD = 0.01 * DEG  # of tilt between the first and the last stretch
_SIGMAS = 5.0


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """The noise of one axis; the unit is the axis's own, rad/s or standard gravities.

    Attributes:
        axis: Which.
        mean: Of the record.
        filled: Samples that stand for lost ones.
        allan: The Allan deviation.
        fit: The figures.
    """

    axis: str
    mean: float
    filled: int
    allan: AllanDeviation
    fit: NoiseFit


@dataclass(frozen=True, slots=True)
class NoiseRecord:
    """Everything that a static record tells.

    Attributes:
        gyro: rad/s.
        accelerometer: Standard gravities.
        suggestion: How long to dwell in the next north-seek; None where no figure is seen.
        visits: The samples, stretch by stretch.
        checks: Verdicts in words.
    """

    gyro: SensorNoise
    accelerometer: SensorNoise
    suggestion: DwellSuggestion | None
    visits: Sequence[Visit]
    checks: list[Check]


def reduce_visits(visits: Sequence[Visit], plan: Plan, config: RigConfig) -> NoiseRecord:
    """Analyse a static record.

    Raises:
        EstimationError: It is too short, has too many gaps, or holds no noise at all.
    """
    gyro = _noise_of([visit.gyro for visit in visits], config.gyro.axis)
    accelerometer = _noise_of([visit.accelerometer for visit in visits], config.accelerometer.axis)
    return NoiseRecord(
        gyro,
        accelerometer,
        _suggestion(gyro.fit, plan, config),
        visits,
        [_check_stillness(visits), *_check_samples(visits)],
    )


def _suggestion(fit: NoiseFit, plan: Plan, config: RigConfig) -> DwellSuggestion | None:
    """Return the dwell for a north-seek of the usual angles; None where no noise is seen."""
    if plan.pause_s is None or not fit.angle_random_walk_rad_sqrt_s.seen:
        return None
    usual = north_seek_plan.Plan()
    visits = schedule(usual.positions, usual.dwell_s, chosen_order(usual), usual.revolutions)
    angles = [visit.angle_rad for visit in visits]
    return suggest_dwell(fit, angles, config.site.latitude_rad, plan.pause_s)


def _noise_of(stretches: Sequence[Samples], axis: str) -> SensorNoise:
    usable = [part.valid & np.isfinite(part.value) for part in stretches]
    tick = np.concatenate([part.tick[good] for part, good in zip(stretches, usable, strict=True)])
    value = np.concatenate([part.value[good] for part, good in zip(stretches, usable, strict=True)])
    try:
        filled = fill_gaps(tick, value)
    except ValueError as error:  # of a record, not of a caller
        raise EstimationError(str(error)) from error
    period_s = _period_s(stretches)
    return SensorNoise(
        axis,
        float(value.mean()),
        filled.filled,
        overlapping_allan_deviation(filled.value, period_s),
        fit_noise(filled.value, period_s),
    )


def _period_s(stretches: Sequence[Samples]) -> float:
    """Return the time between samples, by the device's own count; rounded to a picosecond."""
    first, last = stretches[0], stretches[-1]
    lasted_s = float(last.time_s[-1] - first.time_s[0])
    return round(lasted_s / float(last.tick[-1] - first.tick[0]), 12)


def _check_samples(visits: Sequence[Visit]) -> list[Check]:
    counts = [len(visit.gyro) for visit in visits]
    lost = [visit.gyro.lost for visit in visits]
    invalid = [visit.gyro.invalid for visit in visits]
    return [check_lost_samples(counts, lost), check_invalid_samples(counts, invalid)]


def _check_stillness(visits: Sequence[Visit]) -> Check:
    """Compare the first and the last stretch: the bench must not have been touched between."""
    first, last = visits[0].accelerometer, visits[-1].accelerometer
    tilted_rad = abs(last.mean - first.mean)
    limit_rad = _MOVED_RAD + _SIGMAS * math.hypot(first.sigma, last.sigma)
    text = (
        f"Between the first and the last stretch the accelerometer's reading changed by "
        f"{tilted_rad * 1000:.3f} mg (limit {limit_rad * 1000:.3f} mg)"
    )
    if tilted_rad <= limit_rad:
        return Check("stillness", "pass", f"{text}.")
    return Check("stillness", "warn", f"{text}; the bench was moved, or the sensor warms up.")


def deviations_of(noise: SensorNoise) -> FloatArray:
    """Return the Allan deviation of the figures that were seen, at the record's own tau."""
    return noise.fit.deviation(noise.allan.tau_s)
