"""Sums of tones in six degrees of freedom: value and two derivatives in one product."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from drivers.interfaces import FloatArray
from sim.base_settings import STANDARD_GRAVITY_M_S2, RockingSettings

_SCATTER = 0.1
_SWAY_TONES = 6


class Tones:
    """``Re sum_n c_n exp(i omega_n t)``: yaw, pitch, roll (rad), then East, North, Up (m).

    Args:
        omega_rad_s: Of each tone, ``(n,)``.
        amplitude: Complex, ``(n, 6)``.
    """

    def __init__(self, omega_rad_s: FloatArray, amplitude: NDArray[np.complex128]) -> None:
        self._omega_rad_s = omega_rad_s
        turning = 1j * omega_rad_s[:, np.newaxis]
        orders = np.hstack([amplitude, turning * amplitude, turning**2 * amplitude])
        self._mix = np.vstack([orders.real, -orders.imag])

    @property
    def highest_rad_s(self) -> float:
        """Return the highest tone's rate."""
        return float(self._omega_rad_s.max())

    def motion(self, time_s: FloatArray) -> FloatArray:
        """Return value, first and second derivative, ``(3, k, 6)``."""
        phase = np.multiply.outer(time_s, self._omega_rad_s)
        parts = np.hstack([np.cos(phase), np.sin(phase)]) @ self._mix
        return np.moveaxis(parts.reshape(len(time_s), 3, 6), 1, 0)


def draw_tones(settings: RockingSettings) -> Tones:
    """Draw what the settings leave open: every phase, the sway's tones, the swings' scatter."""
    random = np.random.default_rng(settings.seed)
    swings = _swings(settings, random)
    sway = _sway(settings, random)
    engine = _engine(settings, random)
    drawn = [*swings, *sway, *engine]
    return Tones(np.array([omega for omega, _ in drawn]), np.array([row for _, row in drawn]))


_Drawn = list[tuple[float, NDArray[np.complex128]]]


def _swings(settings: RockingSettings, random: Generator) -> _Drawn:
    drawn = []
    for column, swing in enumerate((settings.yaw, settings.pitch, settings.roll)):
        stronger, faster = random.uniform(1.0 - _SCATTER, 1.0 + _SCATTER, size=2)
        row = np.zeros(6, dtype=np.complex128)
        row[column] = stronger * swing.amplitude_rad * _phases(random, 1)[0]
        drawn.append((2.0 * np.pi * faster * swing.frequency_hz, row))
    return drawn


def _sway(settings: RockingSettings, random: Generator) -> _Drawn:
    """Six equal tones along East and along North, whose accelerations have the rms together."""
    strength = settings.sway_rms_g * STANDARD_GRAVITY_M_S2 * np.sqrt(2.0 / _SWAY_TONES)
    drawn = []
    for column in (3, 4):
        omegas = 2.0 * np.pi * random.uniform(*settings.sway_band_hz, size=_SWAY_TONES)
        for omega, phase in zip(omegas, _phases(random, _SWAY_TONES), strict=True):
            row = np.zeros(6, dtype=np.complex128)
            row[column] = phase * strength / omega**2
            drawn.append((float(omega), row))
    return drawn


def _engine(settings: RockingSettings, random: Generator) -> _Drawn:
    drawn = []
    for order in settings.engine:
        omega = 2.0 * np.pi * order.frequency_hz
        moved_m = order.acceleration_m_s2 / omega**2
        amplitude = np.repeat([order.angle_rad, moved_m], 3)
        drawn.append((omega, amplitude * _phases(random, 6)))
    return drawn


def _phases(random: Generator, count: int) -> NDArray[np.complex128]:
    unit: NDArray[np.complex128] = np.exp(1j * random.uniform(0.0, 2.0 * np.pi, size=count))
    return unit
