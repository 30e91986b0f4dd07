"""How far each method drifts under the cone of `coning-rate-vector`: 1 deg, 8 Hz, h = 10 ms."""

from typing import Any, Unpack

import numpy as np
import pytest
from numpy.testing import assert_allclose

from northfinder.attitude import ConingMotion, coning_drift_rad_s, integrate
from northfinder.attitude.coning import MethodOptions
from northfinder.attitude.extraction import polynomial_weights
from northfinder.attitude.rotation_vectors import SCHEMES, Kind, rotation_vectors
from tests.attitude.motions import DEG, DEG_PER_HOUR, Array, angle_between, rotation
from tests.evidence import Record

CONE = ConingMotion(1.0 * DEG, 16.0 * np.pi)
H_S = 0.010


def drift_deg_h(
    method: str, dt: float, kind: Kind = "rates", **options: Unpack[MethodOptions]
) -> float:
    return coning_drift_rad_s(CONE, dt, method, kind, **options) / DEG_PER_HOUR


@pytest.mark.parametrize(
    ("method", "samples", "options", "expected_deg_h", "within"),
    [
        ("rate-vector", 2, {}, 0.0669, 0.01),
        ("rate-vector-taylor", 2, {}, -0.20864, 0.01),
        ("rate-vector-optimal", 2, {}, -1.970e-3, 0.01),
        ("rk4", 2, {}, 0.2047, 0.01),
        ("one-sample", 1, {"kind": "increments"}, -65.656, 0.001),
        ("two-sample", 2, {"kind": "increments"}, -0.2084, 0.01),
        ("two-sample", 2, {"extraction": "trapezoid"}, -16.80, 0.01),
        ("two-sample", 2, {"extraction": "quadratic"}, -0.484, 0.01),
        ("three-sample-taylor", 3, {"kind": "increments"}, 0.030568, 0.01),
        ("three-sample", 3, {"kind": "increments"}, -2.48e-4, 0.02),
        ("three-sample", 3, {"extraction": "rectangle"}, 3.70, 0.01),
        ("three-sample", 3, {"extraction": "trapezoid"}, -7.38, 0.01),
        ("three-sample", 3, {"extraction": "cubic"}, 0.0301, 0.01),
        ("four-sample-taylor", 4, {"kind": "increments"}, 1.26e-4, 0.01),
        ("four-sample", 4, {"kind": "increments"}, -1.286e-5, 0.01),
        ("trailing-1", 2, {"kind": "increments"}, -0.20842, 0.01),
        ("trailing-2", 2, {"kind": "increments"}, -2.81e-3, 0.01),
        ("trailing-3", 2, {"kind": "increments"}, -3.66e-5, 0.01),
        ("trailing-4", 2, {"kind": "increments"}, 2.0e-6, 0.03),
        ("picard", 2, {"beta": 0.0}, -8.3, 0.01),
        ("picard", 2, {"beta": -0.5}, -33.0, 0.01),
        ("picard", 2, {"beta": 0.5}, 65.7, 0.01),
        ("functional", 2, {"kind": "increments", "n": 8}, 1.6e-5, 0.05),
        ("functional", 2, {"kind": "increments", "n": 10}, -7e-7, 0.05),
    ],
)
def test_each_method_drifts_as_far_as_theory_says(  # noqa: PLR0917 (a row of figures)
    method: str,
    samples: int,
    options: dict[str, Any],
    expected_deg_h: float,
    within: float,
    record_property: Record,
) -> None:
    drift = drift_deg_h(method, H_S / samples, **options)
    told = " ".join([method, *map(str, options.values())])
    record_property("measured", f"{told}: {drift:+.4g} deg/h")
    assert drift == pytest.approx(expected_deg_h, rel=within)


def test_the_best_methods_stay_below_their_limits() -> None:
    assert abs(drift_deg_h("rate-vector-optimal", H_S / 2)) <= 2.2e-3
    assert abs(drift_deg_h("four-sample", H_S / 4, "increments")) <= 1.5e-5
    assert abs(drift_deg_h("functional", H_S / 2, "increments", n=8)) <= 2e-5
    assert abs(drift_deg_h("functional", H_S / 2, "increments", n=10)) <= 1e-6


def test_the_papers_three_rate_parabola_gives_three_samples_what_it_gave() -> None:
    edges_s = H_S * np.arange(4) / 3
    weights = polynomial_weights([0.0, H_S / 2, H_S], edges_s)
    d = weights @ CONE.rate(H_S * np.arange(3) / 2)
    (phi,) = rotation_vectors(SCHEMES["three-sample"], [row[:, np.newaxis] for row in d]).T
    q = integrate(phi[np.newaxis], H_S, "one-sample", kind="increments")[0]
    turn = CONE.cone_rate_rad_s * H_S
    whole = rotation(q) * rotation(np.array([np.cos(turn / 2), np.sin(turn / 2), 0.0, 0.0]))
    assert (whole.magnitude() - turn) / H_S / DEG_PER_HOUR == pytest.approx(-0.239, rel=0.01)


@pytest.mark.parametrize(
    ("method", "least", "most"),
    [("rate-vector", 3.9, 4.1), ("rate-vector-optimal", 5.8, 6.2), ("rk4", 3.9, 4.1)],
)
def test_the_drift_falls_with_the_power_of_the_update(
    method: str, least: float, most: float, record_property: Record
) -> None:
    """At a small cone: the terms in p^4 have another power."""
    cone = ConingMotion(0.1 * DEG, 16.0 * np.pi)
    long, short = (coning_drift_rad_s(cone, dt, method) for dt in (0.005, 0.0025))
    record_property("measured", f"{method}: {np.log2(long / short):.2f}")
    assert least <= np.log2(long / short) <= most


@pytest.mark.parametrize(
    ("method", "kind", "samples", "coefficient", "power"),
    [
        ("one-sample", "increments", 1, -1 / 12, 2),
        ("two-sample", "increments", 2, -1 / 960, 4),
        ("three-sample-taylor", "increments", 3, 1 / 6480, 4),
        ("three-sample", "increments", 3, -1 / 204120, 6),
        ("four-sample-taylor", "increments", 4, 1 / 387072, 6),
        ("rate-vector-taylor", "rates", 2, -1 / 960, 4),
        ("rate-vector", "rates", 2, 1 / 2880, 4),
        ("rate-vector-optimal", "rates", 2, -37 / 967680, 6),
        ("rk4", "rates", 2, 1 / 960, 4),
    ],
)
def test_the_leading_term_of_a_small_cone_is_the_one_derived(
    method: str, kind: Kind, samples: int, coefficient: float, power: int
) -> None:
    p, turn = 1e-3, 0.25
    drift = coning_drift_rad_s(ConingMotion(p, turn / H_S), H_S / samples, method, kind)
    leading = coefficient * turn**power * p**2 * turn / H_S
    assert drift == pytest.approx(leading, rel=0.03)


def test_the_predicted_drift_is_what_ten_minutes_of_integration_show() -> None:
    time_s = H_S / 2 * np.arange(120_001)
    q = integrate(CONE.rate(time_s), H_S / 2, "rate-vector", CONE.attitude(0.0))
    end_s = float(time_s[-1])
    apart = angle_between(q[-1], rotation(CONE.attitude(end_s)))
    assert apart / end_s == pytest.approx(0.066921 * DEG_PER_HOUR, rel=1e-3)


@pytest.mark.proof
def test_the_predicted_drift_is_what_an_hour_of_integration_shows() -> None:
    time_s = H_S / 2 * np.arange(720_001)
    q = integrate(CONE.rate(time_s), H_S / 2, "rate-vector-optimal", CONE.attitude(0.0))
    apart = angle_between(q[-1], rotation(CONE.attitude(3600.0)))
    assert apart / 3600.0 == pytest.approx(1.9701e-3 * DEG_PER_HOUR, rel=1e-3)


def test_rate_increments_and_body_view_belong_to_the_attitude() -> None:
    """Against derivatives and integrals taken numerically of scipy's rotations."""
    step_s, time_s = 1e-5, np.linspace(0.0, 0.2, 41)
    before, after = (rotation(CONE.attitude(time_s + s)) for s in (-step_s, step_s))
    rate = (before.inv() * after).as_rotvec() / (2.0 * step_s)
    assert_allclose(CONE.rate(time_s), rate, atol=1e-7)

    vector = np.array([0.3, -0.5, 0.8])
    assert_allclose(
        CONE.in_body(vector, time_s), rotation(CONE.attitude(time_s)).inv().apply(vector)
    )
    nodes, weights = np.polynomial.legendre.leggauss(12)
    at = time_s[:-1, np.newaxis] + 0.0025 * (1.0 + nodes)

    def integral(values: Array) -> Array:
        summed: Array = 0.0025 * np.einsum("n,inx->ix", weights, values)
        return summed

    assert_allclose(CONE.increments(time_s), integral(CONE.rate(at)), atol=1e-16)
    seen = integral(CONE.in_body(vector, at))
    assert_allclose(CONE.body_integrals(vector, time_s), seen, atol=1e-16)


@pytest.mark.parametrize("dt", [0.07, 0.0625])
def test_a_cone_sampled_too_seldom_is_refused(dt: float) -> None:
    with pytest.raises(ValueError, match=r"turns by .* rad in an update"):
        coning_drift_rad_s(CONE, dt, "rate-vector")


def test_an_unknown_method_is_named_with_its_nearest() -> None:
    with pytest.raises(ValueError, match="did you mean 'two-sample'"):
        coning_drift_rad_s(CONE, 0.005, "twosample")
