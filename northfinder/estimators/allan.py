"""Overlapping Allan deviation of a rate record: one curve that shows a gyro's noise by kind.

Source: NIST SP 1065 (Riley 2008), eq 11, over the integral of the rate; IEEE Std 952, annex C, for
what a gyro's curve means.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.allan_confidence import (
    confidence_band,
    degrees_of_freedom,
    identify_noise,
)
from northfinder.estimators.arrays import FloatArray, IntArray, as_finite

FEWEST_SAMPLES = 32
_PER_OCTAVE = 3
_LONGEST_SHARE = 4  # of the record: beyond a quarter of it fewer than 3 degrees of freedom are left
_BLOCK = 32_768  # second differences at a time: they stay in the processor's cache
_WHOLE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class AllanDeviation:
    """A curve with its confidence bands; the unit is the rate's. Arrays are ``(t,)``.

    Attributes:
        tau_s: Averaging times, ascending.
        deviation: Overlapping Allan deviation.
        noise: The kind of noise at each tau as the exponent of its spectrum: 2 white angle
            (quantisation), 1, 0 white rate (angle random walk), -1 flicker, -2 random walk.
        edf: Equivalent chi-square degrees of freedom (SP 1065, table 5, for that kind).
        band68: Lower and upper limit at 68.27 % confidence, ``(t, 2)``.
        band95: At 95 %.
        n: Second differences behind each value; they overlap, so most of them tell nothing new.
        period_s: Of the samples.
        samples: Length of the record.
    """

    tau_s: FloatArray
    deviation: FloatArray
    noise: IntArray
    edf: FloatArray
    band68: FloatArray
    band95: FloatArray
    n: IntArray
    period_s: float
    samples: int


def overlapping_allan_deviation(
    rate: ArrayLike, period_s: float, taus: ArrayLike | None = None
) -> AllanDeviation:
    """Half the mean square of ``theta(t + 2 tau) - 2 theta(t + tau) + theta(t)`` over tau^2.

    Args:
        rate: Equidistant samples, each the mean over its period, ``(k,)``; see ``fill_gaps``.
        period_s: Of the samples.
        taus: Averaging times, s, whole periods; None: three an octave up to a quarter of the
            record.

    Raises:
        ValueError: Too short a record, a number that is not finite, a tau that is no multiple of
            the period or longer than half the record.
    """
    record = as_record(rate, period_s)
    factors = _default_factors(len(record)) if taus is None else _factors(taus, record, period_s)
    # The mean drops out of every second difference; without it less is lost to rounding.
    angle = np.concatenate([[0.0], np.cumsum(record - record.mean())])
    squares = np.array([_mean_square(angle, int(m)) for m in factors])
    deviation: FloatArray = np.sqrt(0.5 * squares) / factors
    noise = identify_noise(angle, factors)
    edf = degrees_of_freedom(len(angle), factors, noise)
    return AllanDeviation(
        factors.astype(np.float64) * period_s,
        deviation,
        noise,
        edf,
        confidence_band(deviation, edf, 0.6827),
        confidence_band(deviation, edf, 0.95),
        len(angle) - 2 * factors,
        period_s,
        len(record),
    )


def as_record(rate: ArrayLike, period_s: float) -> FloatArray:
    """Return the record as floats.

    Raises:
        ValueError: It is too short, or holds what is no number, or the period is not positive.
    """
    record = as_finite("rate", rate)
    if record.ndim != 1 or len(record) < FEWEST_SAMPLES:
        msg = (
            f"an Allan deviation needs a record (k,) of at least {FEWEST_SAMPLES} samples; got "
            f"shape {record.shape}: measure longer"
        )
        raise ValueError(msg)
    if not (period_s > 0.0 and np.isfinite(period_s)):
        msg = f"the sampling period must be a positive number of seconds, got {period_s}"
        raise ValueError(msg)
    return record


def _default_factors(samples: int) -> IntArray:
    octaves = np.log2(samples / _LONGEST_SHARE)
    fractions = np.arange(0.0, octaves * _PER_OCTAVE + 1e-9)
    factors: IntArray = np.unique(np.round(2.0 ** (fractions / _PER_OCTAVE)).astype(np.int64))
    return factors


def _factors(taus: ArrayLike, record: FloatArray, period_s: float) -> IntArray:
    asked = np.unique(np.atleast_1d(as_finite("taus", taus))) / period_s
    factors = np.round(asked).astype(np.int64)
    longest = len(record) // 2
    off = np.abs(asked - factors) > _WHOLE * np.maximum(asked, 1.0)
    bad = off | (factors < 1) | (factors > longest)
    if bad.any():
        msg = (
            f"tau = {asked[bad][0] * period_s:g} s cannot be had from {len(record)} samples of "
            f"{period_s:g} s: take whole periods up to {longest * period_s:g} s"
        )
        raise ValueError(msg)
    return factors


def _mean_square(angle: FloatArray, m: int) -> float:
    """Mean square of the second differences over m samples."""
    count = len(angle) - 2 * m
    difference, total = np.empty(min(_BLOCK, count)), 0.0
    for start in range(0, count, _BLOCK):
        end = min(start + _BLOCK, count)
        part = difference[: end - start]
        np.subtract(angle[start + 2 * m : end + 2 * m], angle[start + m : end + m], out=part)
        part -= angle[start + m : end + m]
        part += angle[start:end]
        total += float(part @ part)
    return total / count
