"""Four minutes on the simulated rocking base: what its sensors give, and what is true."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from northfinder.alignment import Aligner, Alignment, SensorErrors
from northfinder.attitude.arrays import FloatArray
from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR, STANDARD_GRAVITY_M_S2
from sim.rocking_base import RockingBase, RockingSettings, nominal, paper_like

LATITUDE_RAD: Final = 39.1 * DEG
PERIOD_S: Final = 0.008
#: Of the fit; a warm filter has run as long before it.
DURATION_S: Final = 120.0
SENSORS: Final = SensorErrors(
    gyro_noise_rad_sqrt_s=5e-4 * DEG_PER_SQRT_HOUR,
    accelerometer_noise_g_sqrt_hz=5e-6,
    gyro_bias_rad_s=0.01 * DEG_PER_HOUR,
    accelerometer_bias_g=5e-5,
)
#: The two bases, the calmer one first.
BASES: Final[dict[str, Callable[[float, int], RockingSettings]]] = {
    "nominal": nominal,
    "paper-like": paper_like,
}
_LEVEL_RATE_RAD_S: Final = EARTH_RATE_RAD_S * float(np.cos(LATITUDE_RAD))


@dataclass(frozen=True)
class Drive:
    """One drive, 240 s; the fit takes the second half of it.

    Attributes:
        base: What moves.
        gravity: Local gravity, standard gravities.
        angle_rad: Increments of the gyros, ``(k, 3)``.
        velocity: Increments of the accelerometers, g s, ``(k, 3)``.
        gyro_bias_rad_s: In b, ``(3,)``.
        accelerometer_bias_g: In b, ``(3,)``.
    """

    base: RockingBase
    gravity: float
    angle_rad: FloatArray
    velocity: FloatArray
    gyro_bias_rad_s: FloatArray
    accelerometer_bias_g: FloatArray

    @cached_property
    def at_end(self) -> Rotation:
        """The true attitude at the end, b to n."""
        return self.attitude(np.array([DURATION_S]))[0]

    def attitude(self, fitted_s: FloatArray) -> Rotation:
        """Return the true attitudes so long after the fit's beginning, b to n."""
        return Rotation.from_matrix(self.base.attitude(DURATION_S + fitted_s))

    def equilibrium(self, attitude: Rotation) -> FloatArray:
        """Return the small turn (E, N, U) that the biases alone bring, rad, ``(..., 3)``.

        A reference of the same sensors, or one that they keep, is off by as much.
        """
        east = attitude.apply(self.gyro_bias_rad_s)[..., 0] / _LEVEL_RATE_RAD_S
        bias = attitude.apply(self.accelerometer_bias_g) / self.gravity
        about_north = -bias[..., 0]
        about_up = east + np.tan(LATITUDE_RAD) * about_north
        return np.stack([bias[..., 1], about_north, about_up], axis=-1)

    def align(self, method: str, *, warm: bool = False) -> Alignment:
        """Align by a method of the product, over the second half."""
        begin = 0 if warm else len(self.angle_rad) // 2
        aligner = Aligner(
            method,
            LATITUDE_RAD,
            PERIOD_S,
            sensors=SENSORS,
            gravity=self.gravity,
            warm_s=DURATION_S if warm else 0.0,
        )
        aligner.add(self.angle_rad[begin:], self.velocity[begin:])
        return aligner.solve()

    def error(self, found: Alignment) -> FloatArray:
        """Return the small turn (E, N, U) from the truth to what was found, rad, ``(3,)``."""
        attitude = Rotation.from_quat(found.q_b_n, scalar_first=True)
        return np.asarray((attitude * self.at_end.inv()).as_rotvec())


def drive(base: str, seed: int) -> Drive:
    """Simulate a drive; the same seed has the same sensors, people and engine on both bases."""
    settings = BASES[base](LATITUDE_RAD, seed)
    rocking, random = RockingBase(settings), np.random.default_rng([2014, seed])
    time_s = PERIOD_S * np.arange(1.0, round(2.0 * DURATION_S / PERIOD_S) + 1.0)
    rate_rad_s, force_g = rocking.felt(time_s, PERIOD_S)
    gyro = SENSORS.gyro_bias_rad_s * random.standard_normal(3)
    accelerometer = SENSORS.accelerometer_bias_g * random.standard_normal(3)
    walk = np.sqrt(PERIOD_S) * random.standard_normal((2, *rate_rad_s.shape))
    return Drive(
        rocking,
        settings.gravity() / STANDARD_GRAVITY_M_S2,
        (rate_rad_s + gyro) * PERIOD_S + SENSORS.gyro_noise_rad_sqrt_s * walk[0],
        (force_g + accelerometer) * PERIOD_S + SENSORS.accelerometer_noise_g_sqrt_hz * walk[1],
        gyro,
        accelerometer,
    )
