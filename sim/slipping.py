"""A plate that slips on its motor: the encoder says that it is there, and it is not."""

import numpy as np

from drivers.interfaces import FloatArray

_LASTS_S = 0.05  # as quick as a gyro can follow
_REMEMBERED = 16  # slips; sensors ask about the last burst only


class Slipping:
    """How far the plate has turned on its motor, and when."""

    def __init__(self) -> None:
        self._before_rad = 0.0
        self._start_s: list[float] = []
        self._angle_rad: list[float] = []

    @property
    def total_rad(self) -> float:
        """Return how far it has slipped in all, once the last slip is over."""
        return self._before_rad + sum(self._angle_rad)

    @property
    def end_s(self) -> float:
        """Return the loop time at which the last slip is over."""
        return self._start_s[-1] + _LASTS_S if self._start_s else -np.inf

    def slip_by(self, angle_rad: float, now_s: float) -> None:
        """Slip by so much from now on, counter-clockwise, at an even rate."""
        while len(self._start_s) > _REMEMBERED:
            self._start_s.pop(0)
            self._before_rad += self._angle_rad.pop(0)
        self._start_s.append(now_s)
        self._angle_rad.append(angle_rad)

    def slipped_rad(self, time_s: FloatArray) -> FloatArray:
        """Return how far it had slipped at each time, of the shape of the times."""
        slipped: FloatArray = np.full(np.shape(time_s), self._before_rad)
        for start_s, angle_rad in zip(self._start_s, self._angle_rad, strict=True):
            slipped += angle_rad * np.clip((time_s - start_s) / _LASTS_S, 0.0, 1.0)
        return slipped
