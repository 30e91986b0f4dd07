"""One shared world: the table's angle is what the gyro and the accelerometer feel."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from drivers.interfaces import FloatArray
from sim.interfaces import Felt
from sim.motion import Plate
from sim.noise import NoiseLevels, SensorNoise
from sim.truth import Truth

_ROOM_DEG_C = 23.0

# Which of (right of the sensing direction, sensing direction, up) each body axis is: the sensing
# axis lies along the table's mark, and another axis points up.
_RIGHT, _SENSE, _UP = np.eye(3)
_BODY_AXES = {
    "x": np.stack([_SENSE, -_RIGHT, _UP]),
    "y": np.stack([_RIGHT, _SENSE, _UP]),
    "z": np.stack([_UP, _RIGHT, _SENSE]),
}


@dataclass(frozen=True, slots=True)
class Mounting:
    """How a sensor sits on the plate.

    Attributes:
        axis: The body axis that lies in the table's plane: ``x``, ``y`` or ``z``, with a minus
            sign where it points backwards.
        angle_rad: Of that axis, counter-clockwise from the index mark.
    """

    axis: str
    angle_rad: float = 0.0

    def body_axes(self) -> FloatArray:
        """Return the rotation from (right, sensing, up) to body axes, shape ``(3, 3)``."""
        axes = _BODY_AXES[self.axis.removeprefix("-")]
        if self.axis.startswith("-"):  # half a turn about the axis that points up
            axes = axes @ np.diag([-1.0, -1.0, 1.0])
        return axes


class Bench:
    """The plate on the turning Earth, and the sensors on the plate.

    Args:
        truth: Where the bench stands.
        plate: The table.
        clockwise: Whether the table's positive direction is clockwise seen from above.
    """

    def __init__(self, truth: Truth, plate: Plate, *, clockwise: bool = False) -> None:
        self.plate = plate
        self.truth = truth
        self._direction = -1.0 if clockwise else 1.0

    @property
    def truth(self) -> Truth:
        """Where the bench stands; may be replaced while running."""
        return self._truth

    @truth.setter
    def truth(self, truth: Truth) -> None:
        self._truth = truth
        self._resting: dict[Mounting, tuple[float, FloatArray, FloatArray]] = {}
        # Every burst of every sensor asks: work it out once.
        self._earth_rate_t = truth.earth_rate_t()
        self._specific_force_t = truth.specific_force_t()

    def felt(
        self, mounting: Mounting, time_s: FloatArray, period_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return rate (rad/s) and specific force (g) along a sensor's axes, each ``(k, 3)``.

        The rate is the mean over the period that ends at each time: the table's part by its
        angle's difference, so that turning integrates exactly.
        """
        first_s = float(time_s[0]) - period_s
        resting_rad = self.plate.resting_rad(first_s)
        if resting_rad is not None:  # as nearly always: then all samples are the same
            rate, force = self._at_rest(mounting, resting_rad)
            count = len(time_s)
            return np.repeat(rate, count, axis=0), np.repeat(force, count, axis=0)
        axes = mounting.body_axes()
        angle = self._direction * self.plate.angle_rad(np.concatenate([[first_s], time_s]))
        rate, force = self._along((angle[1:] + angle[:-1]) / 2 + mounting.angle_rad)
        rate[:, 2] += (angle[1:] - angle[:-1]) / period_s
        return rate @ axes.T, force @ axes.T

    def _at_rest(self, mounting: Mounting, resting_rad: float) -> tuple[FloatArray, FloatArray]:
        """Return what a sensor feels while the plate stands, each ``(1, 3)``; asked a lot."""
        known = self._resting.get(mounting)
        if known is None or known[0] != resting_rad:
            axes = mounting.body_axes()
            standing = np.array([self._direction * resting_rad + mounting.angle_rad])
            rate, force = self._along(standing)
            known = self._resting[mounting] = resting_rad, rate @ axes.T, force @ axes.T
        return known[1:]

    def _along(self, angle_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Resolve Earth rate and gravity along (right, sensing, up) at each angle, ``(k, 3)``."""
        cos, sin = np.cos(angle_rad), np.sin(angle_rad)
        vectors_t = self._earth_rate_t, self._specific_force_t
        felt = np.empty((2, len(angle_rad), 3))
        for (x, y, z), along in zip(vectors_t, felt, strict=True):
            along[:, 0] = cos * x + sin * y
            along[:, 1] = cos * y - sin * x
            along[:, 2] = z
        return felt[0], felt[1]


class BenchSensor:
    """An inertial sensor bolted to the plate, its noise included: implements ``Sensing``."""

    def __init__(
        self,
        bench: Bench,
        mounting: Mounting,
        gyro: NoiseLevels,
        accelerometer: NoiseLevels,
        random: Generator,
    ) -> None:
        self._bench = bench
        self._mounting = mounting
        gyro_random, accelerometer_random = random.spawn(2)
        self.gyro_noise = SensorNoise(gyro, gyro_random)
        self.accelerometer_noise = SensorNoise(accelerometer, accelerometer_random)

    def sense(self, time_s: FloatArray, period_s: float) -> Felt:
        """Return what the sensor reads over the intervals that end at the given times."""
        rate, force = self._bench.felt(self._mounting, time_s, period_s)
        rate += self.gyro_noise.sample(time_s, period_s)
        force += self.accelerometer_noise.sample(time_s, period_s)
        return Felt(rate, force, np.full(len(time_s), _ROOM_DEG_C))
