"""The estimation of a campaign is a run's, for thousands at once."""

import numpy as np
import pytest

from northfinder.campaign.chunks import run_chunk
from northfinder.campaign.estimation import Reduction, estimate
from northfinder.campaign.settings import Campaign
from northfinder.campaign.simulation import Bench, Readings
from northfinder.estimators.arrays import FloatArray
from northfinder.procedures.plan import Plan
from northfinder.procedures.reduction import reduce_visits
from northfinder.procedures.visits import Visit
from northfinder.samples import Samples
from tests.campaign.campaigns import (
    KNOWN,
    SEQUENTIAL,
    added,
    all_columns,
    is_covered_as_stated,
    planned,
)

FLICKER = {
    "gyro": {"bias_instability_deg_h": 0.05},
    "simulation": {"gyro_bias_instability_deg_h": 0.05},
}
DRIFT = {"simulation": {"gyro_drift_deg_h_h": 2.0}}


def samples(mean: float, dwell_s: float, white: float) -> Samples:
    """Readings of that mean, with the scatter within the visit that such noise has."""
    count = 100
    tick = np.arange(count)
    wave = np.where(tick % 2 == 0, 1.0, -1.0) * white * np.sqrt(count / dwell_s)
    valid = np.ones(count, dtype=np.bool_)
    return Samples(tick, tick * dwell_s / count, mean + wave, valid, count)


def visits_of(campaign: Campaign, rate_rad_s: FloatArray, force_g: FloatArray) -> list[Visit]:
    return [
        Visit(
            index=index,
            segment=planned_mean.segment,
            direction="back" if planned_mean.segment % 2 else "out",
            angle_rad=planned_mean.angle_rad,
            start_s=planned_mean.middle_s - planned_mean.dwell_s / 2,
            turned_rad=None,
            gyro=samples(rate_rad_s[index], planned_mean.dwell_s, 2.9e-7),
            accelerometer=samples(force_g[index], planned_mean.dwell_s, 1e-5),
        )
        for index, planned_mean in enumerate(campaign.visits)
    ]


@pytest.mark.parametrize(
    "spoiled", [{}, {"outliers": 2, "outlier_size_deg_h": 1.0}], ids=["clean", "spoiled"]
)
@pytest.mark.parametrize("sections", [{}, KNOWN, added(KNOWN, FLICKER), DRIFT], ids=str)
@pytest.mark.parametrize(
    "plan",
    [
        pytest.param(Plan(), id="out-and-back"),
        pytest.param(SEQUENTIAL, id="sequential"),
        pytest.param(Plan(order="opposite"), id="opposite"),
        pytest.param(Plan(modulation="continuous"), id="continuous"),
        pytest.param(Plan(positions=8, revolutions=2), id="twice"),
    ],
)
def test_each_seek_is_reduced_as_a_run_is(
    plan: Plan, sections: dict[str, dict[str, float]], spoiled: dict[str, float]
) -> None:
    """The same azimuth and sigma as from the run's own path, one visit at a time."""
    campaign = planned(plan, sections, tilt_deg=5.0, **spoiled)
    _, readings = Bench.of(campaign).simulate(np.random.default_rng(11), 20)
    stated = estimate(Reduction.of(campaign), readings)
    for index in range(20):
        visits = visits_of(campaign, readings.rate_rad_s[index], readings.force_g[index])
        run = reduce_visits(visits, campaign.plan, campaign.rig)
        budget = run.budgets["coordinate_transform"]
        told = (stated.azimuth_rad, stated.vector_azimuth_rad, stated.sigma_rad, stated.pitch_rad)
        assert [float(value[index]) for value in told] == pytest.approx(
            [
                float(run.solutions["coordinate_transform"].azimuth_rad),
                float(run.solutions["vector"].azimuth_rad),
                float(budget.sigma_rad),
                float(run.tilt.pitch_rad),
            ],
            rel=1e-9,
        )
        assert stated.interval95_rad[index] == pytest.approx(float(budget.interval95_rad), rel=1e-9)


def test_seeks_that_show_a_drift_are_fitted_with_one() -> None:
    """Left in the residuals it would pass for noise: the stated sigma would be too large."""
    steady, drifting = (
        run_chunk(planned(sections=sections), 0)
        for sections in ({}, {"simulation": {"gyro_drift_deg_h_h": 20.0}})
    )
    assert drifting["azimuth_sigma_deg"].mean() == pytest.approx(
        steady["azimuth_sigma_deg"].mean(), rel=0.03
    )
    assert (drifting["dof"] < steady["dof"]).mean() > 0.9


def test_white_noise_on_a_level_table_scatters_as_the_closed_form_says() -> None:
    """sigma sqrt(2/n) / omega_N with 0.02 deg/h, n = 24, L = 40 deg: 1.7226'."""
    simulated = {
        "gyro_noise_deg_sqrt_h": 0.02 * np.sqrt(5.0 / 3600.0),
        "accel_noise_g_sqrt_hz": 0.0,
        "pitch_deg": 0.0,
        "roll_deg": 0.0,
    }
    drifting = all_columns(
        planned(SEQUENTIAL, added(KNOWN, {"simulation": simulated}), azimuth_deg=90.0, seeks=20_000)
    )
    scatter = np.sqrt(np.mean(drifting["error_deg"] ** 2)) * 60.0
    # At 90 deg only a decides, which a fitted drift does not touch.
    assert scatter == pytest.approx(1.7226, rel=4 / np.sqrt(2 * 20_000))
    assert drifting["azimuth_deg"] == pytest.approx(drifting["vector_azimuth_deg"], abs=1e-10)


def test_a_visit_that_somebody_disturbed_is_left_out() -> None:
    """The interval is as true as without, and hardly wider."""
    clean, spoiled = (
        all_columns(planned(Plan(), KNOWN, seeks=5_000, **more))
        for more in ({}, {"outliers": 1, "outlier_size_deg_h": 10.0})
    )
    assert is_covered_as_stated(spoiled)
    ratio = spoiled["azimuth_sigma_deg"].mean() / clean["azimuth_sigma_deg"].mean()
    assert 1.0 < ratio < 1.05


@pytest.mark.parametrize("plan", [Plan(), SEQUENTIAL, Plan(positions=5, revolutions=2)], ids=str)
@pytest.mark.parametrize("sections", [{}, KNOWN, added(KNOWN, FLICKER), DRIFT], ids=str)
def test_the_stated_interval_is_true(plan: Plan, sections: dict[str, dict[str, float]]) -> None:
    assert is_covered_as_stated(all_columns(planned(plan, sections, tilt_deg=10.0, seeks=10_000)))


def test_readings_that_miss_a_visit_are_refused() -> None:
    campaign = planned()
    short = Readings(np.zeros((2, 47)), np.zeros((2, 47)))
    with pytest.raises(ValueError, match=r"the readings need shape \(..., 48\)"):
        estimate(Reduction.of(campaign), short)
