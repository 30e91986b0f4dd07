"""The JSON that programs rely on: every promised key, of the promised kind."""

import json
from typing import Any

import pytest

from tests.cli.conftest import SHORT, Northfinder

NUMBER = (int, float)
SOLUTIONS = (
    "coordinate_transform",
    "vector",
    "vector_published",
    "vector_uncorrected",
    "two_vector",
    "uncompensated",
)
#: A type, a table of keys, or a list whose elements are all like the one given.
RESULT: dict[str, Any] = {
    "kind": str,
    "state": str,
    "run_id": str,
    "azimuth_deg": NUMBER,
    "azimuth_sigma_deg": NUMBER,
    "azimuth_interval95_deg": [NUMBER],
    "reference_azimuth_deg": NUMBER,
    "solutions": {name: {"azimuth_deg": NUMBER, "sigma_deg": NUMBER} for name in SOLUTIONS},
    "segments": [{"R_deg_h": NUMBER, "drift_deg_h_h": (*NUMBER, type(None))}],
    "gyro_fit": {
        "R_deg_h": NUMBER,
        "a_deg_h": NUMBER,
        "b_deg_h": NUMBER,
        "covariance_deg2_h2": [[NUMBER]],
        "residual_sigma_deg_h": NUMBER,
        "chi2": NUMBER,
        "dof": int,
    },
    "accelerometer_fit": {
        "R_g": NUMBER,
        "a_g": NUMBER,
        "b_g": NUMBER,
        "covariance_g2": [[NUMBER]],
        "residual_sigma_g": NUMBER,
        "chi2": NUMBER,
        "dof": int,
    },
    "tilt": {
        "epsilon_deg": NUMBER,
        "zeta_deg": (*NUMBER, type(None)),
        "pitch_deg": NUMBER,
        "roll_deg": NUMBER,
        "sigma_deg": NUMBER,
    },
    "earth_rate": {
        "horizontal_measured_deg_h": NUMBER,
        "horizontal_expected_deg_h": NUMBER,
        "z": NUMBER,
    },
    "budget": [{"source": str, "u_deg": NUMBER, "share": NUMBER}],
    "checks": [{"name": str, "status": str, "detail": str}],
    "visits": [
        {
            "index": int,
            "segment": int,
            "direction": str,
            "angle_deg": NUMBER,
            "gyro_mean_deg_h": NUMBER,
            "gyro_sigma_deg_h": NUMBER,
            "accel_mean_g": NUMBER,
            "accel_sigma_g": NUMBER,
            "samples": int,
            "lost": int,
            "start_s": NUMBER,
        }
    ],
    "plan": dict,
    "site": {"latitude_deg": NUMBER},
    "rig": dict,
    "simulation": {"azimuth_deg": NUMBER, "seed": int},
    "software": {"version": str},
}


def assert_alike(value: Any, promised: Any, place: str = "") -> None:  # noqa: ANN401 - JSON
    if isinstance(promised, dict):
        for key, below in promised.items():
            assert key in value, f"{place}.{key} is missing"
            assert_alike(value[key], below, f"{place}.{key}")
    elif isinstance(promised, list):
        assert value, f"{place} is empty"
        for element in value:
            assert_alike(element, promised[0], f"{place}[]")
    else:
        assert isinstance(value, promised), f"{place} is {value!r}"


@pytest.fixture
def result(northfinder: Northfinder) -> dict[str, Any]:
    answer = northfinder("seek", *SHORT, "--json")
    assert (answer.code, answer.err) == (0, "")
    found: dict[str, Any] = json.loads(answer.out)  # one object and nothing else
    return found


def test_a_seek_prints_one_object_with_everything_promised(result: dict[str, Any]) -> None:
    assert_alike(result, RESULT)
    assert (result["kind"], result["state"]) == ("north-seek", "completed")


def test_its_numbers_hang_together(result: dict[str, Any]) -> None:
    transform = result["solutions"]["coordinate_transform"]
    assert result["azimuth_deg"] == transform["azimuth_deg"]
    assert result["azimuth_sigma_deg"] == transform["sigma_deg"]
    low_deg, high_deg = result["azimuth_interval95_deg"]
    assert low_deg < result["azimuth_deg"] < high_deg
    variance = sum(line["u_deg"] ** 2 for line in result["budget"])
    assert variance == pytest.approx(result["azimuth_sigma_deg"] ** 2, rel=1e-12)
    assert sum(line["share"] for line in result["budget"]) == pytest.approx(1.0)
    assert [visit["index"] for visit in result["visits"]] == list(range(8))
    assert result["segments"][0]["R_deg_h"] == result["gyro_fit"]["R_deg_h"]


def test_a_level_table_has_no_downhill_direction(northfinder: Northfinder) -> None:
    level = ("--sim-pitch", "0", "--sim-roll", "0", "--sim-accel-noise", "0.001")
    answer = northfinder("seek", *SHORT, *level, "--json")
    tilt = json.loads(answer.out)["tilt"]
    assert (tilt["zeta_deg"] is None) == (tilt["epsilon_deg"] < tilt["sigma_deg"])


def test_a_plan_prints_one_object_too(northfinder: Northfinder) -> None:
    answer = northfinder("plan", "--json")
    promised = {
        "duration_s": NUMBER,
        "azimuth_sigma_deg": NUMBER,
        "budget": [{"source": str, "u_deg": NUMBER, "share": NUMBER}],
        "warnings": list,
        "motion_limits": {"speed_deg_s": NUMBER, "acceleration_deg_s2": NUMBER},
        "plan": {"positions": int, "dwell_s": NUMBER, "order": str},
    }
    assert_alike(json.loads(answer.out), promised)
