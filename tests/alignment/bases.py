"""Sensors on a base that rests or rocks, and the attitude that their biases would give at rest."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from northfinder.alignment import Aligner, Alignment, SensorErrors
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR
from sim.base_settings import Swing
from sim.rocking_base import RockingBase, RockingSettings, nominal, paper_like

Array = NDArray[np.float64]
Preset = Callable[[float, int], RockingSettings]

ARCSEC = DEG / 3600.0
EARTH_RATE_RAD_S = 7.292115e-5
STANDARD_GRAVITY_M_S2 = 9.80665
LATITUDE_RAD = 39.1 * DEG
PERIOD_S = 0.008
SENSORS = SensorErrors(
    gyro_noise_rad_sqrt_s=5e-4 * DEG_PER_SQRT_HOUR,
    accelerometer_noise_g_sqrt_hz=5e-6,
    gyro_bias_rad_s=0.01 * DEG_PER_HOUR,
    accelerometer_bias_g=5e-5,
)
PERFECT = SensorErrors(
    gyro_noise_rad_sqrt_s=0.0,
    accelerometer_noise_g_sqrt_hz=0.0,
    gyro_bias_rad_s=0.0,
    accelerometer_bias_g=0.0,
)


def at_rest(latitude_rad: float, seed: int) -> RockingSettings:
    """A base on which nothing moves."""
    still = Swing(0.0, 0.1)
    base = replace(nominal(latitude_rad, seed), sway_rms_g=0.0, people=None, engine=())
    return replace(base, yaw=still, pitch=still, roll=still)


@dataclass(frozen=True)
class Stream:
    """Increments of a stream, the truth at its end, and the sensors' biases.

    ``velocity`` is in g s; ``gravity`` is local gravity in g.
    """

    angle_rad: Array
    velocity: Array
    gravity: float
    truth: Rotation
    gyro_bias_rad_s: Array
    accelerometer_bias: Array
    period_s: float = PERIOD_S
    latitude_rad: float = LATITUDE_RAD

    def later(self, start_s: float) -> "Stream":
        """The same from a time on: as if the alignment had begun, cold, at that time."""
        first = round(start_s / self.period_s)
        return replace(self, angle_rad=self.angle_rad[first:], velocity=self.velocity[first:])

    def equilibrium_error(self) -> Array:
        """Small rotation (E, N, U) by which the biases turn the attitude on a base at rest."""
        eps = self.truth.apply(self.gyro_bias_rad_s)
        bias = self.truth.apply(self.accelerometer_bias) / self.gravity
        north = -bias[0]
        heading = eps[0] / (EARTH_RATE_RAD_S * np.cos(self.latitude_rad))
        return np.array([bias[1], north, heading + np.tan(self.latitude_rad) * north])

    def align(
        self,
        method: str,
        warm_s: float = 0.0,
        sensors: SensorErrors = SENSORS,
        chunk: int = 5000,
    ) -> Alignment:
        aligner = Aligner(
            method,
            self.latitude_rad,
            self.period_s,
            sensors=sensors,
            gravity=self.gravity,
            warm_s=warm_s,
        )
        for i in range(0, len(self.angle_rad), chunk):
            aligner.add(self.angle_rad[i : i + chunk], self.velocity[i : i + chunk])
        return aligner.solve()

    def error(self, found: Alignment) -> Array:
        """Small rotation (E, N, U) from the truth to what was found, rad."""
        q = Rotation.from_quat(found.q_b_n, scalar_first=True)
        rotvec: Array = (q * self.truth.inv()).as_rotvec()
        return rotvec

    def from_shared_equilibrium(self, found: Alignment) -> Array:
        """The error less what the same biases would give at rest, (E, N, U), rad."""
        return self.error(found) - self.equilibrium_error()


@lru_cache(maxsize=64)
def felt(
    preset: Preset, seed: int, duration_s: float, period_s: float, start_s: float = 0.0
) -> tuple[Array, Array, Array, float]:
    """Exact rate and specific force (g) means, the attitude at the end, and gravity (g)."""
    settings = preset(LATITUDE_RAD, seed)
    base = RockingBase(settings)
    time_s = start_s + period_s * np.arange(1.0, round(duration_s / period_s) + 1.0)
    rate, force = base.felt(time_s, period_s)
    return rate, force, base.attitude(time_s[-1:])[0], settings.gravity() / STANDARD_GRAVITY_M_S2


def stream(
    preset: Preset,
    seed: int,
    duration_s: float = 120.0,
    sensors: SensorErrors = SENSORS,
    period_s: float = PERIOD_S,
) -> Stream:
    """What sensors on the base give, noise and biases drawn by the seed."""
    moves_by = 0 if preset is at_rest else seed  # one that stands still does so with every seed
    rate, force, truth, gravity = felt(preset, moves_by, duration_s, period_s)
    rng = np.random.default_rng([seed, 77])
    eps = sensors.gyro_bias_rad_s * rng.normal(size=3)
    bias = sensors.accelerometer_bias_g * rng.normal(size=3)
    walk = np.sqrt(period_s) * rng.normal(size=(2, *rate.shape))
    angle = (rate + eps) * period_s + sensors.gyro_noise_rad_sqrt_s * walk[0]
    velocity = (force + bias) * period_s + sensors.accelerometer_noise_g_sqrt_hz * walk[1]
    attitude = Rotation.from_matrix(truth)
    return Stream(angle, velocity, gravity, attitude, eps, bias, period_s)


__all__ = ["ARCSEC", "LATITUDE_RAD", "Stream", "at_rest", "nominal", "paper_like", "stream"]
