"""Does the stated interval hold the truth when the run ends where sigma has become small enough?

Monte Carlo at the level of visit means, by the estimators themselves. The scatter within the
visits, thousands of samples, is taken to show the noise exactly.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from drivers.interfaces import BoolArray, FloatArray
from northfinder.angles import within_half_turn
from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.estimators import estimate_tilt, fit_harmonic, solve_azimuth
from northfinder.estimators.design import harmonic_design
from northfinder.estimators.uncertainty import (
    AzimuthBudget,
    SystematicUncertainty,
    azimuth_budget,
)
from northfinder.procedures.plan import FEWEST_FOR_TARGET, drift_order
from northfinder.procedures.visits import schedule
from northfinder.proof.figure import Figure
from northfinder.units import DEG, DEG_PER_HOUR
from sim.truth import Truth

_POSITIONS = 24
_GYRO_SIGMA_RAD_S = 0.038 * DEG_PER_HOUR  # of a visit of 2.5 s with the simulated rig's sensors
_FORCE_SIGMA_G = 6e-6
_DRIFT_RAD_S = 0.05 * DEG_PER_HOUR  # over a revolution
_LATITUDE_RAD = 40.0 * DEG
_TRUTHS = 5
_RUNS = 20_000
#: The noise that there is, over the one that the dwell was chosen for.
_NOISES = (0.4, 0.7, 1.0, 1.2)


def target_stop() -> Iterator[Figure]:
    """Coverage of the 95 % interval over 20 000 seeks a row that end at their target."""
    for name, given in (("given", True), ("estimated", False)):
        for times in _NOISES:
            held, visits = stopped_seeks(_RUNS, times, np.random.default_rng(95), given=given)
            label = f"ends at its target, noise {name}, {times:g} times the predicted"
            yield Figure(f"{label}: 95 % interval holds", 100.0 * held, "%", 94.0, 96.0)
            # White noise falls with the root of the visits; a pair more or less is by chance.
            due = max(float(FEWEST_FOR_TARGET), 2 * _POSITIONS * times**2)
            yield Figure(f"{label}: mean visits", visits, "", 0.95 * due, 1.2 * due)


def stopped_seeks(
    runs: int, times_noise: float, random: Generator, *, given: bool
) -> tuple[float, float]:
    """Return the share of intervals that hold the truth, and the mean number of visits.

    Args:
        runs: How many seeks, a fifth of them at each of five azimuths and tilts.
        times_noise: The noise over the one that the planned revolution would do with.
        random: Seeded.
        given: Whether sigma is known, or taken from the residuals.
    """
    ended = [
        _ended(_seeks(runs // _TRUTHS, times_noise, random), given=given) for _ in range(_TRUTHS)
    ]
    held, visits = np.hstack(ended)
    return float(held.mean()), float(visits.mean())


@dataclass(frozen=True, slots=True)
class _Seeks:
    """Readings of all visits that the runs may make, ``(k, n)``, and what they are read with."""

    truth: Truth
    angle_rad: FloatArray
    rate: FloatArray
    force: FloatArray
    sigma: float
    force_sigma: float

    def first(
        self, visits: int, rows: BoolArray, *, given: bool
    ) -> tuple[AzimuthBudget, FloatArray]:
        """Return the budget and the error of the azimuth by the first visits of some runs."""
        angle, rate, force = (x[..., :visits] for x in (self.angle_rad, self.rate, self.force))
        order = drift_order("spread", visits)
        sigma = self.sigma if given else None
        fit = fit_harmonic(angle, rate[rows], sigma, np.arange(float(visits)), order)
        force_fit = fit_harmonic(angle, force[rows], self.force_sigma if given else None)
        tilt = estimate_tilt(force_fit, float(np.linalg.norm(self.truth.specific_force_t())))
        solution = solve_azimuth(fit, tilt, self.truth.latitude_rad)
        error = within_half_turn(solution.azimuth_rad - self.truth.azimuth_rad)
        return azimuth_budget(solution, fit, tilt, _curvature_known()), error


def _curvature_known() -> SystematicUncertainty:
    """Without a curvature: that line has coverage figures of its own."""
    return SystematicUncertainty(drift_curvature_rad_s3=0.0)


def _seeks(runs: int, times_noise: float, random: Generator) -> _Seeks:
    pitch_rad, roll_rad = random.normal(0.0, 2.0 * DEG, 2)
    truth = Truth(_LATITUDE_RAD, random.uniform(0.0, 2 * np.pi), pitch_rad, roll_rad)
    angle = np.array([visit.angle_rad for visit in schedule(_POSITIONS, 5.0, "spread", 2)])
    along = np.stack([-np.sin(angle), np.cos(angle), np.zeros_like(angle)], axis=1)
    drift = _DRIFT_RAD_S * np.arange(len(angle)) / (2 * _POSITIONS)
    noise, force_noise = random.standard_normal((2, runs, len(angle)))
    sigma, force_sigma = times_noise * _GYRO_SIGMA_RAD_S, times_noise * _FORCE_SIGMA_G
    rate = along @ truth.earth_rate_t() + drift + sigma * noise
    force = along @ truth.specific_force_t() + force_sigma * force_noise
    return _Seeks(truth, angle, rate, force, sigma, force_sigma)


def _target_rad(angle_rad: FloatArray) -> float:
    """Return the sigma that a planned revolution brings at the noise predicted, level."""
    planned = angle_rad[: 2 * _POSITIONS]
    times, order = np.arange(float(len(planned))), drift_order("spread", len(planned))
    design = harmonic_design(planned, _GYRO_SIGMA_RAD_S, times, order)
    worst = np.linalg.eigvalsh(design.unit_covariance[1:3, 1:3])[-1]
    return float(np.sqrt(worst) / (EARTH_RATE_RAD_S * np.cos(_LATITUDE_RAD)))


def _ended(seeks: _Seeks, *, given: bool) -> FloatArray:
    """Return of each run whether its interval holds the truth, and after how many visits."""
    target_rad, most = _target_rad(seeks.angle_rad), len(seeks.angle_rad)
    runs = len(seeks.rate)
    going, held, visits = np.ones(runs, bool), np.zeros(runs), np.zeros(runs)
    for n in range(FEWEST_FOR_TARGET, most + 1, 2):
        budget, error = seeks.first(n, going, given=given)
        within, _ = seeks.first(n, going, given=True)
        reached = (budget.sigma_rad <= target_rad) & (within.sigma_rad <= target_rad)
        ends = reached | (n == most)
        which = np.flatnonzero(going)[ends]
        held[which] = (np.abs(error) <= budget.interval95_rad)[ends]
        visits[which] = n
        going[which] = False
        if not going.any():
            break
    return np.stack([held, visits])
