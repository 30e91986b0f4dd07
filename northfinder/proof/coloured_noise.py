"""Generalised least squares from measured Allan figures, against the Cramer-Rao bound."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from drivers.interfaces import FloatArray
from northfinder.estimators.allan_figures import NoiseFit
from northfinder.estimators.allan_fit import fit_noise
from northfinder.estimators.coloured import SlowNoise
from northfinder.estimators.design import HarmonicDesign, harmonic_design
from northfinder.procedures.visits import Order, schedule
from northfinder.proof.figure import Figure
from northfinder.units import DEG_PER_HOUR, DEG_PER_SQRT_HOUR, HOUR
from sim.noise import NoiseLevels, SensorNoise

_PERIOD_S = 0.1
_RECORD_S = 2 * HOUR  # of the noise run that the figures come from
_DWELL_S, _PAUSE_S = 2.5, 2.0
_ORDERS: tuple[Order, ...] = ("sequential", "out-and-back", "opposite")


class Mix(NamedTuple):
    """A gyro's noise: deg/sqrt(h), deg/h, deg/h/sqrt(h)."""

    name: str
    white: float
    flicker: float
    walk: float


_MIXES = (
    Mix("white", 0.002, 0.0, 0.0),
    Mix("bias instability", 0.001, 0.05, 0.0),
    Mix("rate random walk", 0.001, 0.0, 0.3),
    Mix("both", 0.002, 0.03, 0.2),
)


def coloured_noise() -> Iterator[Figure]:
    """Weigh visits by figures from a noise run of two hours; the bound knows the true ones."""
    for mix in _MIXES:
        fit = _measured(mix, seed=1)
        ratios = [_over_the_bound(mix, fit, order) for order in _ORDERS]
        name = f"{mix.name}: sigma over the Cramer-Rao bound, worst of three orders"
        yield Figure(name, max(ratios), "", 1.0 - 1e-9, 1.05)


def _measured(mix: Mix, seed: int) -> NoiseFit:
    """Measure the figures as a noise run does, on the simulator's noise."""
    levels = NoiseLevels(
        white_sqrt_s=mix.white * DEG_PER_SQRT_HOUR,
        bias_instability=mix.flicker * DEG_PER_HOUR,
        random_walk_per_sqrt_s=mix.walk * DEG_PER_HOUR / np.sqrt(HOUR),
    )
    noise = SensorNoise(levels, np.random.default_rng(seed))
    time_s = _PERIOD_S * np.arange(1, round(_RECORD_S / _PERIOD_S) + 1)
    bursts = [noise.sample(burst, _PERIOD_S)[:, 0] for burst in np.split(time_s, len(time_s) // 10)]
    return fit_noise(np.concatenate(bursts), _PERIOD_S)


def _over_the_bound(mix: Mix, fit: NoiseFit, order: Order) -> float:
    """Return the largest sigma of (a, b) in any direction over that of the true weights."""
    true = _covariance(
        mix.white * DEG_PER_SQRT_HOUR,
        SlowNoise(mix.flicker * DEG_PER_HOUR, mix.walk * DEG_PER_HOUR / np.sqrt(HOUR)),
        order,
    )
    figures = (
        fit.angle_random_walk_rad_sqrt_s,
        fit.bias_instability_rad_s,
        fit.rate_random_walk_rad_s_sqrt_s,
    )
    white, flicker, walk = (figure.value or 0.0 for figure in figures)
    ours = _design(order, _covariance(white, SlowNoise(flicker, walk), order)).gain[1:3]
    best = _design(order, true).unit_covariance[1:3, 1:3]
    achieved = np.linalg.eigvals(np.linalg.solve(best, ours @ true @ ours.T))
    return float(np.sqrt(achieved.real.max()))


def _covariance(white: float, slow: SlowNoise, order: Order) -> FloatArray:
    visits = schedule(24, 2 * _DWELL_S, order, 1)
    dwell_s = np.array([visit.dwell_s for visit in visits])
    start_s = np.concatenate([[0.0], np.cumsum(dwell_s + _PAUSE_S)[:-1]])
    covariance: FloatArray = np.diag(white**2 / dwell_s)
    for part in slow.covariances(start_s, dwell_s).values():
        covariance = covariance + part
    return covariance


def _design(order: Order, covariance: FloatArray) -> HarmonicDesign:
    angle_rad = [visit.angle_rad for visit in schedule(24, 2 * _DWELL_S, order, 1)]
    return harmonic_design(angle_rad, covariance=covariance)
