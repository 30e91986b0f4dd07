"""Coloured noise of a gyro: how white noise, flicker and random walk couple the visits of a run.

The three figures are those of IEEE Std 952, as a noise run measures them. They are what
generalised least squares (Aitken 1935) needs to weigh the visits by.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.arrays import FloatArray, as_finite
from northfinder.estimators.flicker import flicker_covariance


@dataclass(frozen=True, slots=True)
class SlowNoise:
    """What averaging does not see of a gyro's noise.

    Attributes:
        bias_instability_rad_s: B, the Allan deviation is flat at 0.664 B.
        rate_random_walk_rad_s_sqrt_s: K, the bias walks by K sqrt(T).
    """

    bias_instability_rad_s: float = 0.0
    rate_random_walk_rad_s_sqrt_s: float = 0.0

    @property
    def any(self) -> bool:
        """Whether there is some."""
        return self.bias_instability_rad_s > 0.0 or self.rate_random_walk_rad_s_sqrt_s > 0.0

    def covariances(self, start_s: ArrayLike, duration_s: ArrayLike) -> dict[str, FloatArray]:
        """Return the covariance between visits by source, each up to a constant, ``(n, n)``.

        Args:
            start_s: Start of each visit, ``(n,)``.
            duration_s: Its length, scalar or ``(n,)``.

        Raises:
            ValueError: A visit has no length, or a number is not finite.
        """
        parts = {}
        if self.bias_instability_rad_s > 0.0:
            flicker = flicker_covariance(start_s, duration_s, self.bias_instability_rad_s)
            parts["bias instability"] = flicker
        if self.rate_random_walk_rad_s_sqrt_s > 0.0:
            walk = walk_covariance(start_s, duration_s, self.rate_random_walk_rad_s_sqrt_s)
            parts["rate random walk"] = walk
        return parts


def walk_covariance(start_s: ArrayLike, duration_s: ArrayLike, strength: float) -> FloatArray:
    """Covariance between the means over n windows of a random walk, up to a constant.

    A walk of variance ``K^2 t`` has the covariance ``K^2 min(t, t')``. Between windows apart,
    that is the middle of the earlier one; within one of length w, its middle less ``w/6``.

    Args:
        start_s: Start of each window, ``(n,)``; windows do not overlap.
        duration_s: Its length w, scalar or ``(n,)``.
        strength: K, in the readings' unit per root second.

    Raises:
        ValueError: A number is not finite.
    """
    start = as_finite("start_s", start_s)
    duration = np.broadcast_to(as_finite("duration_s", duration_s), start.shape)
    middle = start - start.min() + duration / 2.0
    apart: FloatArray = np.minimum.outer(middle, middle) - np.diag(duration / 6.0)
    return strength**2 * apart
