"""The campaign's truth beside the simulator's, which is built one attitude at a time."""

import numpy as np
import pytest
from scipy.stats import kstest

from northfinder.campaign.attitudes import Attitudes, draw_attitudes
from sim.truth import Truth
from tests.campaign.campaigns import DEG, planned


def test_the_earth_and_gravity_are_felt_as_in_the_simulator() -> None:
    random = np.random.default_rng(7)
    azimuth, pitch, roll = random.uniform(-1.0, 1.0, (3, 200)) * [[np.pi], [1.0], [1.0]]
    attitudes = Attitudes(azimuth, pitch, roll)
    rate, force = attitudes.earth_rate(0.7), attitudes.specific_force(1.0)
    for index in range(200):
        truth = Truth(0.7, azimuth[index], pitch[index], roll[index], gravity_m_s2=9.80665)
        felt = [[part[index] for part in pair] for pair in (rate, force)]
        np.testing.assert_allclose(felt[0], truth.earth_rate_t()[:2], atol=1e-19)
        np.testing.assert_allclose(felt[1], truth.specific_force_t()[:2], atol=1e-15)


def test_azimuths_and_tilts_are_uniform_in_size_and_direction() -> None:
    drawn = draw_attitudes(planned(tilt_deg=10.0), np.random.default_rng(3), 20_000)
    truths = Attitudes(np.zeros(20_000), drawn.pitch_rad, drawn.roll_rad)
    x, y = truths.axes_n()
    tilt_deg = np.arcsin(np.hypot(x[2], y[2])) / DEG
    towards = np.arctan2(x[2], y[2]) / (2 * np.pi) + 0.5
    azimuth = drawn.azimuth_rad / (2 * np.pi)
    for share in (tilt_deg / 10.0, towards, azimuth):
        assert kstest(share, "uniform").pvalue > 1e-3


def test_what_is_given_is_not_drawn() -> None:
    campaign = planned(
        sections={"simulation": {"pitch_deg": 2.0, "roll_deg": -3.0}}, azimuth_deg=-90
    )
    drawn = draw_attitudes(campaign, np.random.default_rng(3), 5)
    for values, given_deg in ((drawn.azimuth_rad, 270), (drawn.pitch_rad, 2), (drawn.roll_rad, -3)):
        assert values / DEG == pytest.approx(given_deg)
