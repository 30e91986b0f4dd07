"""How long to measure at each angle of the next north-seek, from a gyro's noise figures."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.errors import EstimationError
from northfinder.estimators.allan_figures import NoiseFit
from northfinder.estimators.allan_likelihood import FLOOR
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.coloured import walk_covariance
from northfinder.estimators.design import distinct_angles, harmonic_design
from northfinder.estimators.flicker import flicker_covariance

_STEP = 1.05  # between the dwells that are tried
_LONGEST_SHARE = 0.25  # of the record
_LONGEST_S = 3600.0
_WORTH = 0.25  # of the exponent of sigma by the run's duration; white noise alone has 0.5
_ABOVE_WHITE = 1.1  # of the Allan deviation over its white line


@dataclass(frozen=True, slots=True)
class DwellSuggestion:
    """What to take, and why.

    Attributes:
        dwell_s: Measuring time at each distinct angle, over all its visits.
        sigma_rad: Of the azimuth at the least favourable azimuth, the gyro's noise alone.
        leaves_white_s: The averaging time at which the Allan deviation is 10 % above its white
            slope; infinite where the record shows nothing but white noise.
        reason: A sentence.
    """

    dwell_s: float
    sigma_rad: float
    leaves_white_s: float
    reason: str


def suggest_dwell(
    fit: NoiseFit,
    visit_angle_rad: ArrayLike,
    latitude_rad: float,
    pause_s: float,
    drift_order: int = 0,
) -> DwellSuggestion:
    """Choose the longest dwell that still profits.

    Where the Allan deviation leaves its white slope is only half of the answer: a revolution
    takes many visits, so that flicker and random walk of the whole run count, and the order of
    visits decides how much of them reaches the azimuth. So sigma is predicted for these visits:
    as long as 10 % more time for the run gives at least 2.4 % (white noise alone: 4.7 %), a
    longer dwell profits. It does not go below the pause before a visit, where the table would
    move for longer than it measures, nor beyond what the record can vouch for: a quarter of it a
    visit.

    Args:
        fit: The gyro's figures.
        visit_angle_rad: Table angle of each visit in time order, ``(n,)``.
        latitude_rad: Geodetic, positive north.
        pause_s: Moving and settling before each visit.
        drift_order: Of the fit that the run will have; 1 for a sequential order.

    Raises:
        EstimationError: The angles do not determine an azimuth, or the record shows no angle
            random walk: then no averaging is known to profit.
        ValueError: An angle is not finite, or the pause is not positive.
    """
    angle = np.asarray(visit_angle_rad, dtype=np.float64)
    design = harmonic_design(angle, None, np.arange(float(angle.size)), drift_order)
    if not (pause_s > 0.0 and math.isfinite(pause_s)):
        msg = f"pause_s must be a positive time of moving and settling, got {pause_s}"
        raise ValueError(msg)
    if not fit.angle_random_walk_rad_sqrt_s.seen:
        msg = (
            "the record shows no angle random walk, so that no averaging is known to profit: look "
            "at its Allan deviation before relying on this gyro"
        )
        raise EstimationError(msg)
    per_angle = len(angle) / (int(distinct_angles(angle).max()) + 1)
    vouched_s = _LONGEST_SHARE * fit.duration_s
    visit_s = _to_try(pause_s, min(_LONGEST_S / per_angle, vouched_s))
    variances = np.array([_variances(fit, design.gain[1:3], each, pause_s) for each in visit_s])
    last = _last_that_profits(np.sqrt(variances.sum(axis=1)), visit_s + pause_s)
    white, flicker, walk = variances[last]
    if last < len(visit_s) - 1:
        reason = _REASONS["first" if last == 0 else "flicker" if flicker > walk else "walk"]
    else:
        reason = _REASONS["vouched" if vouched_s < _LONGEST_S / per_angle else "longest"]
    level_rate = EARTH_RATE_RAD_S * math.cos(latitude_rad)
    sigma_rad = math.sqrt(white + flicker + walk) / level_rate
    return DwellSuggestion(float(visit_s[last]) * per_angle, sigma_rad, leaves_white_s(fit), reason)


_LESS = "beyond it 10 % more time for the run would improve sigma by less than 2.4 %, half of what"
_REASONS = {
    "first": "the gyro's slow noise outweighs its white noise however short the visits: the dwell "
    "is as long as the table's moves, and more revolutions are worth more than longer visits",
    "flicker": f"{_LESS} white noise alone would give: bias instability takes over",
    "walk": f"{_LESS} white noise alone would give: rate random walk takes over",
    "vouched": "a visit of a quarter of the record still profits, and for longer ones this record "
    "cannot vouch: a longer record may allow a longer dwell",
    "longest": "the longest dwell allowed still profits",
}


def leaves_white_s(fit: NoiseFit) -> float:
    """Averaging time at which the Allan deviation of the noise is 10 % above its white slope.

    The root of ``K^2 tau^2 / 3 + (2 ln 2/pi) B^2 tau = (1.1^2 - 1) N^2``; infinite where neither
    K nor B is seen, and 0 without N.
    """
    white, flicker, walk = _squares(fit)
    linear, square, constant = FLOOR * flicker, walk / 3.0, (_ABOVE_WHITE**2 - 1.0) * white
    if linear == square == 0.0:
        return math.inf
    return 2.0 * constant / (linear + math.sqrt(linear**2 + 4.0 * square * constant))


def _squares(fit: NoiseFit) -> tuple[float, float, float]:
    """Squares of N, B and K, zero where not seen."""
    figures = (
        fit.angle_random_walk_rad_sqrt_s,
        fit.bias_instability_rad_s,
        fit.rate_random_walk_rad_s_sqrt_s,
    )
    white, flicker, walk = ((figure.value or 0.0) ** 2 for figure in figures)
    return white, flicker, walk


def _to_try(shortest_s: float, longest_s: float) -> FloatArray:
    """Visits from the shortest to the longest, at least two."""
    count = max(2, math.ceil(math.log(max(longest_s / shortest_s, 1.0)) / math.log(_STEP)) + 1)
    return np.geomspace(shortest_s, max(longest_s, shortest_s * _STEP), count)


def _last_that_profits(sigma: FloatArray, duration_s: FloatArray) -> int:
    exponent = -np.diff(np.log(sigma)) / np.diff(np.log(duration_s))
    short = np.flatnonzero(exponent < _WORTH)
    return int(short[0]) if len(short) else len(sigma) - 1


def _variances(fit: NoiseFit, gain: FloatArray, visit_s: float, pause_s: float) -> FloatArray:
    """What white noise, flicker and walk do to a and b along the worst direction, ``(3,)``."""
    start_s = (visit_s + pause_s) * np.arange(float(gain.shape[1]))
    kinds = (
        np.eye(len(start_s)) / visit_s,
        flicker_covariance(start_s, visit_s, 1.0),
        walk_covariance(start_s, visit_s, 1.0),
    )
    reaching = [
        square * gain @ covariance @ gain.T
        for square, covariance in zip(_squares(fit), kinds, strict=True)
    ]
    worst = np.linalg.eigh(np.sum(reaching, axis=0))[1][:, -1]
    return np.array([worst @ each @ worst for each in reaching])
