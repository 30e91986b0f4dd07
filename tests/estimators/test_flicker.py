"""The coupling of visits by flicker noise, against its spectrum."""

import numpy as np
import pytest

from northfinder.estimators.flicker import flicker_covariance


@pytest.mark.parametrize(
    ("start_s", "duration_s"),
    [
        pytest.param([0.0, 3.0, 7.5, 9.0], [2.0, 2.0, 2.0, 2.0], id="equal-visits"),
        pytest.param([0.0, 2.0, 4.5, 20.0], [2.0, 2.5, 1.0, 4.0], id="unequal-visits"),
    ],
)
def test_contrasts_of_visits_have_the_variance_of_the_spectrum(
    start_s: list[float], duration_s: list[float]
) -> None:
    start, duration = np.array(start_s), np.array(duration_s)
    weights = np.array([1.0, -2.0, 0.5, 0.5])  # they sum to zero, as those of a and b do
    log_f = np.linspace(np.log(1e-8), np.log(1e4), 400_001)
    f = np.exp(log_f)
    middle = start + duration / 2
    response = sum(
        w * np.sinc(f * d) * np.exp(-2j * np.pi * f * m)
        for w, d, m in zip(weights, duration, middle, strict=True)
    )
    spectrum = 2 * 0.3**2 / (2 * np.pi * f)  # f > 0 only: twice the two-sided density
    expected = np.trapezoid(spectrum * np.abs(response) ** 2 * f, log_f)
    got = weights @ flicker_covariance(start, duration, 0.3) @ weights
    assert got == pytest.approx(expected, rel=1e-4)


def test_its_allan_deviation_is_flat_at_two_thirds_of_b() -> None:
    for tau_s in (1.0, 10.0, 1000.0):
        covariance = flicker_covariance([0.0, tau_s], tau_s, 1.0)
        allan_variance = 0.5 * np.array([1.0, -1.0]) @ covariance @ np.array([1.0, -1.0])
        assert allan_variance == pytest.approx(2 * np.log(2) / np.pi)


def test_a_visit_without_length_is_refused() -> None:
    with pytest.raises(ValueError, match="the shortest is 0 s"):
        flicker_covariance([0.0, 1.0], [1.0, 0.0], 1.0)
