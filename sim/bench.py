"""One shared world: the table's angle is what the gyro and the accelerometer feel."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from drivers.interfaces import FloatArray
from sim.footstep import Footstep
from sim.interfaces import Felt
from sim.motion import Plate
from sim.noise import NoiseLevels, SensorNoise
from sim.rocking_base import RockingBase, RockingSettings
from sim.sensor_faults import FaultySensor, SensorFaults
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
        rocking: How its base moves about the truth; None where it stands still.
    """

    def __init__(
        self,
        truth: Truth,
        plate: Plate,
        *,
        clockwise: bool = False,
        rocking: RockingSettings | None = None,
    ) -> None:
        self.plate = plate
        self._footstep: Footstep | None = None
        self.set_down(truth, rocking)
        self._direction = -1.0 if clockwise else 1.0

    def set_down(self, truth: Truth, rocking: RockingSettings | None) -> None:
        """Put the bench elsewhere, or onto another base; also while it runs."""
        self.truth = truth
        self._base = None if rocking is None else RockingBase(rocking.standing_at(truth))
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
        if self._base is not None:
            return self._felt_rocking(self._base, mounting, time_s, period_s)
        if self._footstep is not None and first_s < self._footstep.end_s:
            return self._felt_footstep(self._footstep, mounting, time_s, period_s)
        resting_rad = self.plate.resting_rad(first_s)
        if resting_rad is not None:  # as nearly always: then all samples are the same
            rate, force = self._at_rest(mounting, resting_rad)
            count = len(time_s)
            return np.repeat(rate, count, axis=0), np.repeat(force, count, axis=0)
        vectors_t = self._earth_rate_t, self._specific_force_t
        return self._felt_turning(vectors_t, mounting, time_s, period_s)

    def _felt_rocking(
        self, base: RockingBase, mounting: Mounting, time_s: FloatArray, period_s: float
    ) -> tuple[FloatArray, FloatArray]:
        rate_t, force_t = base.felt(time_s, period_s)
        return self._felt_turning((rate_t.T, force_t.T), mounting, time_s, period_s)

    def step_beside(self, footstep: Footstep) -> None:
        """Let somebody step beside a bench that stands still; a base that rocks hides it."""
        self._footstep = footstep

    def _felt_footstep(
        self, footstep: Footstep, mounting: Mounting, time_s: FloatArray, period_s: float
    ) -> tuple[FloatArray, FloatArray]:
        rate, force = footstep.felt(self._specific_force_t, time_s, period_s)
        rate += self._earth_rate_t[:, np.newaxis]
        force += self._specific_force_t[:, np.newaxis]
        return self._felt_turning((rate, force), mounting, time_s, period_s)

    def _felt_turning(
        self,
        vectors_t: tuple[FloatArray, FloatArray],
        mounting: Mounting,
        time_s: FloatArray,
        period_s: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Resolve rate and force along the table's axes, ``(3,)`` or ``(3, k)``, as it turns."""
        axes = mounting.body_axes()
        times_s = np.concatenate([[float(time_s[0]) - period_s], time_s])
        angle = self._direction * self.plate.angle_rad(times_s)
        middle = (angle[1:] + angle[:-1]) / 2 + mounting.angle_rad
        rate, force = _along(vectors_t, middle)
        rate[:, 2] += (angle[1:] - angle[:-1]) / period_s
        return rate @ axes.T, force @ axes.T

    def _at_rest(self, mounting: Mounting, resting_rad: float) -> tuple[FloatArray, FloatArray]:
        """Return what a sensor feels while the plate stands, each ``(1, 3)``; asked a lot."""
        known = self._resting.get(mounting)
        if known is None or known[0] != resting_rad:
            axes = mounting.body_axes()
            standing = np.array([self._direction * resting_rad + mounting.angle_rad])
            rate, force = _along((self._earth_rate_t, self._specific_force_t), standing)
            known = self._resting[mounting] = resting_rad, rate @ axes.T, force @ axes.T
        return known[1:]


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
        gyro_random, accelerometer_random, fault_random = random.spawn(3)
        self.gyro_noise = SensorNoise(gyro, gyro_random)
        self.accelerometer_noise = SensorNoise(accelerometer, accelerometer_random)
        self._faulty = FaultySensor(fault_random)

    @property
    def faults(self) -> SensorFaults:
        """Return what goes wrong inside; set it at any time."""
        return self._faulty.faults

    def sense(self, time_s: FloatArray, period_s: float) -> Felt:
        """Return what the sensor reads over the intervals that end at the given times."""
        rate, force = self._bench.felt(self._mounting, time_s, period_s)
        rate += self.gyro_noise.sample(time_s, period_s)
        force += self.accelerometer_noise.sample(time_s, period_s)
        felt = Felt(rate, force, np.full(len(time_s), _ROOM_DEG_C))
        return self._faulty.spoiled(felt, time_s, period_s)


def _along(vectors_t: tuple[FloatArray, FloatArray], angle_rad: FloatArray) -> FloatArray:
    """Resolve vectors of the table along (right, sensing, up) at each angle, ``(2, k, 3)``."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    felt = np.empty((2, len(angle_rad), 3))
    for (x, y, z), along in zip(vectors_t, felt, strict=True):
        along[:, 0] = cos * x + sin * y
        along[:, 1] = cos * y - sin * x
        along[:, 2] = z
    return felt
