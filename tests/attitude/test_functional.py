"""Functional iteration against scipy's solver of the same differential equation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from northfinder.attitude import integrate
from tests.attitude.motions import Array, angle_between, rotation


def solved(rate: list[np.polynomial.Polynomial], end: float) -> Array:
    def slope(t: float, q: Array) -> Array:
        w, x, y, z = q
        a, b, c = (p(t) for p in rate)
        turned = [-x * a - y * b - z * c, w * a + y * c - z * b, w * b + z * a - x * c]
        return 0.5 * np.array([*turned, w * c + x * b - y * a])

    found = solve_ivp(slope, (0.0, end), [1.0, 0.0, 0.0, 0.0], "DOP853", rtol=1e-13, atol=1e-14)
    q: Array = found.y[:, -1]
    return q / np.linalg.norm(q)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(3, 10), rates=st.booleans())
def test_a_polynomial_rate_is_integrated_to_the_last_digits(
    seed: int, n: int, *, rates: bool
) -> None:
    """Of any degree that the samples determine, turning by up to a radian or so."""
    random = np.random.default_rng(seed)
    scale = 0.5 / n ** np.arange(1.0, 4.0)
    rate = [np.polynomial.Polynomial(scale * random.normal(size=3)) for _ in "xyz"]
    at = np.arange(n + 1.0)
    if rates:
        samples = np.stack([p(at) for p in rate], axis=-1)
        q = integrate(samples, 1.0, "functional", n=n)
    else:
        samples = np.diff(np.stack([p.integ()(at) for p in rate], axis=-1), axis=0)
        q = integrate(samples, 1.0, "functional", kind="increments", n=n)
    assert angle_between(q[-1], rotation(solved(rate, float(n)))) < 1e-11


def test_a_block_that_turns_too_far_is_refused() -> None:
    wild = 8.0 * np.random.default_rng(2).normal(size=(8, 3))
    with pytest.raises(ValueError, match=r"a block turns by .* rad; lower n"):
        integrate(wild, 1.0, "functional", kind="increments", n=8)
