"""How well an Allan deviation is known: the kind of noise, its degrees of freedom, the band.

Sources: NIST SP 1065 (Riley 2008), section 5.3.1 (chi-square intervals), table 5 (degrees of
freedom of the overlapping estimator) and section 5.5.6 (lag-1 autocorrelation).
"""

import numpy as np
from scipy.special import chdtri

from northfinder.estimators.arrays import FloatArray, IntArray

_FEWEST_AVERAGES = 30  # the identification's own limit
_MOST_AVERAGES = 100_000  # more of them would not make the kind any clearer
_WHITEST = 0.25  # a lag-1 measure below it needs no further difference


def identify_noise(angle: FloatArray, factors: IntArray) -> IntArray:
    """Exponent of the rate's spectrum at each averaging factor, from 2 to -2, ``(t,)``.

    The averages over m samples are differenced until their lag-1 autocorrelation r says that
    they are nearly white; with ``rho = r / (1 + r)`` and d differences the exponent is
    ``-2 (rho + d)``, rounded (SP 1065, 5.5.6). Longer taus than those with 30 averages are taken
    to be of the last kind that could be told. One misreading in thirty averages is no rarity and
    makes a band twice too narrow: the median of three neighbouring taus is taken, and a rate that
    was white at a shorter tau has no white angle at a longer one.

    Args:
        angle: Integral of the rate from 0 on, ``(k + 1,)``.
        factors: Ascending, ``(t,)``.
    """
    kinds: list[int] = []
    for m in factors.tolist():
        averages = np.diff(angle[:: int(m)][:_MOST_AVERAGES])
        if len(averages) < _FEWEST_AVERAGES and kinds:
            kinds.append(_median(kinds[-3:]))
        else:
            kinds.append(min(_exponent(averages), 0 if 0 in kinds else 2))
    return np.array([_median(kinds[max(0, k - 2) : k + 1]) for k in range(len(kinds))])


def _median(kinds: list[int]) -> int:
    """Return the middle one; of two the redder, whose band is the wider."""
    return sorted(kinds)[(len(kinds) - 1) // 2]


def _exponent(averages: FloatArray) -> int:
    time = np.linspace(-1.0, 1.0, len(averages))
    left = averages - averages.mean()
    left = left - time * (time @ left) / (time @ time)  # a drift is no noise
    differences = 0
    rho = _lag_one(left)
    while rho >= _WHITEST and differences < 1:
        left, differences = np.diff(left), differences + 1
        rho = _lag_one(left)
    return int(np.clip(-2 * differences - round(2.0 * rho), -2, 2))


def _lag_one(values: FloatArray) -> float:
    left = values - values.mean()
    power = float(left @ left)
    r = float(left[1:] @ left[:-1]) / power if power > 0.0 else 0.0
    return r / (1.0 + r)


def degrees_of_freedom(points: int, factors: IntArray, noise: IntArray) -> FloatArray:
    """Equivalent degrees of freedom of the overlapping estimator (SP 1065, table 5), ``(t,)``.

    Args:
        points: Samples of the angle: one more than of the rate.
        factors: Averaging factors m, ``(t,)``.
        noise: Exponents, ``(t,)``.
    """
    n, m = float(points), factors.astype(np.float64)
    half = (2.0 * m + 1.0) * (n - 1.0) / 4.0
    flicker = np.where(
        m == 1.0,
        2.0 * (n - 2.0) ** 2 / (2.3 * n - 4.9),
        5.0 * n**2 / (4.0 * m * (n + 3.0 * m)),
    )
    by_kind = {
        2: (n + 1.0) * (n - 2.0 * m) / (2.0 * (n - m)),
        1: np.exp(np.sqrt(np.log(np.maximum((n - 1.0) / (2.0 * m), 1.0)) * np.log(half))),
        0: (1.5 * (n - 1.0) / m - 2.0 * (n - 2.0) / n) * 4.0 * m**2 / (4.0 * m**2 + 5.0),
        -1: flicker,
        -2: (n - 2.0) / m * ((n - 1.0) ** 2 - 3.0 * m * (n - 1.0) + 4.0 * m**2) / (n - 3.0) ** 2,
    }
    edf = np.select([noise == kind for kind in by_kind], list(by_kind.values()))
    least: FloatArray = np.maximum(edf, 1.0)  # at half the record one difference is left
    return least


def confidence_band(deviation: FloatArray, edf: FloatArray, confidence: float) -> FloatArray:
    """Limits of the true deviation, ``s sqrt(edf / chi2)`` (SP 1065, 5.3.1), ``(t, 2)``."""
    tail = 0.5 * (1.0 - confidence)
    chi2 = np.stack([chdtri(edf, tail), chdtri(edf, 1.0 - tail)], axis=-1)
    band: FloatArray = deviation[:, np.newaxis] * np.sqrt(edf[:, np.newaxis] / chi2)
    return band
