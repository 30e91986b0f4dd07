"""A north-seeker on a tilted table: the simulator's truth, the estimators' answers."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from northfinder.angles import within_half_turn
from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.estimators import estimate_tilt, fit_harmonic, solve_azimuth
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.solvers import Method
from northfinder.units import DEG, STANDARD_GRAVITY_M_S2
from sim.truth import Truth

ANGLES_RAD: FloatArray = np.arange(24.0) * 15.0 * DEG
LATITUDE_RAD = 40.0 * DEG
#: Once round in whole degrees.
CIRCLE_RAD: FloatArray = np.arange(361.0) * DEG
_ALONG: FloatArray = np.stack(
    [-np.sin(ANGLES_RAD), np.cos(ANGLES_RAD), np.zeros_like(ANGLES_RAD)], axis=1
)


@dataclass(frozen=True, slots=True)
class Tilt:
    """How the table stands: by how much, and which table angle points downhill."""

    epsilon_rad: float
    zeta_rad: float

    def truth(self, azimuth_rad: float, latitude_rad: float) -> Truth:
        """Return the simulator's truth of it."""
        mark, left = (
            -np.sin(self.epsilon_rad) * f(self.zeta_rad) for f in (np.cos, np.sin)
        )  # sines of the elevations of the index mark and of the axis to its left
        pitch_rad = np.arcsin(mark)
        roll_rad = np.arcsin(left / np.cos(pitch_rad))
        return Truth(
            latitude_rad, azimuth_rad, pitch_rad, roll_rad, gravity_m_s2=STANDARD_GRAVITY_M_S2
        )


@dataclass(frozen=True, slots=True, eq=False)
class Revolutions:
    """Readings of 24 positions, one row for each determination.

    Attributes:
        azimuth_rad: The true ones, ``(k,)``.
        rate_rad_s: Of the gyro, ``(k, 24)``.
        force_g: Of the accelerometer, ``(k, 24)``.
        latitude_rad: Where.
    """

    azimuth_rad: FloatArray
    rate_rad_s: FloatArray
    force_g: FloatArray
    latitude_rad: float

    def errors_rad(self, method: Method) -> FloatArray:
        """Return azimuth less truth, within half a turn, ``(k,)``."""
        tilt = estimate_tilt(fit_harmonic(ANGLES_RAD, self.force_g))
        fit = fit_harmonic(ANGLES_RAD, self.rate_rad_s)
        found = solve_azimuth(fit, tilt, self.latitude_rad, method).azimuth_rad
        return within_half_turn(found - self.azimuth_rad)

    def noisy(self, gyro_rad_s: float, accelerometer_g: float, random: Generator) -> "Revolutions":
        """Return the same determinations with white noise on every reading."""
        shape = self.rate_rad_s.shape
        return Revolutions(
            self.azimuth_rad,
            self.rate_rad_s + gyro_rad_s * random.standard_normal(shape),
            self.force_g + accelerometer_g * random.standard_normal(shape),
            self.latitude_rad,
        )


def revolutions(
    tilt: Tilt, azimuth_rad: FloatArray = CIRCLE_RAD, latitude_rad: float = LATITUDE_RAD
) -> Revolutions:
    """Return what ideal sensors read at each azimuth."""
    truths = [tilt.truth(float(azimuth), latitude_rad) for azimuth in azimuth_rad]
    rate = np.stack([_ALONG @ truth.earth_rate_t() for truth in truths])
    force = np.stack([_ALONG @ truth.specific_force_t() for truth in truths])
    return Revolutions(azimuth_rad, rate, force, latitude_rad)


def repeated(tilt: Tilt, azimuth_rad: float, count: int) -> Revolutions:
    """Return ``count`` equal determinations, to put noise on."""
    one = revolutions(tilt, np.array([azimuth_rad]))
    rate, force = (np.repeat(rows, count, axis=0) for rows in (one.rate_rad_s, one.force_g))
    return Revolutions(np.full(count, azimuth_rad), rate, force, one.latitude_rad)


def printed_eq_10(revolution: Revolutions, *, by_gyro: bool = False) -> FloatArray:
    """Return errors of eq 10 fed by eqs 5 and 9 to the letter, rad.

    The accelerometer is read as the sensor of gravity that eq 5's a_A needs; its b_A then has
    the other sign.

    Args:
        revolution: The readings.
        by_gyro: Take zeta from b/a, as eq 9 prints it, not from b_A/a_A.
    """
    gyro, force = (
        fit_harmonic(ANGLES_RAD, row) for row in (revolution.rate_rad_s, revolution.force_g)
    )
    epsilon = np.arcsin(np.hypot(force.a, force.b))
    y, x = (gyro.b, gyro.a) if by_gyro else (-force.b, -force.a)
    zeta = -np.arctan2(y, x)
    up = EARTH_RATE_RAD_S * np.sin(revolution.latitude_rad)
    sines = [-np.sin(epsilon) * f(zeta) for f in (np.sin, np.cos)]
    numerator, denominator = (
        (rate - up * sine) / np.sqrt(1.0 - sine * sine)
        for rate, sine in zip((gyro.b, gyro.a), sines, strict=True)
    )
    return within_half_turn(np.arctan2(numerator, denominator) - revolution.azimuth_rad)


def largest_deg(error_rad: FloatArray) -> float:
    """Return the largest magnitude in deg."""
    return float(np.abs(error_rad).max()) / DEG
