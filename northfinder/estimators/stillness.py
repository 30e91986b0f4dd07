"""Whether the bench moved between two visits to the same angles, and how much would have shown.

A new segment has a gyro bias of its own, so a single rate measured again tells nothing; the
*difference* of two does. Turned by delta in azimuth, the rate at table angle T, ``s(T) + R`` with
``s = a cos T + b sin T``, changes by ``s'(T) delta``, and the difference by that of the slopes.
The accelerometer's bias holds better than the gyro's, within an allowance: so both of its
readings count, and two angles that are not in line show a tilt in any direction.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri, ndtr

from northfinder.estimators.arrays import FloatArray, IntArray

LIMIT_SIGMAS = 4.0
_LEAST_SINE = 0.5  # between the two angles, 30 to 150 deg apart: see `choose_pair`
_SAME = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Repeated:
    """The same angles measured twice, ``(m,)`` each, m = 1 or 2.

    Attributes:
        rate_change: Second less first reading of the gyro, rad/s.
        rate_covariance: Of those changes, ``(m, m)``.
        signal: What the gyro feels of the horizontal Earth rate there, rad/s; zeros where north
            is not known yet.
        slope: Its derivative by the azimuth.
        gyro_angle_rad: Table angle plus the gyro's mount angle.
        force_change: Second less first reading of the accelerometer, local gravities.
        force_covariance: Of those changes, ``(m, m)``.
        accelerometer_angle_rad: Table angle plus the accelerometer's mount angle.
        vertical_rate_rad_s: ``Omega_e sin L``, which a tilt lets the gyro feel.
    """

    rate_change: FloatArray
    rate_covariance: FloatArray
    signal: FloatArray
    slope: FloatArray
    gyro_angle_rad: FloatArray
    force_change: FloatArray
    force_covariance: FloatArray
    accelerometer_angle_rad: FloatArray
    vertical_rate_rad_s: float


@dataclass(frozen=True, slots=True)
class Stillness:
    """What they tell.

    Attributes:
        turned: Whether the gyro's difference has changed by more than 4 sigma.
        turned_rad: By how much in azimuth, clockwise; NaN where north is not known.
        turn_limit_rad: The smallest turn that is 4 sigma; infinite where none is.
        tilted: Whether the accelerometer's readings have changed as rarely as by 4 sigma.
        tilted_rad: By how much, in the directions that are seen.
        tilt_limit_rad: The smallest tilt that shows whatever its direction; of a single angle,
            along that angle.
    """

    turned: bool
    turned_rad: float
    turn_limit_rad: float
    tilted: bool
    tilted_rad: float
    tilt_limit_rad: float

    @property
    def moved(self) -> bool:
        """Whether it did, either way."""
        return self.turned or self.tilted


def choose_pair(angle_rad: FloatArray, segment: IntArray, slope: FloatArray) -> tuple[int, int]:
    """Choose the two readings of one segment whose difference a turn of the bench moves most.

    Exactly opposite angles would be best, and blind to a tilt about the line through them: the
    best pair that is 30 to 150 deg apart loses at most 4 % of that where the whole circle is
    there to choose from. Where no pair is, the best of any.

    Args:
        angle_rad: Table angles, ``(n,)``.
        segment: Label of each; one of them has at least two readings.
        slope: Derivative of each reading by the azimuth.
    """
    first, second = np.triu_indices(len(angle_rad), 1)
    together = segment[first] == segment[second]
    first, second = first[together], second[together]
    shift = np.abs(slope[first] - slope[second])
    sine = np.abs(np.sin(angle_rad[first] - angle_rad[second]))
    spread = sine >= _LEAST_SINE - _SAME
    best = int(np.argmax(np.where(spread, shift, 0.0) if spread.any() else shift))
    return int(first[best]), int(second[best])


def judge_stillness(repeated: Repeated) -> Stillness:
    """Hold the changes against their noise."""
    change = repeated.force_change
    towards = _directions(repeated.accelerometer_angle_rad)
    weight = np.linalg.inv(repeated.force_covariance)
    limit = float(chdtri(len(change), 2.0 * ndtr(-LIMIT_SIGMAS)))
    tilt = np.linalg.pinv(towards, rcond=_SAME) @ change
    # One angle alone sees along itself: its other direction is not asked for.
    weakest = float(np.linalg.eigvalsh(towards.T @ weight @ towards)[-len(change)])
    felt = repeated.vertical_rate_rad_s * _directions(repeated.gyro_angle_rad) @ tilt
    turned, turned_rad, turn_limit_rad = _turn(repeated, repeated.rate_change - felt)
    return Stillness(
        turned,
        turned_rad,
        turn_limit_rad,
        tilted=bool(change @ weight @ change > limit),
        tilted_rad=float(np.hypot(*tilt)),
        tilt_limit_rad=math.sqrt(limit / weakest) if weakest > 0.0 else math.inf,
    )


def _directions(angle_rad: FloatArray) -> FloatArray:
    return np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=-1)


def _turn(repeated: Repeated, change: FloatArray) -> tuple[bool, float, float]:
    """Return whether it turned, by how much, and the smallest turn that would show."""
    if len(change) == 1:  # one rate alone: the new bias absorbs any turn
        return False, math.nan, math.inf
    moved, signal, slope = (
        float(values[1] - values[0]) for values in (change, repeated.signal, repeated.slope)
    )
    between = np.array([-1.0, 1.0])
    limit = LIMIT_SIGMAS * math.sqrt(float(between @ repeated.rate_covariance @ between))
    turned = abs(moved) > limit
    amplitude = math.hypot(signal, slope)
    if amplitude == 0.0:
        return turned, math.nan, math.inf
    # The difference is a sine of the azimuth; of the turns that explain it, the smallest.
    sign = math.copysign(1.0, slope)
    phase = math.atan2(sign * signal, abs(slope))
    sine = min(1.0, max(-1.0, math.sin(phase) + sign * moved / amplitude))
    return turned, math.asin(sine) - phase, limit / abs(slope) if slope else math.inf
