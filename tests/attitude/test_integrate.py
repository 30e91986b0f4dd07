"""Integration against scipy's rotations, and what it refuses."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from northfinder.attitude import METHODS, extract_increments, integrate
from northfinder.attitude.rotation_vectors import SCHEMES
from tests.attitude.motions import ARCSEC, DEG, Array, Swinging, angle_between, rotation

INCREMENT_METHODS = [name for name, scheme in SCHEMES.items() if scheme.kind == "increments"]
RATE_METHODS = [name for name in METHODS if name not in INCREMENT_METHODS]
PERIODS = {name: scheme.stride for name, scheme in SCHEMES.items()} | {
    "rk4": 2,
    "picard": 1,
    "functional": 8,
}


def sampled(method: str) -> dict[str, Any]:
    """What the method takes: rates, or increments."""
    return {"kind": "rates" if method in RATE_METHODS else "increments"}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("turn_rad", [1e-12, 1e-3, 0.6])
def test_a_steady_turn_is_exact_for_every_method(method: str, turn_rad: float) -> None:
    axis = np.array([2.0, -3.0, 6.0]) / 7.0
    q0 = Rotation.from_euler("zyx", [0.3, -0.7, 2.0])
    samples = np.tile(turn_rad * axis, (51, 1))
    q = integrate(samples, 1.0, method, q0.as_quat(scalar_first=True), **sampled(method))
    periods = PERIODS[method]
    ends = periods * np.arange(1, len(q) + 1)
    more = method in RATE_METHODS
    assert len(q) == (51 - more) // periods
    truth = q0 * Rotation.from_rotvec(turn_rad * ends[:, np.newaxis] * axis)
    runge_kutta = method == "rk4" and turn_rad > 0.1  # it knows exp to the fourth power only
    limit = 1e-1 if runge_kutta else 2e-10 if method == "rk4" else 1e-13
    assert angle_between(q, truth).max() < limit


@pytest.mark.parametrize("method", METHODS)
def test_every_method_follows_a_swing(method: str) -> None:
    """40 deg at 0.039 Hz, 100 samples/s: a second's error is below an arc second's tenth."""
    motion, dt, periods = Swinging(), 0.01, PERIODS[method]
    time_s = dt * np.arange(1201.0)
    rate = motion.rate(time_s)
    options: dict[str, Any] = {}
    if method in INCREMENT_METHODS:
        options["extraction"] = "cubic"
    q0 = motion.attitude(time_s[:1]).as_quat(scalar_first=True)[0]
    q = integrate(rate, dt, method, q0, **options)
    ends = periods * np.arange(1, len(q) + 1)
    coarse = method in {"one-sample", "picard"}
    limit = 5.0 * ARCSEC if coarse else 0.1 * ARCSEC
    assert angle_between(q, motion.attitude(time_s[ends])).max() < limit


@given(st.integers(0, 2**32 - 1), st.integers(1, 60))
def test_one_sample_is_scipys_product_of_rotation_vectors(seed: int, count: int) -> None:
    d = np.random.default_rng(seed).normal(scale=0.5, size=(count, 3))
    q = integrate(d, 0.01, "one-sample", kind="increments")
    now = Rotation.identity()
    for increment, found in zip(d, q, strict=True):
        now *= Rotation.from_rotvec(increment)
        assert angle_between(found, now) < 1e-13


@pytest.mark.parametrize("method", METHODS)
def test_integrating_in_two_parts_is_integrating_once(method: str) -> None:
    d = np.random.default_rng(5).normal(scale=0.1, size=(97, 3))
    kind = sampled(method)
    looks_back = int(method.removeprefix("trailing-")) if method.startswith("trailing") else 0
    whole = integrate(d, 1.0, method, **kind)
    half, at = len(whole) // 2, len(whole) // 2 * PERIODS[method]
    rest = integrate(d[at - looks_back :], 1.0, method, **kind)[looks_back:]
    if looks_back:
        begin = integrate(d[at - looks_back :], 1.0, method, **kind)[looks_back - 1]
        rest = (rotation(begin).inv() * rotation(rest)).as_quat(scalar_first=True)
    joined = rotation(whole[half - 1]) * rotation(rest)
    assert angle_between(whole[half:], joined).max() < 1e-13


def test_the_start_only_turns_the_whole() -> None:
    d = np.random.default_rng(6).normal(scale=0.1, size=(40, 3))
    q0 = Rotation.from_euler("zyx", [1.0, 0.5, -2.0])
    plain = integrate(d, 0.01, "four-sample", kind="increments")
    turned = integrate(d, 0.01, "four-sample", q0.as_quat(scalar_first=True), "increments")
    assert angle_between(turned, q0 * rotation(plain)).max() < 1e-14


def test_attitudes_stay_unit_quaternions_over_a_million_updates() -> None:
    rate = np.tile([0.3, -0.2, 0.5], (1_000_001, 1))
    q = integrate(rate, 0.005, "picard")
    assert_allclose(np.sum(q * q, axis=-1), 1.0, atol=1e-15)
    truth = Rotation.from_rotvec(np.array([0.3, -0.2, 0.5]) * 5000.0)
    assert angle_between(q[-1], truth) < 1e-11


def test_picard_without_correction_holds_the_rate_and_with_it_is_the_trapezoid() -> None:
    rate = Swinging().rate(np.arange(50.0) * 0.2)
    for beta, extraction in ((0.0, "rectangle"), (-0.5, "trapezoid")):
        plain = integrate(rate, 0.2, "picard", beta=beta)
        same = integrate(rate, 0.2, "one-sample", extraction=extraction)  # type: ignore[arg-type]
        assert_allclose(plain, same, atol=1e-15)
    doubled = integrate(rate, 0.2, "picard", alpha=2.0, beta=0.0)
    assert_allclose(doubled, integrate(2.0 * rate, 0.2, "picard", beta=0.0), atol=1e-15)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 9])
@pytest.mark.parametrize("terms", [1, 2, 3, 4])
def test_trailing_methods_find_their_feet_with_however_few_increments(
    terms: int, count: int
) -> None:
    """Increments of a slow swing: each one more that a method may use brings it closer."""
    motion = Swinging(10.0 * DEG, 0.5)
    fine_s = 0.005 * np.arange(8 * count + 1.0)
    fine = extract_increments(motion.rate(fine_s), 0.005, "cubic", 8)
    d = fine.reshape(count, 8, 3).sum(axis=1)
    q = integrate(d, 0.04, f"trailing-{terms}", kind="increments")
    apart = angle_between(q, motion.attitude(fine_s[8::8])).max()
    assert apart < {1: 2e-4, 2: 4e-6}.get(min(terms + 1, count), 1e-6)


@pytest.mark.parametrize(
    ("bad", "complaint"),
    [
        ({"samples": np.zeros((10, 4))}, r"need shape \(k, 3\), one row a sample; .* \(10, 4\)"),
        ({"samples": np.zeros(3)}, r"need shape \(k, 3\)"),
        ({"samples": np.zeros((0, 3))}, "rate-vector needs at least 3 rates for one update; got 0"),
        ({"samples": np.zeros((2, 3))}, "rate-vector needs at least 3 rates for one update; got 2"),
        ({"samples": np.zeros((1, 3)), "method": "rk4"}, "at least 3 rates"),
        (
            {"samples": np.zeros((3, 3)), "method": "four-sample", "kind": "increments"},
            "four-sample needs at least 4 increments for one update; got 3",
        ),
        (
            {"samples": np.zeros((2, 3)), "method": "two-sample", "extraction": "trapezoid"},
            "trapezoid extraction needs at least 3 rates; got 2",
        ),
        ({"samples": np.zeros((8, 3)), "method": "functional"}, "at least 9 rates .*; got 8"),
        (
            {"samples": np.array([[0.0, 0.0, 0.0], [0.0, np.nan, 0.0]])},
            "sample 1 holds nan on axis",
        ),
        ({"samples": np.full((3, 3), np.inf)}, "sample 0 holds inf on axis 0"),
        ({"samples": np.eye(3) * 1e30}, r"sample 0 holds 1e\+30 on axis 0"),
        ({"dt": 0.0}, "dt is 0; it must be a positive"),
        ({"dt": -0.01}, "dt is -0.01"),
        ({"dt": np.nan}, "dt is nan"),
        ({"q0": (0.0, 0.0, 0.0, 0.0)}, "q0 has length 0; .* normalise it first"),
        ({"q0": (1.0, 1.0, 0.0, 0.0)}, r"q0 has length 1\.41421"),
        ({"q0": (np.nan, 0.0, 0.0, 0.0)}, "q0 has length nan"),
        ({"q0": (1.0, 0.0, 0.0)}, r"q0 needs four components, scalar first; .* \(3,\)"),
        ({"method": "rate-vektor"}, "unknown method 'rate-vektor'; did you mean 'rate-vector'"),
        ({"method": "zzz"}, "unknown method 'zzz'; choose one of one-sample, two-sample"),
        ({"kind": "rate"}, "unknown kind 'rate'; did you mean 'rates'"),
        ({"method": "two-sample"}, "feeds on increments: with rates say extraction= rectangle, "),
        ({"method": "trailing-2"}, "feeds on increments: with rates say extraction"),
        (
            {"method": "two-sample", "extraction": "quadric"},
            "unknown extraction 'quadric'; did you mean 'quadratic'",
        ),
        ({"kind": "increments"}, "rate-vector feeds on rates; for increments choose"),
        ({"method": "picard", "kind": "increments"}, "picard feeds on rates"),
        ({"extraction": "cubic"}, "takes these rates as they are; leave extraction out"),
        (
            {"method": "two-sample", "kind": "increments", "extraction": "cubic"},
            "takes these increments as they are",
        ),
        ({"beta": 0.5}, "beta is 0.5, but rate-vector does not read it; only picard does"),
        ({"alpha": 1.0}, "only picard does"),
        ({"n": 8}, "only functional does"),
        ({"method": "functional", "n": 0}, "n is 0; functional takes 1 to 32"),
        ({"method": "functional", "n": 33}, "n is 33; functional takes 1 to 32"),
        ({"method": "functional", "n": 2.5}, r"n is 2\.5; functional takes 1 to 32"),
        ({"method": "picard", "beta": np.inf}, "beta is inf; it must be finite"),
    ],
)
def test_what_cannot_be_integrated_is_refused_in_words(bad: dict[str, Any], complaint: str) -> None:
    plain: dict[str, Any] = {"samples": np.zeros((10, 3)), "dt": 0.01, "method": "rate-vector"}
    with pytest.raises(ValueError, match=complaint):
        integrate(**(plain | bad))


def test_a_start_rounded_to_single_precision_is_taken_and_mended() -> None:
    rounded = Rotation.random(rng=1).as_quat(scalar_first=True).astype(np.float32)
    q = integrate(np.zeros((3, 3)), 0.01, q0=rounded)
    assert_allclose(np.sum(q * q, axis=-1), 1.0, rtol=1e-15)


def test_samples_that_fill_no_update_are_left_over() -> None:
    samples: Array = np.ones((9, 3))
    assert integrate(samples, 0.01, "rate-vector").shape == (4, 4)
    assert integrate(samples[:8], 0.01, "rate-vector").shape == (3, 4)
    assert integrate(samples, 0.01, "four-sample", kind="increments").shape == (2, 4)
    assert integrate(samples, 0.01, "trailing-3", kind="increments").shape == (9, 4)
    assert integrate(samples, 0.01, "functional", kind="increments", n=4).shape == (2, 4)
    assert integrate(samples, 0.01, "functional", n=4).shape == (2, 4)
