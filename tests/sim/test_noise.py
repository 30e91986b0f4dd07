"""The noise is as strong as it says: figures by their definitions, with stated confidence."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.stats import chi2

from drivers.interfaces import FloatArray
from sim.noise import NoiseLevels, SensorNoise

CONFIDENCE = 0.999  # of each statistical bound below; the seeds are fixed


def errors(
    levels: NoiseLevels, count: int, period_s: float, *, burst: int = 1000, seed: int = 1
) -> FloatArray:
    """Return consecutive errors, asked for in bursts as a device does, ``(count, 3)``."""
    noise = SensorNoise(levels, np.random.default_rng(seed))
    time_s = 50.0 + np.arange(1, count + 1).astype(np.float64) * period_s
    return np.concatenate(
        [noise.sample(time_s[i : i + burst], period_s) for i in range(0, count, burst)]
    )


def assert_sigma(independent: FloatArray, sigma: float) -> None:
    """The sample variance about a mean of zero lies within its chi-square bounds."""
    n = independent.size
    low, high = chi2.interval(CONFIDENCE, n)
    assert low < float(np.sum(independent**2)) / sigma**2 < high


def allan_deviation(x: FloatArray, m: int) -> float:
    """Overlapping, over m samples, all three axes together (IEEE Std 952-1997, annex C)."""
    theta = np.concatenate([np.zeros((1, 3)), np.cumsum(x, axis=0)])
    second = theta[2 * m :] - 2 * theta[m:-m] + theta[: -2 * m]
    return float(np.sqrt(np.mean(second**2) / 2) / m)


@pytest.mark.parametrize("period_s", [0.001, 0.01])
def test_the_mean_of_white_noise_over_t_seconds_has_sigma_n_over_root_t(period_s: float) -> None:
    x = errors(NoiseLevels(white_sqrt_s=3e-6), 200_000, period_s)
    assert_sigma(x, 3e-6 / np.sqrt(period_s))
    over_100 = x.reshape(-1, 100, 3).mean(axis=1)
    assert_sigma(over_100, 3e-6 / np.sqrt(100 * period_s))


def test_axes_and_successive_samples_of_white_noise_are_independent() -> None:
    x = errors(NoiseLevels(white_sqrt_s=1.0), 100_000, 1.0)
    five_sigma = 5 / np.sqrt(100_000)
    assert np.all(np.abs(np.corrcoef(x.T) - np.eye(3)) < five_sigma)
    assert abs(float(np.mean(x[1:] * x[:-1]))) < five_sigma


def test_the_bias_is_constant_and_the_drift_grows_from_power_up() -> None:
    x = errors(NoiseLevels(bias=2e-6, drift_per_s=1e-9), 3600, 1.0)
    expected = 2e-6 + 1e-9 * np.arange(1, 3601)
    assert x == pytest.approx(np.tile(expected, (3, 1)).T, rel=1e-12)


def test_a_random_walk_grows_with_the_root_of_time() -> None:
    levels = NoiseLevels(random_walk_per_sqrt_s=1e-8)
    walks = np.stack([errors(levels, 400, 0.25, burst=40, seed=seed) for seed in range(500)])
    for end in (40, 400):  # 10 s and 100 s
        assert_sigma(walks[:, end - 1], 1e-8 * np.sqrt(0.25 * end))


def test_a_random_walk_goes_on_across_bursts_of_any_length() -> None:
    levels = NoiseLevels(random_walk_per_sqrt_s=1.0)
    assert_sigma(np.diff(errors(levels, 20_000, 1.0, burst=7), axis=0), 1.0)


def test_the_allan_deviation_of_the_bias_instability_is_flat_at_its_floor() -> None:
    x = errors(NoiseLevels(bias_instability=1.0), 40_000, 0.5, burst=1, seed=3)
    floor = 0.664  # IEEE Std 952-1997, annex C: sqrt(2 ln 2/pi) B
    for tau_s, tolerance in ((5, 0.02), (20, 0.03), (100, 0.06), (500, 0.15)):
        assert allan_deviation(x, int(tau_s / 0.5)) == pytest.approx(floor, rel=tolerance)


def test_the_density_of_the_bias_instability_falls_as_one_over_f() -> None:
    period_s, count = 0.5, 8192
    x = errors(NoiseLevels(bias_instability=1.0), 5 * count, period_s, burst=1, seed=4)
    windowed = x.reshape(5, count, 3) * np.hanning(count)[:, np.newaxis]
    norm = period_s / np.sum(np.hanning(count) ** 2)
    density = 2 * norm * np.mean(np.abs(np.fft.rfft(windowed, axis=1)) ** 2, axis=(0, 2))
    f_hz = np.fft.rfftfreq(count, period_s)
    band = (f_hz > 2e-3) & (f_hz < 0.1)
    slope, level = np.polyfit(np.log(f_hz[band]), np.log(density[band]), 1)
    # The logarithm of a density averaged over 15 spectra lies 1/30 below that of its mean.
    assert slope == pytest.approx(-1.0, abs=0.05)
    level_at_centre = level + slope * np.log(0.02) + 1 / 30
    one_sided = 2 / (2 * np.pi * 0.02)  # IEEE Std 952-1997, annex C: two-sided B^2/(2 pi f)
    assert np.exp(level_at_centre) == pytest.approx(one_sided, rel=0.08)


def test_bias_instability_is_stationary_from_the_first_sample_on() -> None:
    levels = NoiseLevels(bias_instability=1.0)
    ends = np.stack([errors(levels, 20, 100.0, burst=1, seed=seed)[[0, -1]] for seed in range(600)])
    variance = 11 * np.log(3) / np.pi  # eleven processes, a factor of three apart
    assert_sigma(ends[:, 0], np.sqrt(variance))
    assert_sigma(ends[:, 1], np.sqrt(variance))


EVERYTHING = NoiseLevels(1e-6, 2e-6, 1e-9, 3e-7, 1e-8)


def test_equal_seeds_give_equal_noise_bit_for_bit_and_others_do_not() -> None:
    first = errors(EVERYTHING, 1000, 0.01, burst=50, seed=7)
    assert_array_equal(first, errors(EVERYTHING, 1000, 0.01, burst=50, seed=7))
    assert not np.any(first == errors(EVERYTHING, 1000, 0.01, burst=50, seed=8))


def test_levels_changed_in_the_run_take_effect_at_once() -> None:
    noise = SensorNoise(NoiseLevels(bias=1.0), np.random.default_rng(1))
    time_s = np.array([1.0, 2.0])
    assert noise.sample(time_s, 1.0) == pytest.approx(np.ones((2, 3)))
    noise.levels = NoiseLevels(bias=5.0)
    assert noise.sample(time_s + 2, 1.0) == pytest.approx(np.full((2, 3), 5.0))


def test_a_drift_changed_in_the_run_bends_the_offset_and_does_not_step_it() -> None:
    noise = SensorNoise(NoiseLevels(bias=2.0, drift_per_s=0.1), np.random.default_rng(1))
    time_s = np.arange(1.0, 11.0)
    warming_up = noise.sample(time_s, 1.0)[:, 0]
    assert warming_up[-1] == pytest.approx(3.0)
    noise.levels = NoiseLevels(bias=2.0, drift_per_s=-0.2)
    assert noise.sample(time_s + 10.0, 1.0)[:, 0] == pytest.approx(3.0 - 0.2 * time_s)
    noise.levels = NoiseLevels(white_sqrt_s=1e-12, bias=2.0, drift_per_s=0.0)
    assert noise.sample(time_s + 20.0, 1.0) == pytest.approx(np.full((10, 3), 1.0))


def test_a_bias_changed_in_the_run_is_the_offset_from_then_on_whatever_it_had_drifted() -> None:
    noise = SensorNoise(NoiseLevels(bias=2.0, drift_per_s=0.1), np.random.default_rng(1))
    time_s = np.arange(1.0, 11.0)
    noise.sample(time_s, 1.0)
    noise.levels = NoiseLevels(bias=5.0, drift_per_s=0.1)
    assert noise.sample(time_s + 10.0, 1.0)[:, 0] == pytest.approx(5.0 + 0.1 * time_s)


def test_levels_changed_before_the_first_sample_are_as_if_given_at_first() -> None:
    noise = SensorNoise(NoiseLevels(bias=1.0, drift_per_s=7.0), np.random.default_rng(1))
    noise.levels = NoiseLevels(bias=2.0, drift_per_s=0.5)
    assert noise.sample(np.array([100.0, 101.0]), 1.0)[:, 0] == pytest.approx([2.5, 3.0])
