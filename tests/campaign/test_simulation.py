"""What the sensors read: the simulator's truth, and each stated error as large as stated."""

from typing import Any

import numpy as np
import pytest

from northfinder.campaign.simulation import Bench
from northfinder.procedures.plan import Plan
from sim.truth import Truth
from tests.campaign.campaigns import (
    DEG,
    DEG_PER_HOUR,
    KNOWN,
    added,
    all_columns,
    is_covered_as_stated,
    planned,
)

QUIET: dict[str, dict[str, Any]] = {
    "simulation": {
        "gyro_noise_deg_sqrt_h": 1e-9,
        "gyro_bias_deg_h": 0.0,
        "accel_noise_g_sqrt_hz": 0.0,
    },
    "turntable": {"angle_sigma_deg": 0.0},
    "site": {"latitude_sigma_deg": 0.0, "gravity_m_s2": 9.80665},
}
NOTHING: dict[str, Any] = {}


def test_without_noise_the_readings_are_the_simulators() -> None:
    mounted = {"gyro": {"mount_angle_deg": 20.0}, "accelerometer": {"mount_angle_deg": -35.0}}
    campaign = planned(sections=added(QUIET, mounted), tilt_deg=20.0)
    attitudes, readings = Bench.of(campaign).simulate(np.random.default_rng(4), 20)
    for index in range(20):
        truth = Truth(
            40 * DEG,
            attitudes.azimuth_rad[index],
            attitudes.pitch_rad[index],
            attitudes.roll_rad[index],
            gravity_m_s2=9.80665,
        )
        for felt, mount_deg, vector, least in (
            (readings.rate_rad_s, 20.0, truth.earth_rate_t(), 1e-12),
            (readings.force_g, -35.0, truth.specific_force_t(), 1e-14),
        ):
            angle = campaign.angle_rad + mount_deg * DEG
            along = np.cos(angle) * vector[1] - np.sin(angle) * vector[0]
            np.testing.assert_allclose(felt[index], along, atol=least)


def test_bias_and_drift_are_the_simulations() -> None:
    drifting = {"simulation": {"gyro_bias_deg_h": 2.0, "gyro_drift_deg_h_h": 30.0}}
    steady, moved = (
        Bench.of(planned(sections=added(QUIET, part))).simulate(np.random.default_rng(4), 3)[1]
        for part in ({}, drifting)
    )
    campaign = planned()
    course = 2.0 * DEG_PER_HOUR + 30.0 / 3600.0 * DEG_PER_HOUR * campaign.middle_s
    np.testing.assert_allclose(moved.rate_rad_s - steady.rate_rad_s, [course] * 3, atol=1e-15)


def test_outliers_spoil_as_many_visits_as_asked_by_their_size() -> None:
    plain, spoiled = (
        Bench.of(planned(sections=QUIET, **drawn)).simulate(np.random.default_rng(4), 500)[1]
        for drawn in (NOTHING, {"outliers": 2, "outlier_size_deg_h": 3.0})
    )
    off_deg_h = (spoiled.rate_rad_s - plain.rate_rad_s) / DEG_PER_HOUR
    hit = np.abs(off_deg_h) > 1.0
    assert (hit.sum(axis=1) == 2).all()
    np.testing.assert_allclose(np.abs(off_deg_h[hit]), 3.0, atol=1e-5)
    assert 0.4 < (off_deg_h[hit] > 0).mean() < 0.6
    assert (hit.sum(axis=0) > 0).all()  # any visit may be hit


@pytest.mark.parametrize(
    "stated",
    [
        pytest.param({"turntable": {"angle_sigma_deg": 0.5}}, id="table angle"),
        pytest.param({"gyro": {"mount_angle_sigma_deg": 0.5}}, id="gyro mounting"),
        pytest.param({"accelerometer": {"mount_angle_sigma_deg": 2.0}}, id="level mounting"),
        pytest.param({"gyro": {"scale_factor_sigma_ppm": 20_000}}, id="scale factor"),
        pytest.param({"site": {"latitude_sigma_deg": 1.0}}, id="latitude"),
        pytest.param({"gyro": {"drift_curvature_sigma_deg_h3": 3000.0}}, id="drift curvature"),
        pytest.param(
            {"gyro": {"bias_instability_deg_h": 0.2},
             "simulation": {"gyro_bias_instability_deg_h": 0.2}}, id="bias instability"),
    ],
)  # fmt: skip
def test_each_error_that_is_stated_is_drawn_as_large_as_its_budget_line(
    stated: dict[str, dict[str, Any]],
) -> None:
    """Far above the noise, so that the coverage tells of that error alone."""
    campaign = planned(sections=added(KNOWN, stated), tilt_deg=10.0, seeks=10_000)
    columns = all_columns(campaign)
    alone = all_columns(planned(sections=KNOWN, tilt_deg=10.0, seeks=2_000))
    assert np.std(columns["error_deg"]) > 1.5 * np.std(alone["error_deg"])
    assert is_covered_as_stated(columns)


def test_a_tilted_sequential_plan_of_few_visits_is_simulated_too() -> None:
    campaign = planned(Plan(positions=3, order="sequential"), tilt_deg=5.0, seeks=5_000)
    assert is_covered_as_stated(all_columns(campaign))
