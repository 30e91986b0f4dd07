"""A gyro's noise in figures: what a static record told, and what it could not.

Model, IEEE Std 952 annex C: Allan variance ``3 Q^2/tau^2 + N^2/tau + (2 ln 2/pi) B^2 + K^2 tau/3``
of quantisation Q, angle random walk N, bias instability B and rate random walk K; a drift R adds
``R^2 tau^2 / 2``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.allan_likelihood import FLOOR
from northfinder.estimators.arrays import FloatArray
from northfinder.units import DEG, DEG_PER_HOUR, HOUR

_DRIFT_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class NoiseFigure:
    """One figure with its 95 % interval.

    Attributes:
        value: None where this record does not show it.
        lower: Lower end; 0 where not seen.
        upper: Upper end; where not seen, the bound that it stays below with 95 % confidence.
    """

    value: float | None
    lower: float
    upper: float

    @property
    def seen(self) -> bool:
        """Whether zero lies outside the interval."""
        return self.value is not None


@dataclass(frozen=True, slots=True)
class Drift:
    """A line in the record.

    Attributes:
        value_rad_s2: By generalised least squares.
        sigma_rad_s2: Under the fitted noise, what of it looks like a line included.
        sigmas: Square root of twice the log likelihood that is lost where there is no drift and
            random walk may stand for it: what the record holds against that.
    """

    value_rad_s2: float
    sigma_rad_s2: float
    sigmas: float

    @property
    def seen(self) -> bool:
        """Whether random walk is 3 sigma short of explaining it."""
        return self.sigmas > _DRIFT_SIGMAS


@dataclass(frozen=True, slots=True)
class NoiseFit:
    """The figures of one axis.

    Attributes:
        angle_random_walk_rad_sqrt_s: N: the mean over T seconds has sigma ``N / sqrt(T)``, rad/s.
        bias_instability_rad_s: B: the Allan deviation is flat at 0.664 B.
        rate_random_walk_rad_s_sqrt_s: K: the rate walks by ``K sqrt(T)``.
        quantisation_rad: Q.
        drift: The line that was taken out before.
        deviance: Of the scales below a bin from the model; about a chi-square of ``dof``.
        dof: Number of those scales.
        bin_s: The longest scale of those.
        duration_s: Of the record.
    """

    angle_random_walk_rad_sqrt_s: NoiseFigure
    bias_instability_rad_s: NoiseFigure
    rate_random_walk_rad_s_sqrt_s: NoiseFigure
    quantisation_rad: NoiseFigure
    drift: Drift
    deviance: float
    dof: int
    bin_s: float
    duration_s: float

    def deviation(self, tau_s: ArrayLike) -> FloatArray:
        """Allan deviation of the figures that were seen, drift included, rad/s."""
        tau = np.asarray(tau_s, dtype=np.float64)
        quantisation = 3.0 * _square(self.quantisation_rad) / tau**2
        white = _square(self.angle_random_walk_rad_sqrt_s) / tau
        flicker = FLOOR * _square(self.bias_instability_rad_s)
        walk = _square(self.rate_random_walk_rad_s_sqrt_s) * tau / 3.0
        line = self.drift.value_rad_s2 if self.drift.seen else 0.0
        deviation: FloatArray = np.sqrt(
            quantisation + white + flicker + walk + 0.5 * (line * tau) ** 2
        )
        return deviation

    def remarks(self) -> tuple[str, ...]:
        """Sentences for whoever reads the figures: what was not seen, and a drift."""
        said = [
            f"{name}: not seen in this record of {self.duration_s:.0f} s; below "
            f"{figure.upper / unit:.2g} {unit_name} (95 %)"
            for name, figure, unit, unit_name in (
                ("angle random walk", self.angle_random_walk_rad_sqrt_s, DEG / 60.0, "deg/sqrt(h)"),
                ("bias instability", self.bias_instability_rad_s, DEG_PER_HOUR, "deg/h"),
                (
                    "rate random walk",
                    self.rate_random_walk_rad_s_sqrt_s,
                    DEG_PER_HOUR / 60.0,
                    "deg/h/sqrt(h)",
                ),
                ("quantisation", self.quantisation_rad, DEG / 3600.0, "arc seconds"),
            )
            if not figure.seen
        ]
        if self.drift.seen:
            per_hour = self.drift.value_rad_s2 * HOUR / DEG_PER_HOUR
            said.append(
                f"the rate drifts by {per_hour:.2g} deg/h in an hour: the Allan deviation rises "
                "with that times tau / sqrt(2) at long tau, which is not rate random walk"
            )
        return tuple(said)


def _square(figure: NoiseFigure) -> float:
    return 0.0 if figure.value is None else figure.value**2
