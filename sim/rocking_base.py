"""A base that rocks: true attitude, and what perfect inertial sensors on it feel.

The motion is a closed-form function of time, without beginning: any sampling rate, any duration,
any chunking. It shares no code with the alignment, which is held to it.
"""

import math

import numpy as np

from drivers.interfaces import FloatArray
from sim.base_people import Boarding
from sim.base_settings import STANDARD_GRAVITY_M_S2, RockingSettings, nominal, paper_like
from sim.base_tones import draw_tones
from sim.truth import EARTH_RATE_RAD_S

__all__ = ["RockingBase", "RockingSettings", "nominal", "paper_like"]

_PANEL_RAD = 1.2  # of the fastest tone in a panel: the three-point rule errs by 1.5e-6 of that tone
_NODES = np.array([-math.sqrt(0.6), 0.0, math.sqrt(0.6)])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
_LEANING = [1, 2, 5]  # pitch, roll and Up among the six
_BLOCK = 20_000  # samples at a time: an hour at 500 Hz need not lie in memory at once


class RockingBase:
    """The base, and the sensors' place on it.

    Args:
        settings: Everything that it does.
    """

    def __init__(self, settings: RockingSettings) -> None:
        self.settings = settings
        self._tones = draw_tones(settings)
        people, seed = settings.people, settings.seed
        self._boarding = None if people is None else Boarding(people, seed)
        self._rest_rad = np.array([settings.yaw_rad, settings.pitch_rad, settings.roll_rad])
        latitude_rad = settings.latitude_rad
        north_up = [0.0, math.cos(latitude_rad), math.sin(latitude_rad)]
        self._earth_rate_n = EARTH_RATE_RAD_S * np.array(north_up)
        self._reaction_n = np.array([0.0, 0.0, settings.gravity()])
        self._lever_arm_m = np.array(settings.lever_arm_m)

    def attitude(self, time_s: FloatArray) -> FloatArray:
        """Return ``C_b_n``, b right-front-up to n East-North-Up, ``(k, 3, 3)``.

        Raises:
            ValueError: The times are not finite numbers of shape ``(k,)``.
        """
        time_s = _as_times(time_s)
        return _rotation(*(self._rest_rad + self._motion(time_s)[0, :, :3]).T)

    def felt(self, time_s: FloatArray, period_s: float) -> tuple[FloatArray, FloatArray]:
        """Return the means over the interval that ends at each time, in b, ``(k, 3)`` each.

        Inertial rate in rad/s, Earth rate included, and specific force in standard gravities,
        the lever arm's and the base's acceleration included. The mean of a product of tones has
        no closed form: the three-point Gauss rule over panels that are short for the fastest
        tone. At 23 Hz and 500 Hz it errs by 3e-10 of that tone.

        Raises:
            ValueError: The times are not finite numbers of shape ``(k,)``, or the period is not
                a positive one.
        """
        time_s = _as_times(time_s)
        if not 0.0 < period_s < math.inf:
            msg = f"the period must be a positive number of seconds, got {period_s}"
            raise ValueError(msg)
        panels = math.ceil(period_s * self._tones.highest_rad_s / _PANEL_RAD)
        ends_s = np.split(time_s, range(_BLOCK, len(time_s), _BLOCK))
        means = np.vstack([self._means(end_s, period_s, panels) for end_s in ends_s])
        return means[:, :3], means[:, 3:] / STANDARD_GRAVITY_M_S2

    def _means(self, time_s: FloatArray, period_s: float, panels: int) -> FloatArray:
        middles = (np.arange(panels) + 0.5) / panels - 1.0
        before_s = period_s * np.add.outer(middles, _NODES / (2.0 * panels)).ravel()
        weights = np.tile(_WEIGHTS / panels, panels)
        instants = self._instants(np.add.outer(before_s, time_s).ravel())
        means: FloatArray = np.einsum(
            "n,cnk->kc", weights, instants.reshape(6, len(before_s), len(time_s))
        )
        return means

    def _instants(self, time_s: FloatArray) -> FloatArray:
        """Inertial rate (rad/s) and specific force (m/s^2) at each time, ``(6, k)``."""
        motion = self._motion(time_s)
        angle, first, second = np.moveaxis(motion[:, :, :3], 1, 2)
        rotation = _rotation(*(angle + self._rest_rad[:, np.newaxis]))
        turning, spinning_up = _body_rates(angle + self._rest_rad[:, np.newaxis], first, second)
        earth = np.einsum("knb,n->bk", rotation, self._earth_rate_n)
        arm = self._lever_arm_m[:, np.newaxis]
        swept = _cross(turning, arm)
        accelerated = _cross(spinning_up, arm) + _cross(turning, swept)
        velocity = np.einsum("knb,kn->bk", rotation, motion[1, :, 3:]) + swept
        reaction = np.einsum("knb,kn->bk", rotation, motion[2, :, 3:] + self._reaction_n)
        force = reaction + accelerated + 2.0 * _cross(earth, velocity)
        return np.vstack([turning + earth, force])

    def _motion(self, time_s: FloatArray) -> FloatArray:
        """Yaw, pitch, roll off rest (rad), East, North, Up (m), two derivatives, ``(3, k, 6)``."""
        motion = self._tones.motion(time_s)
        if self._boarding is not None:
            for order, leaning in zip(motion, self._boarding.motion(time_s), strict=True):
                order[:, _LEANING] += leaning
        return motion


def _as_times(time_s: FloatArray) -> FloatArray:
    times: FloatArray = np.asarray(time_s, dtype=np.float64)
    if times.ndim != 1 or times.size == 0 or not np.isfinite(times).all():
        msg = f"time_s needs finite seconds of shape (k,), k at least 1; got shape {times.shape}"
        raise ValueError(msg)
    return times


def _rotation(yaw: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """``R_z(yaw) R_x(pitch) R_y(roll)``, ``(k, 3, 3)``."""
    (sy, cy), (sp, cp), (sr, cr) = ((np.sin(x), np.cos(x)) for x in (yaw, pitch, roll))
    rows = [
        [cy * cr - sy * sp * sr, -sy * cp, cy * sr + sy * sp * cr],
        [sy * cr + cy * sp * sr, cy * cp, sy * sr - cy * sp * cr],
        [-cp * sr, sp, cp * cr],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _body_rates(
    angle: FloatArray, first: FloatArray, second: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rate of b against n, in b, and its derivative, from yaw, pitch, roll; ``(3, k)`` each.

    ``R_y^T (R_x^T [0, 0, yaw'] + [pitch', 0, 0]) + [0, roll', 0]``.
    """
    (_, pitch, roll), (yaw1, pitch1, roll1), (yaw2, pitch2, roll2) = angle, first, second
    (sp, cp), (sr, cr) = ((np.sin(x), np.cos(x)) for x in (pitch, roll))
    level, up = cp * yaw1, cp * yaw2 - sp * pitch1 * yaw1  # cos(pitch) yaw' and its derivative
    rate = np.array([cr * pitch1 - sr * level, roll1 + sp * yaw1, sr * pitch1 + cr * level])
    growth = [
        cr * pitch2 - sr * up - roll1 * rate[2],
        roll2 + sp * yaw2 + cp * pitch1 * yaw1,
        sr * pitch2 + cr * up + roll1 * rate[0],
    ]
    return rate, np.array(growth)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """``a x b`` of ``(3, k)``; numpy's own takes three times as long on short bursts."""
    crossed: FloatArray = np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
    return crossed
