"""Noise of the visits' means: its size, how flicker couples them, and the bound that it sets."""

import numpy as np
import pytest
from scipy.linalg import helmert

from northfinder.campaign.bounds import Bounds
from northfinder.campaign.chunks import run_chunk
from northfinder.campaign.estimation import Reduction, estimate
from northfinder.campaign.noise import VisitNoise, gyro_noise
from northfinder.campaign.simulation import Bench
from northfinder.estimators.flicker import flicker_covariance
from tests.campaign.campaigns import DEG_PER_HOUR, KNOWN, OMEGA_E_DEG_H, added, planned

DRAWN = 20_000
FLICKER = {"simulation": {"gyro_bias_instability_deg_h": 0.05}}


def contrasts(count: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.asarray(helmert(count), dtype=np.float64)


def test_white_noise_is_the_angle_random_walk_over_the_root_of_the_dwell() -> None:
    campaign = planned()  # 0.001 deg/sqrt(h), visits of 2.5 s
    drawn = gyro_noise(campaign).draw(np.random.default_rng(1), DRAWN)
    sigma = 0.001 / np.sqrt(2.5 / 3600.0) * DEG_PER_HOUR
    assert drawn.std() == pytest.approx(sigma, rel=5 / np.sqrt(2 * drawn.size))


def test_flicker_couples_the_visits_by_its_covariance() -> None:
    """Whitened by the covariance that it should have, nothing is left but the unit matrix."""
    campaign = planned(sections=FLICKER)
    drawn = gyro_noise(campaign).draw(np.random.default_rng(2), DRAWN)
    free = contrasts(48)
    flicker = flicker_covariance(
        campaign.middle_s - campaign.dwell_s / 2, campaign.dwell_s, 0.05 * DEG_PER_HOUR
    )
    white = (0.001 * DEG_PER_HOUR) ** 2 * 3600.0 / 2.5 * np.eye(48)
    factor = np.linalg.cholesky(free @ (flicker + white) @ free.T)
    seen = np.cov(np.linalg.solve(factor, free @ drawn.T))
    deviation = (seen - np.eye(47)) / np.sqrt((1 + np.eye(47)) / DRAWN)
    assert np.abs(deviation).max() < 4.7  # of 1128 independent ones: once in 300
    assert deviation.std() == pytest.approx(1.0, abs=0.1)


def test_flicker_is_what_the_simulator_draws_by_markov_processes() -> None:
    """Sums of first-order processes, as in `sim.noise`, have nearly the same covariance."""
    campaign = planned(sections=FLICKER)
    start, dwell = campaign.middle_s - campaign.dwell_s / 2, campaign.dwell_s[0]
    within = start[:, np.newaxis] + (np.arange(40) + 0.5) * dwell / 40
    apart = np.abs(np.subtract.outer(within, within))
    processes = sum(np.exp(-apart / tau) for tau in 0.5 * 3.0 ** np.arange(11))
    means = (0.05 * DEG_PER_HOUR) ** 2 * np.log(3.0) / np.pi * processes.mean(axis=(1, 3))
    ours = gyro_noise(campaign).covariance - np.diag(
        np.full(48, (0.001 * DEG_PER_HOUR) ** 2 * 3600.0 / dwell)
    )
    free = contrasts(48)
    angle = campaign.angle_rad
    for weights in (free[0], free[20], np.cos(angle), np.sin(angle)):  # the last two: a and b
        assert weights @ ours @ weights == pytest.approx(weights @ means @ weights, rel=0.05)


def test_without_flicker_the_bound_is_the_closed_form() -> None:
    still = {"pitch_deg": 0.0, "roll_deg": 0.0, "accel_noise_g_sqrt_hz": 0.0}
    campaign = planned(sections={"simulation": still})
    bench = Bench.of(campaign)
    _, readings = bench.simulate(np.random.default_rng(1), 200)
    bound = Bounds(bench).sigma_rad(estimate(Reduction.of(campaign), readings))
    sigma_deg_h = 0.001 / np.sqrt(2.5 / 3600.0)
    closed_rad = sigma_deg_h * np.sqrt(2 / 48) / (OMEGA_E_DEG_H * np.cos(np.radians(40.0)))
    # At the measured rate of each seek in place of the true one: 7e-4 apart.
    assert bound.mean() == pytest.approx(closed_rad, rel=5e-4)
    assert bound == pytest.approx(closed_rad, rel=5e-3)


def test_the_bound_counts_a_drift_where_there_is_one() -> None:
    """In sequential order a linear drift costs a factor 2.55 in var(b) (docs/theory.md)."""
    noise = VisitNoise.white(np.ones(24))
    angle, time = np.arange(24) * np.pi / 12, np.arange(24.0)
    level = np.column_stack([np.cos(angle), np.sin(angle), np.ones(24)])
    steady, drifting = noise.bound(level), noise.bound(np.column_stack([level, time]))
    assert drifting[1, 1] / steady[1, 1] == pytest.approx(2.55, abs=0.01)
    assert steady[0, 0] == pytest.approx(2 / 24)


def test_generalised_least_squares_reaches_the_bound_under_flicker() -> None:
    sections = added(KNOWN, FLICKER, {"gyro": {"bias_instability_deg_h": 0.05}})
    columns = run_chunk(planned(sections=sections, seeks=10_000), 0)
    over_bound = np.sqrt(np.mean((columns["error_deg"] / columns["bound_deg"]) ** 2))
    assert over_bound == pytest.approx(1.0, abs=4 / np.sqrt(2 * 10_000))
    assert columns["bound_deg"].mean() * 60 > 6.0  # white noise alone: 2.3'
