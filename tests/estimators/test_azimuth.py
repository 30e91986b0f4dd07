"""The azimuth solvers: the golden cases, the paper's figures, the truth, exact derivatives."""

import json
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike

from northfinder.errors import EstimationError
from northfinder.estimators import estimate_tilt, fit_harmonic, solve_azimuth
from northfinder.estimators.azimuth import measure_earth_rate
from northfinder.estimators.solvers import SOLVERS, Method
from tests.estimators.truth import (
    ARCMIN,
    DEG,
    DEG_PER_HOUR,
    OMEGA_RAD_S,
    TWENTY_FOUR_RAD,
    Array,
    angle_between,
    read,
)
from tests.evidence import Record

GOLDEN = json.loads((Path(__file__).parents[1] / "vectors" / "north_seek.json").read_text())
EXACT: tuple[Method, ...] = ("coordinate_transform", "vector", "two_vector")
METHODS: tuple[Method, ...] = get_args(Method)
NAMES = {"vector": "vector_exact", "vector_published": "vector_eq10"} | {
    "vector_uncorrected": "vector_eq11"
}

azimuths_deg = st.floats(0.0, 360.0, exclude_max=True)
latitudes_deg = st.floats(-85.0, 85.0)


def solve(
    azimuth_deg: ArrayLike, pitch_deg: float, roll_deg: float, latitude_deg: float, method: Method
) -> Array:
    """Azimuth in rad from noise-free readings."""
    latitude_rad = latitude_deg * DEG
    rate, force = read(np.asarray(azimuth_deg) * DEG, pitch_deg * DEG, roll_deg * DEG, latitude_rad)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force))
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate)
    return solve_azimuth(fit, tilt, latitude_rad, method).azimuth_rad


def tilted(epsilon_deg: float, zeta_deg: float) -> tuple[float, float]:
    """Pitch and roll in deg of a table that falls by epsilon towards table angle zeta."""
    pitch = np.arcsin(-np.sin(epsilon_deg * DEG) * np.cos(zeta_deg * DEG))
    roll = np.arcsin(-np.sin(epsilon_deg * DEG) * np.sin(zeta_deg * DEG) / np.cos(pitch))
    return float(pitch / DEG), float(roll / DEG)


def largest_error_deg(epsilon_deg: float, zeta_deg: float, method: Method) -> float:
    azimuth_deg = np.arange(0.0, 360.0, 0.25)
    solved = solve(azimuth_deg, *tilted(epsilon_deg, zeta_deg), 40.0, method)
    return float(np.abs(angle_between(solved, azimuth_deg * DEG)).max() / DEG)


@pytest.mark.parametrize("case", GOLDEN["cases"])
def test_every_intermediate_of_the_golden_cases(
    case: dict[str, Any], record_property: Record
) -> None:
    latitude_rad = case["latitude_deg"] * DEG
    azimuth, pitch, roll = (case[f"{name}_deg"] * DEG for name in ("azimuth", "pitch", "roll"))
    rate, force = read(azimuth, pitch, roll, latitude_rad)
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate + 0.3 * DEG_PER_HOUR)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force))
    golden_rate = [0.3, case["a_deg_h"], case["b_deg_h"]]
    assert_allclose(fit.parameters / DEG_PER_HOUR, golden_rate, rtol=0, atol=1e-9)
    assert_allclose(tilt.level, [case["a_accel_g"], case["b_accel_g"]], rtol=0, atol=1e-11)
    for name in ("epsilon", "pitch", "roll"):
        got_deg = getattr(tilt, f"{name}_rad") / DEG
        assert_allclose(got_deg, case[f"{name}_deg"], rtol=0, atol=1e-9)
    if case["epsilon_deg"] > 0.0:
        off = angle_between(tilt.zeta_rad, case["zeta_deg"] * DEG)
        assert_allclose(off / DEG, 0.0, atol=1e-9)
    for method in METHODS:
        golden_deg = case[f"azimuth_{NAMES.get(method, method)}_deg"]
        solved = solve_azimuth(fit, tilt, latitude_rad, method).azimuth_rad
        assert 0.0 <= solved < 2 * np.pi
        apart_deg = angle_between(solved, golden_deg * DEG) / DEG
        record_property("measured", f"{abs(apart_deg):.1e} deg")
        assert_allclose(apart_deg, 0.0, atol=1e-9)


@given(azimuths_deg, st.floats(0.0, 30.0), st.floats(0.0, 360.0), latitudes_deg)
@settings(max_examples=300)
def test_the_exact_solvers_find_the_truth(
    azimuth_deg: float, epsilon_deg: float, zeta_deg: float, latitude_deg: float
) -> None:
    solved = [
        solve(azimuth_deg, *tilted(epsilon_deg, zeta_deg), latitude_deg, method) for method in EXACT
    ]
    assert_allclose(angle_between(solved, azimuth_deg * DEG), 0.0, atol=1e-12)


def test_a_hair_west_of_north_is_zero_or_just_below_a_turn() -> None:
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, np.zeros(24)))
    fit = fit_harmonic([0.0, np.pi / 2, np.pi], [1e-5, -1e-40, -1e-5])
    assert 0.0 <= solve_azimuth(fit, tilt, 0.0).azimuth_rad < 2 * np.pi


@pytest.mark.parametrize(
    ("epsilon_deg", "zeta_deg", "method", "error_deg"),
    [
        pytest.param(10.0, 0.0, "uncompensated", 8.55, id="fig-4-prints-8.4"),
        pytest.param(10.0, 0.0, "vector_uncorrected", 0.4386, id="fig-3-prints-5-percent"),
        pytest.param(10.0, 45.0, "vector_published", 0.8771, id="eq-10-on-two-axes-10-deg"),
        pytest.param(10.0, 45.0, "vector_uncorrected", 0.8771, id="eq-11-is-no-worse-there"),
        pytest.param(5.0, 45.0, "vector_published", 0.2184, id="eq-10-on-two-axes-5-deg"),
        pytest.param(1.0, 45.0, "vector_published", 0.0087, id="eq-10-on-two-axes-1-deg"),
        pytest.param(10.0, 0.0, "vector_published", 0.0, id="eq-10-is-exact-in-pitch"),
        pytest.param(10.0, 90.0, "vector_published", 0.0, id="eq-10-is-exact-in-roll"),
        pytest.param(10.0, 45.0, "vector", 0.0, id="the-exact-vector-form-always"),
    ],
)
def test_the_errors_that_the_paper_prints_and_those_it_does_not(
    epsilon_deg: float, zeta_deg: float, method: Method, error_deg: float
) -> None:
    within_deg = 0.005 if method == "uncompensated" else 5e-5  # the digits that are known
    got_deg = largest_error_deg(epsilon_deg, zeta_deg, method)
    assert got_deg == pytest.approx(error_deg, abs=within_deg)


def test_uncompensated_over_all_directions_of_tilt_errs_by_nine_degrees() -> None:
    worst = max(largest_error_deg(10.0, zeta, "uncompensated") for zeta in np.arange(0, 360, 5.0))
    assert worst == pytest.approx(8.99, abs=0.005)


def test_one_degree_of_tilt_costs_fifty_minutes_uncompensated() -> None:
    assert largest_error_deg(1.0, 0.0, "uncompensated") * 60 == pytest.approx(50.0, rel=0.02)


@given(
    azimuths_deg,
    st.floats(0.1, 25.0),
    st.floats(0.0, 360.0),
    st.floats(5.0, 80.0) | st.floats(-80.0, -5.0),
    st.sampled_from(METHODS),
)
def test_jacobians_are_the_central_differences(
    azimuth_deg: float,
    epsilon_deg: float,
    zeta_deg: float,
    latitude_deg: float,
    method: Method,
) -> None:
    latitude_rad = latitude_deg * DEG
    pitch, roll = (angle * DEG for angle in tilted(epsilon_deg, zeta_deg))
    rate, force = read(azimuth_deg * DEG, pitch, roll, latitude_rad)
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force))
    jacobian = solve_azimuth(fit, tilt, latitude_rad, method).jacobian

    def azimuth_at(x: Array) -> Array:
        harmonics = np.stack([np.cos(TWENTY_FOUR_RAD), np.sin(TWENTY_FOUR_RAD)])
        level = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, x[2:4] @ harmonics))
        gyro = fit_harmonic(TWENTY_FOUR_RAD, x[0:2] @ harmonics)
        return solve_azimuth(gyro, level, x[4], method).azimuth_rad

    at = np.array([fit.a, fit.b, *tilt.level, latitude_rad])
    for index, step in enumerate([1e-6 * OMEGA_RAD_S] * 2 + [1e-6] * 3):
        move = step * np.eye(5)[index]
        difference = angle_between(azimuth_at(at + move), azimuth_at(at - move)) / (2 * step)
        scale = 1.0 if index > 1 else 1.0 / OMEGA_RAD_S
        assert_allclose(jacobian[index], difference, rtol=1e-5, atol=1e-6 * scale)


def test_white_noise_gives_the_stated_sigma_at_level() -> None:
    # sigma sqrt(2/n) / omega_N: 0.02 deg/h, 24 positions, 40 deg.
    rate, force = read(48 * DEG, 0.0, 0.0, 40 * DEG)
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate, sigma=0.02 * DEG_PER_HOUR)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, sigma=1e-12))
    for method in METHODS:
        sigma_rad = solve_azimuth(fit, tilt, 40 * DEG, method).sigma_rad
        assert sigma_rad / ARCMIN == pytest.approx(1.7226, abs=5e-5)


def test_a_tilt_error_turns_the_azimuth_by_the_tangent_of_the_latitude() -> None:
    rate, force = read(0.0, 0.0, 0.0, 60 * DEG)
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate, sigma=1e-15)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, sigma=1e-4))
    sigma_rad = solve_azimuth(fit, tilt, 60 * DEG).sigma_rad
    assert sigma_rad == pytest.approx(1e-4 * np.sqrt(2 / 24) * np.tan(60 * DEG), rel=1e-6)


def test_one_tilt_serves_many_fits_and_many_latitudes() -> None:
    rate, force = read([1.0, 2.0, 3.0], 0.05, -0.02, 0.7)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force[0]))
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate)
    solved = solve_azimuth(fit, tilt, np.full((2, 3), 0.7))
    assert_allclose(solved.azimuth_rad, [[1.0, 2.0, 3.0]] * 2)
    assert solved.jacobian.shape == (2, 3, 5)


def test_the_self_check_sees_scale_factor_and_latitude_and_not_azimuth() -> None:
    rate, force = read(1.0, 0.1, -0.08, 40 * DEG)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, sigma=1e-6))

    def measure(scale: float, latitude_deg: float, turn_deg: float = 0.0, **sigma: float) -> float:
        angle = TWENTY_FOUR_RAD + turn_deg * DEG
        fit = fit_harmonic(angle, scale * rate, sigma=0.01 * DEG_PER_HOUR)
        turned = estimate_tilt(fit_harmonic(angle, force, sigma=1e-6)) if turn_deg else tilt
        return float(measure_earth_rate(fit, turned, latitude_deg * DEG, **sigma).z)

    assert abs(measure(1.0, 40.0)) < 1e-6
    assert abs(measure(1.0, 40.0, turn_deg=5.0)) < 1e-6
    assert measure(1.01, 40.0) > 30.0
    assert abs(measure(1.01, 40.0, scale_factor_sigma=0.01)) < 1.1
    assert measure(1.0, 41.0) > 30.0
    assert abs(measure(1.0, 41.0, latitude_sigma_rad=1.0 * DEG)) < 1.1


def test_the_self_check_has_unit_scatter_under_noise() -> None:
    random = np.random.default_rng(5)
    rate, force = read(2.0, 0.12, -0.1, -50 * DEG)
    sigma = 0.02 * DEG_PER_HOUR
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate + random.normal(0.0, sigma, (20_000, 24)), sigma=sigma)
    level = fit_harmonic(
        TWENTY_FOUR_RAD, force + random.normal(0.0, 5e-4, (20_000, 24)), sigma=5e-4
    )
    z = measure_earth_rate(fit, estimate_tilt(level), -50 * DEG).z
    assert z.mean() == pytest.approx(0.0, abs=0.03)
    assert z.std() == pytest.approx(1.0, abs=0.02)


def test_what_no_azimuth_follows_from_is_refused_in_words() -> None:
    level = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, np.zeros(24)))
    fit = fit_harmonic(TWENTY_FOUR_RAD, np.cos(TWENTY_FOUR_RAD))
    dead = fit_harmonic(TWENTY_FOUR_RAD, np.zeros(24))
    with pytest.raises(EstimationError, match=r"89\.5000 deg is beyond 89 deg"):
        solve_azimuth(fit, level, [0.0, -89.5 * DEG])
    with pytest.raises(EstimationError, match="feels no horizontal rate"):
        solve_azimuth(dead, level, 0.0)
    with pytest.raises(ValueError, match="choose one of coordinate_transform, vector"):
        solve_azimuth(fit, level, 0.0, "arctan")  # type: ignore[arg-type]  # the caller's bug
    with pytest.raises(ValueError, match="latitude_rad holds nan"):
        solve_azimuth(fit, level, float("nan"))
    assert set(SOLVERS) == set(METHODS)
