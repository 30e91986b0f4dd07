"""How likely a record is under four noises together: what a fit of Allan variances only resembles.

Neighbouring Allan deviations come from the same samples: no weights make their squares
independent. Differences of neighbouring halves are nearly so at different scales, and the record's
64 to 127 bins have a covariance that is known exactly: at the short scales Haar's Allan variance
with its chi-square, at the long ones the normal likelihood of the bins with their line taken out
(restricted maximum likelihood: a drift cannot pass for noise, nor noise that is lost with the
line go missing).
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from northfinder.errors import EstimationError
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.flicker import flicker_covariance

QUANTISATION, WHITE, FLICKER, WALK = range(4)
FLOOR = 2.0 * math.log(2.0) / math.pi  # Allan variance of flicker over B^2 (IEEE Std 952)
_FEWEST_BINS = 64
_COUNTED = 0.5  # of the differences at a scale: under random walk the scales are not independent
_MOST_TERMS = 5000.0  # of a scale: no model of a real gyro is trusted to better than 1 %
_ROUNDING = 1e-12
_CLOSE = 1e-6  # in log likelihood
_HALVINGS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Likelihood:
    """Of the four shares of the Allan variance at the length of a bin, ``(4,)``, in ``unit^2``.

    Attributes:
        bin_s: Length of a bin.
        unit: What the rates were divided by.
        bins: Their mean rates without the least-squares line, in that unit, ``(m,)``.
        rising: That line, unit a bin.
        covariances: Of the bins under unit shares; of flicker up to a constant, ``(4, m, m)``.
        free: The bins apart from level and line, ``(m - 2,)``.
        shapes: Covariances of those, ``(4, m - 2, m - 2)``.
        scales: Allan variance of each noise at each shorter scale under unit shares, ``(4, s)``.
        variances: Measured there, ``(s,)``.
        terms: Behind each, ``(s,)``.
    """

    bin_s: float
    unit: float
    bins: FloatArray
    rising: float
    covariances: FloatArray
    free: FloatArray
    shapes: FloatArray
    scales: FloatArray
    variances: FloatArray
    terms: FloatArray

    def start(self) -> FloatArray:
        """Return shares to climb from: each noise a quarter of the most that it could be."""
        most = self.variances[:, np.newaxis] / self.scales.T
        start: FloatArray = 0.25 * most.min(axis=0, initial=1.0)
        return start

    def about_a_level(self, bins: FloatArray) -> "Likelihood":
        """Return that of bins whose line, but not whose level, is to be explained by noise."""
        apart = _apart_from(np.ones((len(bins), 1)))
        shapes = apart.T @ self.covariances @ apart
        return replace(self, bins=bins, free=apart.T @ bins, shapes=shapes)

    def log(self, share: FloatArray) -> float:
        """Logarithm of the likelihood, up to a constant, of shares that are not all zero."""
        expected, covariance = share @ self.scales, np.tensordot(share, self.shapes, 1)
        log_det = np.linalg.slogdet(covariance)[1]
        misfit = self.free @ np.linalg.solve(covariance, self.free)
        short = self.terms @ (np.log(expected) + self.variances / expected)
        return -0.5 * float(log_det + misfit + short)

    def slope(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the logarithm by the shares, and Fisher's information, ``(4, 4)``."""
        inverse = np.linalg.inv(np.tensordot(share, self.shapes, 1))
        pulled = inverse @ self.free
        turned = inverse @ self.shapes
        ratio = self.scales / (share @ self.scales)
        excess = self.variances / (share @ self.scales) - 1.0
        fit = np.einsum("i,kij,j->k", pulled, self.shapes, pulled)
        slope = 0.5 * (fit - np.trace(turned, axis1=1, axis2=2) + ratio @ (self.terms * excess))
        information = 0.5 * np.einsum("kij,lji->kl", turned, turned, optimize=True)
        return slope, information + 0.5 * (self.terms * ratio) @ ratio.T

    def deviance(self, share: FloatArray) -> float:
        """How far the shorter scales lie from the model, about a chi-square of their number."""
        ratio = self.variances / (share @ self.scales)
        return float(self.terms @ (ratio - 1.0 - np.log(ratio)))


def likelihood_of(rate: FloatArray, period_s: float) -> Likelihood:
    """Sort a record's information by scale: Haar differences of halves, then bins.

    Raises:
        EstimationError: The bins do not vary but along a line.
    """
    octaves = max(0, int(np.log2(len(rate) / _FEWEST_BINS)))
    bins = len(rate) >> octaves
    averages = rate[: bins << octaves] - rate[: bins << octaves].mean()
    rising, averages = _without_line(averages)
    variances, terms = [], []
    for _ in range(octaves):
        halves = averages.reshape(-1, 2)
        variances.append(0.5 * float(np.mean((halves[:, 1] - halves[:, 0]) ** 2)))
        terms.append(min(_COUNTED * len(halves), _MOST_TERMS))
        averages = halves.mean(axis=1)
    unit = float(np.sqrt(0.5 * np.mean(np.diff(averages) ** 2)))
    if not unit > _ROUNDING * np.abs(rate).max():
        msg = (
            f"the {len(rate)} samples, {rate[0]:g} rad/s at first, lie on a line: there is no "
            "noise to fit; check that the sensor measures and that its resolution is fine enough"
        )
        raise EstimationError(msg)
    covariances = _covariances(bins)
    apart = _apart_from(np.vander(np.linspace(-1.0, 1.0, bins), 2))
    shorter = 2.0 ** (np.arange(octaves) - octaves)
    return Likelihood(
        period_s * 2**octaves,
        unit,
        averages / unit,
        rising * 2**octaves / unit,
        covariances,
        apart.T @ averages / unit,
        apart.T @ covariances @ apart,
        shorter ** np.array([[-2.0], [-1.0], [0.0], [1.0]]),
        np.array(variances) / unit**2,
        np.array(terms),
    )


def _apart_from(design: FloatArray) -> FloatArray:
    """Orthonormal directions that a design cannot reach, ``(m, m - p)``."""
    apart: FloatArray = np.linalg.qr(design, mode="complete")[0][:, design.shape[1] :]
    return apart


def _without_line(values: FloatArray) -> tuple[float, FloatArray]:
    """Return the least-squares slope a sample of values about zero, and what it leaves."""
    index = np.arange(len(values)) - 0.5 * (len(values) - 1)
    slope = float(index @ values) / float(index @ index)
    return slope, values - slope * index


def _covariances(bins: int) -> FloatArray:
    """Of bin means whose Allan variance at one bin is 1, ``(4, m, m)``."""
    index = np.arange(bins, dtype=np.float64)
    same = np.eye(bins)
    beside = np.abs(np.subtract.outer(index, index)) == 1.0
    flicker = flicker_covariance(index, 1.0, 1.0 / np.sqrt(FLOOR))
    walk = 3.0 * (np.minimum.outer(index, index) + 0.5 - same / 6.0)
    return np.stack([(2.0 * same - beside) / 3.0, same, flicker, walk])


def maximise(
    likelihood: Likelihood, start: FloatArray, fixed: int | None = None
) -> tuple[FloatArray, float]:
    """Climb to the most likely shares, none negative, by Fisher's scoring; one may be held."""
    share, log, free = start, likelihood.log(start), np.arange(4) != fixed
    while True:
        aim = share.copy()
        aim[free] = _summit(share, *likelihood.slope(share), free)
        gained = 0.0
        for halvings in range(_HALVINGS):
            tried = share + 0.5**halvings * (aim - share)
            gained = likelihood.log(tried) - log
            if gained > 0.0:
                share, log = tried, log + gained
                break
        if gained < _CLOSE:
            return share, log


def _summit(
    share: FloatArray, slope: FloatArray, information: FloatArray, free: NDArray[np.bool_]
) -> FloatArray:
    """Free shares at the top of the parabola that the likelihood looks like, none negative."""
    from scipy.optimize import nnls  # noqa: PLC0415 -- 0.3 s, which no other command should wait

    scale = 1.0 / np.sqrt(np.diag(information)[free])
    curved = information[np.ix_(free, free)] * np.multiply.outer(scale, scale)
    towards = scale * slope[free] + curved @ (share[free] / scale)
    root = np.linalg.cholesky(curved + _ROUNDING * np.eye(len(scale)))
    summit: FloatArray = scale * nnls(root.T, np.linalg.solve(root, towards))[0]
    return summit
