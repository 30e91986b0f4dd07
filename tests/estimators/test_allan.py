"""Allan deviation against allantools and closed forms; bands by their simulated coverage."""

import time
from collections.abc import Callable
from importlib import import_module
from types import ModuleType

import numpy as np
import pytest
from numpy.random import Generator
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import ArrayLike
from scipy.stats import binom

from northfinder.estimators.allan import AllanDeviation, overlapping_allan_deviation
from northfinder.estimators.allan_confidence import degrees_of_freedom
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.gaps import fill_gaps
from tests.estimators.noises import flicker, quantisation, walk, white
from tests.evidence import Record

Noise = Callable[[int, float, float, Generator], FloatArray]
CONFIDENCE = 0.999  # of each statistical bound below; the seeds are fixed


def allantools() -> ModuleType:
    return import_module("allantools")


def mixed(samples: int, seed: int, period_s: float) -> FloatArray:
    """Return white noise, flicker, a walk and a drift about a rate like the Earth's."""
    random = np.random.default_rng(seed)
    noise = white(samples, period_s, 1e-6, random) + flicker(samples, period_s, 2e-7, random)
    noise += walk(samples, period_s, 1e-9, random)
    record: FloatArray = 5e-5 + noise + 1e-11 * np.arange(samples)
    return record


@pytest.mark.parametrize("samples", [32, 1000, 100_001])
def test_the_curve_is_that_of_allantools(samples: int, record_property: Record) -> None:
    rate = mixed(samples, samples, 0.01)
    ours = overlapping_allan_deviation(rate, 0.01)
    theirs = allantools().oadev(rate, rate=100.0, data_type="freq", taus=ours.tau_s)
    assert_allclose(ours.tau_s, theirs[0], rtol=1e-12)
    apart = float(np.abs(ours.deviation / theirs[1] - 1.0).max())
    record_property("measured", f"{samples} samples: {apart:.1e}")
    assert_allclose(ours.deviation, theirs[1], rtol=1e-12)
    assert_array_equal(ours.n, theirs[3])


def test_taus_that_were_asked_for_are_those_of_allantools() -> None:
    rate, taus = mixed(10_000, 1, 0.02), [100.0, 0.02, 3.14]
    ours = overlapping_allan_deviation(rate, 0.02, taus)
    theirs = allantools().oadev(rate, rate=50.0, data_type="freq", taus=sorted(taus))
    assert_allclose(ours.tau_s, sorted(taus), rtol=1e-12)
    assert_allclose(ours.deviation[:2], theirs[1][:2], rtol=1e-12)
    assert ours.n[-1] == 1  # half the record: one difference, which allantools leaves out


def test_default_taus_go_up_by_thirds_of_octaves_to_a_quarter_of_the_record() -> None:
    tau_s = overlapping_allan_deviation(mixed(4096, 2, 1.0), 1.0).tau_s
    assert tau_s[0] == 1.0
    assert tau_s[-1] == 1024.0
    assert set(2.0 ** np.arange(11)) <= set(tau_s)
    assert np.all(tau_s[6:] / tau_s[5:-1] < 1.35)


def test_a_drift_shows_as_tau_over_root_two_and_a_constant_not_at_all() -> None:
    curve = overlapping_allan_deviation(3.0 + 1e-3 * np.arange(5000.0), 1.0)
    assert_allclose(curve.deviation, 1e-3 * curve.tau_s / np.sqrt(2.0), rtol=1e-9)
    still = overlapping_allan_deviation(np.full(5000, 7.3e-5), 1.0)
    assert np.all(still.deviation == 0.0)
    assert np.all(still.band95 == 0.0)


KINDS = pytest.mark.parametrize(
    ("make", "exponent", "slope"),
    [(quantisation, 2, -1.0), (white, 0, -0.5), (flicker, -1, 0.0), (walk, -2, 0.5)],
    ids=["quantisation", "white", "flicker", "walk"],
)


@KINDS
def test_each_noise_is_named_and_has_its_slope(make: Noise, exponent: int, slope: float) -> None:
    curve = overlapping_allan_deviation(make(200_000, 1.0, 1.0, np.random.default_rng(3)), 1.0)
    known = curve.edf > 100.0
    assert np.mean(curve.noise[known] == exponent) > 0.75  # flicker is hard to tell from a walk
    fitted = np.polyfit(np.log(curve.tau_s[known][3:]), np.log(curve.deviation[known][3:]), 1)[0]
    assert fitted == pytest.approx(slope, abs=0.06)


@KINDS
def test_degrees_of_freedom_are_those_of_nist_sp_1065(
    make: Noise, exponent: int, slope: float
) -> None:
    del make, slope
    factors = np.array([1, 2, 5, 30, 240])
    ours = degrees_of_freedom(1001, factors, np.full(5, exponent))
    theirs = [allantools().edf_simple(1001, int(m), exponent) for m in factors]
    if exponent == -1:  # table 5 squares N - 2 at m = 1; allantools 2024.6 forgets to
        theirs[0] = 2.0 * 999.0**2 / (2.3 * 1001.0 - 4.9)
    assert_allclose(ours, theirs, rtol=1e-12)
    if exponent == 2:
        flicker_angle = degrees_of_freedom(1001, factors, np.ones(5, dtype=np.int64))
        assert_allclose(flicker_angle, [allantools().edf_simple(1001, int(m), 1) for m in factors])


def test_the_bands_are_chi_square_with_those_degrees_of_freedom() -> None:
    curve = overlapping_allan_deviation(mixed(3000, 4, 0.1), 0.1)
    for deviation, edf, band68, band95 in zip(
        curve.deviation, curve.edf, curve.band68, curve.band95, strict=True
    ):
        assert_allclose(band68, allantools().confidence_interval(deviation, edf, 0.6827))
        assert_allclose(band95, allantools().confidence_interval(deviation, edf, 0.95))


@KINDS
def test_the_bands_cover_the_truth_as_often_as_they_say(
    make: Noise, exponent: int, slope: float
) -> None:
    """400 records of 1024, tau 1, 8 and 64; the noise identified, not told."""
    del slope
    taus, trials = np.array([1.0, 8.0, 64.0]), 400
    random = np.random.default_rng(5)
    curves = [
        overlapping_allan_deviation(make(1024, 1.0, 1.0, random), 1.0, taus) for _ in range(trials)
    ]
    true = np.sqrt({2: 3.0 / taus**2, 0: 1.0 / taus, -1: 0.6366 * np.log(2.0) * taus**0,
                    -2: taus / 3.0}[exponent])  # fmt: skip
    for name, confidence in (("band68", 0.6827), ("band95", 0.95)):
        bands = np.array([getattr(curve, name) for curve in curves])
        covered = np.sum((bands[..., 0] < true) & (true < bands[..., 1]), axis=0)
        low, _ = binom.interval(CONFIDENCE, trials, confidence - 0.04)
        assert np.all(covered >= low), covered


def test_the_band_of_an_unknown_noise_widens_with_tau() -> None:
    curve: AllanDeviation = overlapping_allan_deviation(mixed(4000, 6, 0.1), 0.1)
    wide = curve.band95[:, 1] / curve.band95[:, 0]
    assert wide[-1] > 3.0
    assert wide[0] < 1.1
    assert np.all(curve.band95[:, 0] < curve.band68[:, 0])
    assert np.all(curve.band68[:, 1] < curve.band95[:, 1])
    assert curve.samples == 4000
    assert curve.period_s == 0.1


@pytest.mark.parametrize(
    ("rate", "period_s", "taus", "message"),
    [
        (np.ones(31), 1.0, None, "at least 32 samples; got shape \\(31,\\)"),
        (np.ones((32, 3)), 1.0, None, "got shape \\(32, 3\\)"),
        ([*np.ones(40), np.nan], 1.0, None, "rate holds nan at index \\(40,\\)"),
        (np.ones(40), 0.0, None, "positive number of seconds, got 0.0"),
        (np.ones(40), np.inf, None, "positive number of seconds, got inf"),
        (np.ones(40), 0.1, [0.1, 2.1], "tau = 2.1 s cannot be had from 40 samples"),
        (np.ones(40), 0.1, [0.25], "take whole periods up to 2 s"),
        (np.ones(40), 0.1, 0.0, "tau = 0 s cannot be had"),
    ],
)
def test_what_is_no_record_is_refused(
    rate: ArrayLike, period_s: float, taus: ArrayLike | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        overlapping_allan_deviation(rate, period_s, taus)


@pytest.mark.alone
def test_an_hour_at_1_khz_takes_less_than_two_seconds(record_property: Record) -> None:
    rate = np.random.default_rng(7).standard_normal(3_600_000)
    began_s = time.process_time()
    overlapping_allan_deviation(rate, 1e-3)
    took_s = time.process_time() - began_s
    record_property("measured", f"{took_s:.2f} s")
    assert took_s < 2.0


def test_a_record_without_gaps_is_left_as_it_is() -> None:
    filled = fill_gaps(np.arange(5, 10), np.arange(5.0))
    assert_array_equal(filled.value, np.arange(5.0))
    assert (filled.filled, filled.gaps, filled.longest) == (0, 0, 0)


def test_a_gap_becomes_the_line_between_the_means_beside_it() -> None:
    ticks = np.delete(np.arange(1000) + 70_000, [0, 1, 100, 101, 104, 998, 999])
    value = np.where(np.arange(1000) < 102, 1.0, 4.0)
    value[[98, 99, 102, 103, 105]] = [0.0, 2.0, 3.0, 5.0, 8.0]
    filled = fill_gaps(ticks, np.delete(value, [0, 1, 100, 101, 104, 998, 999]))
    expected = value[2:998].copy()
    expected[[98, 99]] = [2.0, 3.0]  # from the mean 1 of two to the mean 4 of two, in thirds
    expected[102] = 6.5  # one on either side: 5 and 8
    assert_allclose(filled.value, expected, rtol=1e-15)
    assert (filled.filled, filled.gaps, filled.longest) == (3, 2, 2)


def test_a_gap_beside_another_takes_only_what_was_measured() -> None:
    ticks = np.delete(np.arange(2000), [500, 501, 502, 504, 505])
    value = np.full(1995, 2.0)
    value[500] = 8.0  # alone between the gaps
    filled = fill_gaps(ticks, value)
    assert_allclose(filled.value[500:506], [3.5, 5.0, 6.5, 8.0, 6.0, 4.0], rtol=1e-15)


@pytest.mark.parametrize("gap", [1, 10, 100])
def test_one_filled_sample_in_a_hundred_hardly_shows(gap: int) -> None:
    """White noise, 10 million samples: variance short by 1 % at tau 1, at most 1.5 % too large."""
    random = np.random.default_rng(8)
    value = random.standard_normal(10_000_000)
    every = gap * 101
    lost = (
        np.arange(every // 2, len(value) - every, every)[:, np.newaxis] + np.arange(gap)
    ).ravel()
    filled = fill_gaps(np.delete(np.arange(len(value)), lost), np.delete(value, lost))
    assert filled.filled == len(lost)
    assert filled.longest == gap
    taus = np.array([1.0, 32.0, 1024.0])
    curve, whole = (overlapping_allan_deviation(x, 1.0, taus) for x in (filled.value, value))
    change = (curve.deviation / whole.deviation) ** 2 - 1.0
    assert change[0] == pytest.approx(-0.01, abs=0.006)
    assert change[-1] == pytest.approx(0.015, abs=0.007)
    assert np.abs(change).max() < 0.017


@pytest.mark.parametrize(
    ("tick", "value", "message"),
    [
        ([1, 2, 2], [0.0] * 3, "ticks must ascend, but 2 follows 2"),
        ([3, 2], [0.0] * 2, "unwrap the counter"),
        ([], [], "ticks need integers"),
        ([1.0, 2.0], [0.0] * 2, "got float64"),
        ([1, 2], [0.0] * 3, r"got \(2,\) ticks and \(3,\) values"),
        ([1, 2], [0.0, np.inf], "value holds inf"),
        ([0, 1, 103], [0.0] * 3, "101 samples are missing after tick 1, more than the 100"),
        ([0, 1, 3], [0.0] * 3, "1 of 4 samples are missing, more than the 1%"),
    ],
)
def test_gaps_that_would_show_are_refused(tick: ArrayLike, value: ArrayLike, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fill_gaps(tick, value)
