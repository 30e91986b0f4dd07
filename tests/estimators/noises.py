"""Noises of a rate by construction, each sample the mean over its period; one axis."""

import numpy as np
from numpy.random import Generator

from northfinder.estimators.arrays import FloatArray


def white(samples: int, period_s: float, strength: float, random: Generator) -> FloatArray:
    """Return angle random walk N: the mean over T seconds has sigma ``N / sqrt(T)``."""
    noise: FloatArray = strength / np.sqrt(period_s) * random.standard_normal(samples)
    return noise


def quantisation(samples: int, period_s: float, strength: float, random: Generator) -> FloatArray:
    """Return the differences of an angle that is white, sigma Q."""
    noise: FloatArray = strength / period_s * np.diff(random.standard_normal(samples + 1))
    return noise


def walk(samples: int, period_s: float, strength: float, random: Generator) -> FloatArray:
    """Return the means of a Brownian motion; between its ends each is a bridge's."""
    step, bridge = random.standard_normal((2, samples))
    means: FloatArray = np.cumsum(step) - 0.5 * step + bridge / np.sqrt(12.0)
    means *= strength * np.sqrt(period_s)
    return means


def flicker(samples: int, period_s: float, strength: float, random: Generator) -> FloatArray:
    """Return noise of the two-sided density ``B^2 / (2 pi f)``, a part of a four times longer one.

    What the density has above half the sampling rate is folded in, ten times over.
    """
    longer = 4 * samples
    frequency_hz = np.fft.rfftfreq(longer, period_s)
    density = np.zeros_like(frequency_hz)
    for fold in range(-10, 11):
        aliased_hz = np.abs(frequency_hz + fold / period_s)
        seen = np.sinc(aliased_hz * period_s) ** 2
        density += np.divide(seen, aliased_hz, out=np.zeros_like(seen), where=aliased_hz > 0.0)
    density *= strength**2 / (2.0 * np.pi)
    parts = random.standard_normal((2, len(density))) / np.sqrt(2.0)
    spectrum = (parts[0] + 1j * parts[1]) * np.sqrt(density * longer / period_s)
    return np.fft.irfft(spectrum, longer)[:samples]
