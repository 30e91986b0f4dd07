"""The noise of the visits' means: white and flicker in one, and the bound that it sets."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.random import Generator

from northfinder.campaign.settings import Campaign
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.flicker import flicker_covariance
from northfinder.units import DEG_PER_HOUR, DEG_PER_SQRT_HOUR


@dataclass(frozen=True, slots=True, eq=False)
class VisitNoise:
    """Gaussian noise of n visits' means, shared by all seeks.

    Attributes:
        covariance: In the square of the readings' unit, ``(n, n)``.
        factor: Its Cholesky factor; the diagonal of it, ``(n,)``, where the noise is white.
    """

    covariance: FloatArray
    factor: FloatArray

    @classmethod
    def white(cls, sigma: FloatArray) -> Self:
        """Take independent readings with the given sigma, ``(n,)``."""
        return cls(np.diag(sigma**2), sigma)

    @classmethod
    def flickering(cls, sigma: FloatArray, flicker: FloatArray) -> Self:
        """Add a flicker, given by its covariance up to a constant, ``(n, n)``.

        Flicker has no mean: its covariance holds for combinations whose weights sum to zero. So
        the mean over the visits is taken out; the fitted bias R would take it up anyway.
        """
        count = len(sigma)
        contrasts = np.eye(count) - 1.0 / count
        covariance = np.diag(sigma**2) + contrasts @ flicker @ contrasts
        return cls(covariance, np.linalg.cholesky(covariance).astype(np.float64))

    def draw(self, random: Generator, count: int) -> FloatArray:
        """Draw the noise of ``count`` seeks, ``(count, n)``."""
        unit = random.standard_normal((count, len(self.covariance)))
        if self.factor.ndim == 1:
            unit *= self.factor
            return unit
        drawn: FloatArray = unit @ self.factor.T
        return drawn

    def bound(self, matrix: FloatArray) -> FloatArray:
        """Return the Cramer-Rao bound of a linear model's parameters, ``(H' C^-1 H)^-1``.

        Args:
            matrix: H, ``(n, p)``; its columns are nuisances as well as what is wanted.
        """
        whitened = np.linalg.solve(np.linalg.cholesky(self.covariance), matrix)
        return np.linalg.inv(whitened.T @ whitened)


def gyro_noise(campaign: Campaign) -> VisitNoise:
    """Return the gyro's noise as it is simulated, rad/s."""
    simulated = campaign.rig.simulation
    dwell_s = campaign.dwell_s
    sigma = simulated.gyro_noise_deg_sqrt_h * DEG_PER_SQRT_HOUR / np.sqrt(dwell_s)
    instability = simulated.gyro_bias_instability_deg_h * DEG_PER_HOUR
    if instability == 0.0:
        return VisitNoise.white(sigma)
    return VisitNoise.flickering(
        sigma, flicker_covariance(campaign.middle_s - dwell_s / 2.0, dwell_s, instability)
    )


def accelerometer_noise(campaign: Campaign) -> VisitNoise:
    """Return the accelerometer's noise as it is simulated, standard gravities."""
    return VisitNoise.white(
        campaign.rig.simulation.accel_noise_g_sqrt_hz / np.sqrt(campaign.dwell_s)
    )
