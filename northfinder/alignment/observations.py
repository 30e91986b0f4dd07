"""What the fit sees: the specific force in ib0 beside gravity's reaction in in0, ``W = A V``.

ib0 and in0 are the body and the local geographic frame (East-North-Up) at the beginning of the
stream, kept still among the stars; ``A = C_in0_ib0`` is constant. Both are in units of gravity.

Source: `rocking-base`, section 1.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from northfinder.alignment.methods import Form
from northfinder.alignment.pairs import FloatArray
from northfinder.earth import EARTH_RATE_RAD_S

#: Corner of the paper's low-pass, a Butterworth of second order: passband 0.005 Hz, stop 0.1 Hz.
CORNER_HZ = 0.00701
_LONGEST_S = 0.02  # of an observation: increments within are summed, whatever the sensor's rate


def reaction_to_gravity(latitude_rad: float, begin_s: ArrayLike, end_s: ArrayLike) -> FloatArray:
    """Return ``-g/|g|`` in in0, the mean over intervals: what a resting accelerometer feels.

    ``[cosL sin(wt), sinL cosL (1 - cos wt), 1 - cos^2 L (1 - cos wt)]``, w the Earth's rate.

    Args:
        latitude_rad: Geodetic, positive north.
        begin_s: Of each interval, since the beginning of the stream, ``(k,)``.
        end_s: Its end, same shape.

    Returns:
        ``(k, 3)``, East, North, Up of n at the beginning.
    """
    begin, end = np.asarray(begin_s, dtype=np.float64), np.asarray(end_s, dtype=np.float64)
    middle = 0.5 * EARTH_RATE_RAD_S * (begin + end)
    half = 0.5 * EARTH_RATE_RAD_S * (end - begin)
    mean = np.sinc(half / np.pi)  # of a tone over its mid value
    versed = 2.0 * mean * np.sin(0.5 * middle) ** 2 + (1.0 - mean)
    cos, sin = math.cos(latitude_rad), math.sin(latitude_rad)
    rows = [cos * mean * np.sin(middle), sin * cos * versed, 1.0 - cos * cos * versed]
    return np.stack(rows, axis=-1)


def increments_in_observation(dt: float) -> int:
    """Return how many sampling periods one observation sums: at most 0.02 s, at least one."""
    return max(1, math.floor(_LONGEST_S / dt + 1e-9))


class Observations:
    """Brings pairs into the form that the fit is to see, chunk by chunk.

    ``low-passed`` puts W and V through the same filter, both from zero state: W = A V then stays
    exact, while V alone left as it is would cost 380" of level.

    Args:
        form: ``raw``, ``velocity`` (summed up from the beginning of the fit) or ``low-passed``.
        period_s: Between observations, s.
    """

    def __init__(self, form: Form, period_s: float) -> None:
        self._form = form
        self._sum = np.zeros(6)
        if form == "low-passed":
            self._sections = low_pass(period_s)
            self._state = np.zeros((len(self._sections), 2, 6))

    def add(self, W: FloatArray, V: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return W and V of the next observations ``(k, 3)`` in that form."""
        both = np.hstack([W, V])
        if self._form == "velocity":
            both = self._sum + np.cumsum(both, axis=0)
            self._sum = both[-1]
        elif self._form == "low-passed":
            from scipy.signal import sosfilt  # noqa: PLC0415 -- see low_pass

            both, self._state = sosfilt(self._sections, both, axis=0, zi=self._state)
        return both[:, :3], both[:, 3:]


def low_pass(period_s: float) -> FloatArray:
    """Return the paper's low-pass as second-order sections, ``(1, 6)``."""
    from scipy.signal import butter  # noqa: PLC0415 -- 0.6 s, which no other command should wait

    sections: FloatArray = butter(2, CORNER_HZ, fs=1.0 / period_s, output="sos")
    return sections


def low_passed(rows: FloatArray, period_s: float) -> FloatArray:
    """Return rows ``(b, n)`` through that low-pass, from zero state."""
    from scipy.signal import sosfilt  # noqa: PLC0415 -- as above

    return np.asarray(sosfilt(low_pass(period_s), rows, axis=1), dtype=np.float64)
