"""What a plan promises, against closed forms and against what the run then does."""

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from northfinder.errors import ConfigError
from northfinder.procedures.north_seek import Plan, predict
from northfinder.procedures.planning import Prediction
from northfinder.proof.utilisation import measured_share
from northfinder.validation import validated
from northfinder.wiring import build_rig
from tests.procedures.rigs import SHORT, config_of, seek, virtually, world_of

EARTH_RATE_DEG_H = math.degrees(7.292115e-5) * 3600.0


def predicted(plan: Plan, **sections: dict[str, Any]) -> Prediction:
    config = config_of(**sections)

    async def ask() -> Prediction:
        async with build_rig(config) as rig:
            prediction = predict(plan, rig)
            assert world_of(rig).plate.end_s == 0.0, "a prediction moves nothing"
            return prediction

    return virtually(config, ask())


def test_the_defaults_promise_the_closed_form() -> None:
    """sigma sqrt(2/n) / (Omega cos L), sigma of the mean over 5 s: 0.0385 deg at 40 deg."""
    sigma_deg_h = 0.001 / math.sqrt(5.0 / 3600.0)
    horizontal_deg_h = EARTH_RATE_DEG_H * math.cos(math.radians(40.0))
    expected_deg = math.degrees(sigma_deg_h * math.sqrt(2 / 24) / horizontal_deg_h)
    assert expected_deg == pytest.approx(0.0385, abs=5e-5)
    sigma_deg = predicted(Plan()).to_json()["azimuth_sigma_deg"]
    assert sigma_deg == pytest.approx(expected_deg, rel=1e-3)  # the table's angle adds a little


@pytest.mark.parametrize("order", ["out-and-back", "sequential", "opposite"])
def test_the_run_takes_as_long_as_predicted(order: str) -> None:
    plan = validated(Plan, {"positions": 6, "dwell_s": 2.0, "order": order}, "plan")
    prediction = predicted(plan)
    lasted_s = seek(plan).lasted_s
    assert lasted_s == pytest.approx(prediction.duration_s, rel=0.1)
    assert lasted_s - prediction.homing_s < prediction.duration_s


def test_the_duration_is_right_within_a_few_per_cent_beside_homing() -> None:
    """Homing may take anything up to a turn; what is set aside for it is not part of this."""
    plan = Plan(positions=12, dwell_s=2.0)
    prediction, outcome = predicted(plan), seek(plan)
    first_s, last_s = (outcome.completed["visits"][k]["start_s"] for k in (0, -1))
    assert last_s - first_s == pytest.approx(prediction.end_s[-1] - prediction.end_s[0], rel=0.03)


@pytest.mark.parametrize("driver", ["zaber", "cia402"])
def test_what_is_not_motion_or_settling_is_measured(driver: str) -> None:
    """The figure is 0.98 at the default dwell; by device time."""
    assert 0.98 <= measured_share(driver, Plan(positions=6)) <= 1.0


def test_the_target_is_reached_and_a_chosen_plan_predicts_itself() -> None:
    first = predicted(Plan(target_sigma_deg=0.02))
    assert math.degrees(first.sigma_rad) == pytest.approx(0.02, rel=1e-6)
    assert predicted(first.plan).plan == first.plan


def test_a_target_chooses_the_dwell_whatever_dwell_was_given() -> None:
    given = [predicted(Plan(target_sigma_deg=0.1, dwell_s=dwell_s)) for dwell_s in (1e-6, 3600.0)]
    assert given[0].plan == given[1].plan


def test_an_unreachable_target_is_refused_and_says_what_limits_it() -> None:
    with pytest.raises(ConfigError, match=r"cannot be reached within 3600 s .* 0\.01. deg of it"):
        predicted(Plan(target_sigma_deg=0.01), gyro={"mount_angle_sigma_deg": 0.011})


def test_auto_takes_opposite_angles_under_bias_instability() -> None:
    plan = Plan(order="auto")
    prediction = predicted(plan, gyro={"bias_instability_deg_h": 0.05})
    assert prediction.plan.order == "opposite"
    chosen = predicted(prediction.plan, gyro={"bias_instability_deg_h": 0.05}).sigma_rad
    usual = predicted(Plan(), gyro={"bias_instability_deg_h": 0.05}).sigma_rad
    assert chosen < usual


@pytest.mark.parametrize("instability_deg_h", [0.0, 0.02, 0.1])
def test_auto_fills_the_time_allowed_and_no_plan_of_its_kind_is_better(
    instability_deg_h: float,
) -> None:
    """Held against plans that were worked out without it, each filling the same time."""
    gyro = {"bias_instability_deg_h": instability_deg_h}
    best = predicted(Plan(order="auto", allowed_s=120.0), gyro=gyro)
    assert best.duration_s == pytest.approx(120.0, rel=1e-6)
    assert best.chosen is not None
    assert "the smallest sigma" in best.chosen
    for positions, order in product((8, 24), ("out-and-back", "opposite", "sequential")):
        other = Plan.model_validate({"positions": positions, "order": order, "dwell_s": 2.0})
        first = predicted(other, gyro=gyro)
        left_s = 120.0 - (first.duration_s - positions * 2.0)
        if left_s > 0.5:
            same = other.model_copy(update={"dwell_s": left_s / positions})
            rival = predicted(same, gyro=gyro)
            assert rival.duration_s == pytest.approx(120.0, rel=1e-6)
            assert best.sigma_rad <= rival.sigma_rad * (1 + 1e-9)


def test_auto_takes_no_longer_than_the_given_angles_out_and_back_and_predicts_itself() -> None:
    given, chosen = predicted(Plan()), predicted(Plan(order="auto"))
    assert chosen.duration_s == pytest.approx(given.duration_s, rel=1e-6)
    assert chosen.sigma_rad < given.sigma_rad
    assert predicted(chosen.plan).plan == chosen.plan


def test_auto_with_a_target_takes_the_least_time() -> None:
    target = {"target_sigma_deg": 0.05}
    quickest = predicted(Plan(order="auto", target_sigma_deg=0.05))
    assert math.degrees(quickest.sigma_rad) == pytest.approx(0.05, rel=1e-6)
    for positions in (8, 16, 24):
        other = predicted(Plan.model_validate({"positions": positions, **target}))
        assert quickest.duration_s <= other.duration_s


def test_auto_says_where_the_target_takes_longer_than_allowed() -> None:
    chosen = predicted(Plan(order="auto", target_sigma_deg=0.05, allowed_s=10.0)).chosen
    assert chosen is not None
    assert "longer than the 10 s allowed" in chosen


def test_auto_refuses_a_target_that_nothing_reaches() -> None:
    with pytest.raises(ConfigError, match=r"cannot be reached within 3600 s"):
        predicted(Plan(order="auto", target_sigma_deg=0.01), gyro={"mount_angle_sigma_deg": 0.011})


def test_auto_refuses_a_time_that_leaves_nothing_to_measure() -> None:
    with pytest.raises(ConfigError, match=r"^5 s are too short for a north-seek on this rig"):
        predicted(Plan(order="auto", allowed_s=5.0))


def test_auto_reckons_with_the_bias_instability_that_is_simulated() -> None:
    chosen = predicted(Plan(order="auto"), simulation={"gyro_bias_instability_deg_h": 0.03}).chosen
    assert chosen is not None
    assert "bias instability of 0.03 deg/h" in chosen


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"allowed_s": 60.0}, "allowed_s = 60 is what order 'auto' fills"),
        ({"most_visits": 12}, "most_visits = 12 bounds a run that ends at its target"),
    ],
)
def test_what_belongs_to_another_choice_is_refused(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        validated(Plan, wrong, "plan")


def test_a_dwell_too_short_for_the_slower_sensor_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"would last 0\.005 s, .* needs 0\.02 s .* lengthen"):
        predicted(Plan(dwell_s=0.01))


def test_more_visits_than_can_be_fitted_are_refused() -> None:
    with pytest.raises(ConfigError, match="make 144000 visits, more than 2000"):
        validated(Plan, {"positions": 720, "revolutions": 100}, "plan")


@pytest.mark.parametrize("latitude_deg", [80.5, -85.0])
def test_a_high_latitude_is_warned_of(latitude_deg: float) -> None:
    (warning,) = predicted(SHORT, site={"latitude_deg": latitude_deg}).warnings
    assert f"latitude of {latitude_deg:.2f} deg" in warning


def test_the_sequential_order_is_warned_of() -> None:
    (warning,) = predicted(Plan(order="sequential")).warnings
    assert "out-and-back" in warning


def test_the_prediction_says_how_fast_the_table_turns() -> None:
    limits = predicted(SHORT).to_json()["motion_limits"]
    assert limits == pytest.approx({"speed_deg_s": 120.0, "acceleration_deg_s2": 360.0}, rel=1e-2)


def test_noise_free_simulations_are_planned_by_the_data_sheets() -> None:
    noise_free = {"gyro_noise_deg_sqrt_h": 0.0, "accel_noise_g_sqrt_hz": 0.0}
    ratio = predicted(Plan(), simulation=noise_free).sigma_rad / predicted(Plan()).sigma_rad
    assert ratio == pytest.approx(0.012 / 0.001, rel=0.01)


@pytest.mark.parametrize("wrong", [{"order": "foo"}, {"positions": 2}, {"dwell_s": np.nan}])
def test_a_mistake_in_a_plan_names_its_field(wrong: dict[str, Any]) -> None:
    (field,) = wrong
    with pytest.raises(ConfigError, match=f"^plan: {field} = [^;]*$"):
        validated(Plan, wrong, "plan")


def test_a_prediction_tells_where_the_table_will_stop() -> None:
    schedule = predicted(SHORT).to_json()["schedule"]
    assert [stop["direction"] for stop in schedule] == ["out"] * 4 + ["back"] * 4
    angles_deg = [stop["angle_deg"] for stop in schedule]
    assert angles_deg == pytest.approx([0, 90, 180, 270, 270, 180, 90, 0])
