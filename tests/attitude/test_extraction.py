"""Increments out of rates: exact for polynomials of the extraction's degree, and not beyond."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from northfinder.attitude import extract_increments
from northfinder.attitude.extraction import DEGREES, Extraction, polynomial_weights

DT_S = 0.01


@given(
    st.sampled_from(["trapezoid", "quadratic", "cubic"]),
    st.integers(1, 4),
    st.integers(0, 2**32 - 1),
)
def test_a_polynomial_rate_is_integrated_exactly(
    extraction: Extraction, update: int, seed: int
) -> None:
    random = np.random.default_rng(seed)
    rate = [np.polynomial.Polynomial(random.normal(size=DEGREES[extraction] + 1)) for _ in "xyz"]
    time_s = DT_S * np.arange(14.0)
    found = extract_increments(np.stack([p(time_s) for p in rate], -1), DT_S, extraction, update)
    angle = np.stack([p.integ()(time_s) for p in rate], axis=-1)
    assert_allclose(found, np.diff(angle, axis=0)[: len(found)], atol=1e-15)
    assert len(found) == 13 // update * update


def test_the_rectangle_holds_the_rate_at_the_end_of_the_interval() -> None:
    rates = np.arange(9.0).reshape(3, 3)
    assert_allclose(extract_increments(rates, 0.5, "rectangle"), 0.5 * rates[1:])


@pytest.mark.parametrize(("extraction", "update"), [("quadratic", 2), ("cubic", 3), ("cubic", 4)])
def test_an_update_with_enough_rates_looks_at_no_others(
    extraction: Extraction, update: int
) -> None:
    rates = np.random.default_rng(3).normal(size=(4 * update + 1, 3))
    whole = extract_increments(rates, DT_S, extraction, update)
    second = extract_increments(rates[update : 2 * update + 1], DT_S, extraction, update)
    assert_allclose(whole[update : 2 * update], second, atol=1e-17)


def test_increments_never_wait_for_rates_after_their_update() -> None:
    rates = np.random.default_rng(4).normal(size=(20, 3))
    extractions: tuple[Extraction, ...] = ("trapezoid", "quadratic", "cubic")
    for extraction in extractions:
        for update in (1, 2, 3):
            whole = extract_increments(rates, DT_S, extraction, update)
            early = extract_increments(rates[:13], DT_S, extraction, update)
            assert_allclose(whole[:12], early, atol=1e-17)


def test_weights_are_those_of_the_textbook() -> None:
    assert_allclose(polynomial_weights([0.0, 1.0], [0.0, 1.0]), [[0.5, 0.5]])
    assert_allclose(polynomial_weights([0.0, 1.0, 2.0], [0.0, 2.0]), [[1 / 3, 4 / 3, 1 / 3]])
    three_eighths = np.array([[1.0, 3.0, 3.0, 1.0]]) * 3 / 8
    assert_allclose(polynomial_weights(np.arange(4.0), [0.0, 3.0]), three_eighths)


def test_too_few_rates_and_unknown_names_are_refused() -> None:
    with pytest.raises(ValueError, match="cubic extraction needs at least 4 rates; got 3"):
        extract_increments(np.zeros((3, 3)), DT_S, "cubic")
    with pytest.raises(ValueError, match="did you mean 'trapezoid'"):
        extract_increments(np.zeros((3, 3)), DT_S, "trapez")  # type: ignore[arg-type]
