"""How a heading and a level went, moment by moment, from whatever a record has of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from northfinder.estimators.arrays import FloatArray

Estimates = Sequence[Mapping[str, Any]]

_SETTLED: Final = 10.0  # times as uncertain as the last moment, at most
_COLUMNS: Final = ("time_s", "azimuth_deg", "azimuth_sigma_deg", "pitch_deg", "roll_deg")


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """Moments in time order, ``(n,)`` each; since it last began, where an alignment began anew.

    Attributes:
        time_s: Since the beginning.
        azimuth_deg: Of the index mark, without the leap at north; the last lies in [0, 360).
        azimuth_sigma_deg: One standard deviation.
        pitch_deg: Elevation of the index mark.
        roll_deg: About it, right side down.
        level_sigma_deg: One standard deviation of pitch and roll; NaN where none is stated.
    """

    time_s: FloatArray
    azimuth_deg: FloatArray
    azimuth_sigma_deg: FloatArray
    pitch_deg: FloatArray
    roll_deg: FloatArray
    level_sigma_deg: FloatArray

    @classmethod
    def of(cls, result: Mapping[str, Any], estimates: Estimates) -> Self:
        """Read it from a result; of a run without one, from what it told on the way.

        Args:
            result: With its ``history``, or without.
            estimates: Data of the run's ``estimate`` events in time order.
        """
        lately = _since_it_began(estimates)
        rows = {key: [moment[key] for moment in lately] for key in _COLUMNS}
        columns = {
            key: np.array(values, dtype=np.float64)
            for key, values in result.get("history", rows).items()
        }
        columns["azimuth_deg"] = _without_leaps(columns["azimuth_deg"])
        level_sigma_deg = _level_sigma_deg(columns["time_s"], lately)
        if "level_sigma_deg" in result:
            level_sigma_deg[-1] = result["level_sigma_deg"]
        return cls(**columns, level_sigma_deg=level_sigma_deg)

    @property
    def settled(self) -> NDArray[np.bool_]:
        """Say which moments a scale is for: the first of an alignment know next to nothing."""
        sigma_deg = self.azimuth_sigma_deg
        settled: NDArray[np.bool_] = sigma_deg <= _SETTLED * sigma_deg[-1]
        return settled


def _since_it_began(estimates: Estimates) -> Estimates:
    """Leave out what an alignment told before a gap after which it began anew."""
    times_s = [moment["time_s"] for moment in estimates]
    begins = [n for n in range(1, len(times_s)) if times_s[n] <= times_s[n - 1]]
    return estimates[begins[-1] :] if begins else estimates


def _without_leaps(azimuth_deg: FloatArray) -> FloatArray:
    whole: FloatArray = np.unwrap(azimuth_deg, period=360.0)
    whole += azimuth_deg[-1] - whole[-1]
    return whole


def _level_sigma_deg(time_s: FloatArray, estimates: Estimates) -> FloatArray:
    stated = [moment for moment in estimates if "level_sigma_deg" in moment]
    if not stated:
        return np.full(len(time_s), np.nan)
    at_s = [moment["time_s"] for moment in stated]
    sigma_deg = [moment["level_sigma_deg"] for moment in stated]
    interpolated: FloatArray = np.interp(time_s, at_s, sigma_deg)
    return interpolated
