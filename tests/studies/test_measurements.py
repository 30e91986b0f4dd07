"""What the studies measure with: against the product, closed forms and chance."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from northfinder.attitude import integrate
from northfinder.attitude.cone_at_rest import navigate_cone_at_rest
from northfinder.attitude.extraction import polynomial_weights
from northfinder.attitude.quaternion import to_rotation_vector
from northfinder.studies.cone import (
    CONE,
    drift_deg_h,
    parabola_drift_deg_h,
    step_drift_deg_h,
    three_rates,
)
from northfinder.studies.cone_navigation import PAPERS, navigate_an_hour
from northfinder.studies.coning_rk4 import literal_eq_4_deg
from northfinder.studies.levelling_tables import TRANSFORM_DEG, VECTOR_DEG
from northfinder.studies.operations import UPDATES, count, run_once
from northfinder.studies.rate_noise import noise_gain
from northfinder.studies.tilted_table import Tilt, repeated, revolutions
from northfinder.units import DEG, DEG_PER_HOUR


@pytest.mark.parametrize(
    ("name", "method", "options"),
    [
        ("two-sample", "two-sample", {"kind": "increments"}),
        ("two-sample from rates", "two-sample", {"extraction": "quadratic"}),
        ("three-sample", "three-sample", {"kind": "increments"}),
        ("rate-vector", "rate-vector", {}),
        ("rk4", "rk4", {}),
    ],
)
def test_what_is_counted_is_what_the_product_computes(
    name: str, method: str, options: dict[str, str]
) -> None:
    """Rates of the cone in steps of 5 ms, as angles."""
    samples = 0.005 * CONE.rate(0.005 * np.arange(UPDATES[name][0]))
    q, _ = run_once(name, samples.tolist())
    assert_allclose(q, integrate(samples, 1.0, method, **options)[0], atol=1e-15)  # type: ignore[arg-type]


def test_the_parabola_cut_in_thirds_is_what_is_counted_for_three_samples() -> None:
    rates = 0.005 * three_rates()
    q, _ = run_once("three-sample from rates", rates.tolist())
    thirds = polynomial_weights([0.0, 1.0, 2.0], np.arange(4) * 2 / 3) @ rates
    assert_allclose(q, integrate(thirds, 1.0, "three-sample", kind="increments")[0], atol=1e-15)


def test_a_count_is_that_of_the_formula() -> None:
    """Two-sample by hand: a cross product 6 and 3, its factor 3, two sums of vectors 6."""
    cost = {name: (count(name).multiplications, count(name).additions) for name in UPDATES}
    rest = (cost["two-sample"][0] - 9, cost["two-sample"][1] - 9)
    assert cost["three-sample"] == (rest[0] + 12, rest[1] + 18)
    assert cost["rk4"] == (73, 64)


@pytest.mark.parametrize(
    ("method", "samples", "extraction", "expected"),
    [
        ("rk4", 2, None, np.sqrt(10) / 3),
        ("rate-vector", 2, None, np.sqrt(10) / 3),
        ("three-sample", 3, "rectangle", 1.0),
        ("three-sample", 3, "trapezoid", 1.0),
        ("three-sample", 3, "cubic", np.sqrt(33 / 32)),
    ],
)
def test_the_gain_of_noise_is_that_of_the_rules_weights(
    method: str, samples: int, extraction: str | None, expected: float
) -> None:
    """Simpson's 2/3 and 4/3; the three-eighths rule's 3/4 and twice 9/8."""
    options = {} if extraction is None else {"extraction": extraction}
    gain = noise_gain(method, samples, **options)  # type: ignore[arg-type]
    assert gain == pytest.approx(expected, rel=1e-6)


def test_the_gain_of_noise_is_what_noise_does() -> None:
    """Four hundred random walks of sixty updates, within four standard errors."""
    random, walks = np.random.default_rng(12), 400
    ends = []
    for _ in range(walks):
        rates = 1e-6 * random.standard_normal((121, 3))
        q = integrate(rates, 1.0, "rk4")[-1]
        ends.append(to_rotation_vector(q) / 1e-6)
    scatter = np.std(ends) / np.sqrt(120.0)
    assert scatter == pytest.approx(np.sqrt(10) / 3, rel=4.0 / np.sqrt(2 * 3 * walks))


def test_one_step_drifts_as_the_product_says() -> None:
    w1, w2, w3 = three_rates()
    h = 0.01
    simpson = h / 6 * (w1 + 4 * w2 + w3)
    phi = simpson + h**2 * np.cross(w1 / 180 + 7 * w2 / 90, w3 - w1)
    assert step_drift_deg_h(phi) == pytest.approx(drift_deg_h("rate-vector"), rel=1e-7)
    assert parabola_drift_deg_h() == pytest.approx(-0.239, rel=0.01)


def test_eq_4_to_the_letter_turns_two_thirds_of_the_way() -> None:
    assert literal_eq_4_deg() == pytest.approx(20.0 / 3.0, rel=1e-4)


def test_navigation_without_sensor_errors_is_the_products() -> None:
    ours = navigate_an_hour("rate-vector", duration_s=120.0)
    track = navigate_cone_at_rest(CONE, 0.005, "rate-vector", duration_s=120.0)
    assert_allclose(ours.track.from_start_m, track.from_start_m, atol=1e-9)


def test_the_attitude_error_of_the_cone_is_its_drift_about_east() -> None:
    """In two minutes Schuler's pendulum hardly moves: pitch errs by drift times time."""
    hour = navigate_an_hour("two-sample", "increments", duration_s=120.0)
    pitch_rad = hour.tilt_rad[-1, 0]
    assert pitch_rad / 120.0 == pytest.approx(-0.20839 * DEG_PER_HOUR, rel=0.01)
    assert np.abs(hour.tilt_rad[:, 1:]).max() < 0.01 * abs(pitch_rad)


def test_a_gyros_bias_tilts_and_an_accelerometers_pushes() -> None:
    """The push carries the navigator along the Earth, whose curvature takes of the pitch."""
    time_s, pushed_m_s2 = 60.0, 100e-6 * 9.80665
    biased = navigate_an_hour("rate-vector-optimal", biases=PAPERS, duration_s=time_s)
    along_m = biased.track.velocity_n[-1] * time_s / 2.0
    assert biased.track.velocity_n[-1] == pytest.approx(pushed_m_s2 * time_s, rel=0.05)
    pitch_rad = 0.01 * DEG_PER_HOUR * time_s - along_m[1] / 6.35e6
    assert biased.tilt_rad[-1, 0] == pytest.approx(pitch_rad, rel=0.02)


def test_the_printed_rows_give_the_printed_deviations_as_degrees() -> None:
    for rows, std_arcmin in ((TRANSFORM_DEG, 1.03816), (VECTOR_DEG, 0.74567)):
        assert 60.0 * np.std(rows, ddof=1) == pytest.approx(std_arcmin, abs=2e-5)
    assert np.mean(TRANSFORM_DEG) == pytest.approx(47.99720, abs=5e-6)
    assert np.mean(VECTOR_DEG) == pytest.approx(47.99604, abs=5e-6)


def test_a_small_tilt_costs_what_it_does_times_the_tangent_of_the_latitude() -> None:
    for latitude_deg in (10.0, 40.0, 70.0):
        tilted = revolutions(Tilt(1e-5, 0.7), latitude_rad=latitude_deg * DEG)
        largest = np.abs(tilted.errors_rad("uncompensated")).max()
        assert largest == pytest.approx(1e-5 * np.tan(latitude_deg * DEG), rel=1e-3)


def test_repeated_determinations_are_equal_until_noise_comes() -> None:
    still = repeated(Tilt(3.0 * DEG, 1.0), 2.0, 50)
    assert np.ptp(still.errors_rad("two_vector")) == 0.0
    noisy = still.noisy(1e-7, 1e-5, np.random.default_rng(3))
    assert len(set(noisy.errors_rad("two_vector"))) == 50
