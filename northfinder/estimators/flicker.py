"""Bias instability: how a flicker of the bias couples the visits of a revolution."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import xlogy

from northfinder.estimators.arrays import FloatArray, as_finite


def flicker_covariance(
    start_s: ArrayLike, duration_s: ArrayLike, bias_instability: float
) -> FloatArray:
    """Covariance between the means over n windows under flicker noise, up to a constant.

    IEEE Std 952's bias instability B has the two-sided density ``B^2 / (2 pi f)``: an Allan
    deviation flat at ``B sqrt(2 ln 2 / pi)`` = 0.664 B, and the autocovariance
    ``-B^2/pi ln|t|`` plus a constant that diverges. The constant is common to all elements, so
    a combination whose weights sum to zero (a and b: R is fitted) never sees it. With
    F'' = ln, F(x) = x^2/2 ln|x| - 3 x^2/4, and windows [s, e]:

        K_ij = -B^2/pi [F(e_i - s_j) - F(s_i - s_j) - F(e_i - e_j) + F(s_i - e_j)] / (w_i w_j)

    Args:
        start_s: Start of each window, shape ``(n,)``.
        duration_s: Its length w, scalar or ``(n,)``.
        bias_instability: B, in the unit of the readings.

    Returns:
        Covariance in the unit of B squared, ``(n, n)``.

    Raises:
        ValueError: A window has no length, or a number is not finite.
    """
    start = as_finite("start_s", start_s)
    duration = np.broadcast_to(as_finite("duration_s", duration_s), start.shape)
    if not np.all(duration > 0.0):
        msg = f"every visit needs a positive duration; the shortest is {duration.min():g} s"
        raise ValueError(msg)
    end = start + duration
    across = _twice_integrated_log(np.subtract.outer(end, start))  # F is even
    coupling = (
        across
        + across.T
        - _twice_integrated_log(np.subtract.outer(start, start))
        - _twice_integrated_log(np.subtract.outer(end, end))
    )
    covariance: FloatArray = (
        -(bias_instability**2) / np.pi * coupling / np.multiply.outer(duration, duration)
    )
    return covariance


def _twice_integrated_log(x: FloatArray) -> FloatArray:
    value: FloatArray = 0.5 * xlogy(x * x, np.abs(x)) - 0.75 * x * x
    return value
