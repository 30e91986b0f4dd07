"""What a plan promises, against closed forms and against what the run then does."""

import math
from typing import Any

import numpy as np
import pytest

from northfinder.errors import ConfigError
from northfinder.procedures.north_seek import Plan, predict
from northfinder.procedures.planning import Prediction
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
