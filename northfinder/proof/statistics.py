"""Monte Carlo of the estimators against the simulator's truth, batched."""

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from drivers.interfaces import FloatArray
from northfinder.angles import within_half_turn
from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.estimators import estimate_tilt, fit_harmonic, solve_azimuth
from northfinder.estimators.solvers import Method
from northfinder.estimators.uncertainty import SystematicUncertainty, azimuth_budget
from northfinder.proof.figure import Figure
from northfinder.units import ARCMIN, DEG, DEG_PER_HOUR
from sim.truth import Truth

_GYRO_SIGMA_RAD_S = 0.02 * DEG_PER_HOUR
_ACCELEROMETER_SIGMA_G = 2e-5
_ANGLES_RAD: FloatArray = np.arange(24.0) * 15.0 * DEG
_EXACT: tuple[Method, ...] = ("coordinate_transform", "vector", "two_vector")


def cramer_rao() -> Iterator[Figure]:
    """Scatter of 20 000 revolutions on a level table, over the Cramer-Rao bound."""
    truth, random = Truth(40 * DEG, 48 * DEG, 0.0, 0.0), np.random.default_rng(20)
    fit = fit_harmonic(_ANGLES_RAD, _rates(truth, 20_000, random), _GYRO_SIGMA_RAD_S)
    tilt = estimate_tilt(
        fit_harmonic(_ANGLES_RAD, _forces(truth, 1, random), _ACCELEROMETER_SIGMA_G),
        _gravity_g(truth),
    )
    error_rad = _turned(solve_azimuth(fit, tilt, truth.latitude_rad).azimuth_rad, truth)
    level_rate_rad_s = EARTH_RATE_RAD_S * np.cos(truth.latitude_rad)
    bound_rad = _GYRO_SIGMA_RAD_S * np.sqrt(2 / len(_ANGLES_RAD)) / level_rate_rad_s
    ratio = float(error_rad.std() / bound_rad)
    yield Figure("scatter of 20 000 revolutions over the bound", ratio, "", 0.98, 1.02)


def coverage() -> Iterator[Figure]:
    """How often the stated 95 % interval holds the truth: 400 000 runs, tilt 0 to 10 deg."""
    for name, known in (("given", True), ("estimated", False)):
        random = np.random.default_rng(95)
        shares = [_covered(truth, random, sigma_known=known) for truth in _truths(40, 10.0, random)]
        percent = 100.0 * float(np.mean(shares))
        yield Figure(f"95 % interval holds the truth, noise {name}", percent, "%", 94.5, 95.5)


def linear_drift() -> Iterator[Figure]:
    """What a drift of 0.05 deg/h over the run does, out and back, at the worst azimuth."""
    angles_rad = np.concatenate([_ANGLES_RAD, _ANGLES_RAD[::-1]])
    drift_rad_s = 0.05 * DEG_PER_HOUR * np.linspace(0.0, 1.0, len(angles_rad))
    errors_rad = []
    for azimuth_deg in range(0, 360, 5):
        truth = Truth(40 * DEG, azimuth_deg * DEG, 2 * DEG, -3 * DEG)
        rate, force = _readings(truth, angles_rad)
        tilt = estimate_tilt(fit_harmonic(angles_rad, force), _gravity_g(truth))
        solution = solve_azimuth(
            fit_harmonic(angles_rad, rate + drift_rad_s), tilt, truth.latitude_rad
        )
        errors_rad.append(_turned(solution.azimuth_rad, truth))
    worst = float(np.max(np.abs(errors_rad))) / ARCMIN
    yield Figure("drift of 0.05 deg/h, out and back: bias", worst, "'", None, 0.05)


def solver_agreement() -> Iterator[Figure]:
    """The three exact solvers: any tilt to 30 deg, any azimuth, latitude to 85 deg."""
    random = np.random.default_rng(30)
    apart_rad = []
    for truth in _truths(2_000, 30.0, random):
        rate, force = _readings(truth, _ANGLES_RAD)
        fit = fit_harmonic(_ANGLES_RAD, rate)
        tilt = estimate_tilt(fit_harmonic(_ANGLES_RAD, force), _gravity_g(truth))
        azimuths = [solve_azimuth(fit, tilt, truth.latitude_rad, m).azimuth_rad for m in _EXACT]
        apart_rad += [abs(within_half_turn(azimuth - azimuths[0])) for azimuth in azimuths[1:]]
    yield Figure("exact solvers apart, at most", float(np.max(apart_rad)), "rad", None, 1e-12)


def _covered(truth: Truth, random: Generator, *, sigma_known: bool, runs: int = 10_000) -> float:
    fit = fit_harmonic(
        _ANGLES_RAD, _rates(truth, runs, random), _GYRO_SIGMA_RAD_S if sigma_known else None
    )
    forces = fit_harmonic(
        _ANGLES_RAD, _forces(truth, runs, random), _ACCELEROMETER_SIGMA_G if sigma_known else None
    )
    tilt = estimate_tilt(forces, _gravity_g(truth))
    solution = solve_azimuth(fit, tilt, truth.latitude_rad)
    budget = azimuth_budget(solution, fit, tilt, SystematicUncertainty())
    inside = np.abs(_turned(solution.azimuth_rad, truth)) <= budget.interval95_rad
    return float(np.mean(inside))


def _truths(count: int, tilt_to_deg: float, random: Generator) -> Iterator[Truth]:
    latitude_to_deg = 85.0 if tilt_to_deg > 10.0 else 70.0
    for _ in range(count):
        tilt_rad = random.uniform(0.0, tilt_to_deg) * DEG
        towards_rad = random.uniform(0.0, 2 * np.pi)
        pitch_rad = np.arcsin(np.sin(tilt_rad) * np.cos(towards_rad))
        roll_rad = np.arcsin(np.sin(tilt_rad) * np.sin(towards_rad) / np.cos(pitch_rad))
        latitude_rad = random.uniform(-latitude_to_deg, latitude_to_deg) * DEG
        yield Truth(latitude_rad, random.uniform(0.0, 2 * np.pi), pitch_rad, roll_rad)


def _readings(truth: Truth, angle_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rate (rad/s) and specific force (g) along the mark turned to each angle."""
    along = np.stack([-np.sin(angle_rad), np.cos(angle_rad), np.zeros_like(angle_rad)], axis=1)
    return along @ truth.earth_rate_t(), along @ truth.specific_force_t()


def _rates(truth: Truth, runs: int, random: Generator) -> FloatArray:
    rate, _ = _readings(truth, _ANGLES_RAD)
    return rate + _GYRO_SIGMA_RAD_S * random.standard_normal((runs, len(rate)))


def _forces(truth: Truth, runs: int, random: Generator) -> FloatArray:
    _, force = _readings(truth, _ANGLES_RAD)
    return force + _ACCELEROMETER_SIGMA_G * random.standard_normal((runs, len(force)))


def _gravity_g(truth: Truth) -> float:
    return float(np.linalg.norm(truth.specific_force_t()))


def _turned(azimuth_rad: FloatArray, truth: Truth) -> FloatArray:
    return within_half_turn(azimuth_rad - truth.azimuth_rad)
