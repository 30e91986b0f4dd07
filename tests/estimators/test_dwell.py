"""The suggested dwell against predictions of a north-seek, and against north-seeks simulated."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from northfinder.errors import EstimationError
from northfinder.estimators.allan_figures import Drift, NoiseFigure, NoiseFit
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.design import harmonic_design
from northfinder.estimators.dwell import DwellSuggestion, leaves_white_s, suggest_dwell
from northfinder.estimators.prediction import predict_azimuth
from northfinder.estimators.uncertainty import SystematicUncertainty
from tests.estimators.noises import flicker, walk, white

DEG = np.pi / 180
LATITUDE_RAD = 40.0 * DEG
LEVEL_RATE = 7.292115e-5 * np.cos(LATITUDE_RAD)
ARW = 0.001 * DEG / 60.0  # 0.001 deg/sqrt(h)
DEG_PER_HOUR = DEG / 3600.0
PAUSE_S = 1.5
UNSEEN = NoiseFigure(None, 0.0, 0.0)

ANGLES = np.arange(24) * 15.0 * DEG
SEQUENTIAL = ANGLES
OUT_AND_BACK = np.concatenate([ANGLES, ANGLES[::-1]])
PAIRS = np.stack([ANGLES[:12], ANGLES[:12] + np.pi], axis=1).ravel()
OPPOSITE = np.concatenate([PAIRS, PAIRS[::-1]])


def figure(value: float) -> NoiseFigure:
    return NoiseFigure(value, value, value) if value > 0.0 else UNSEEN


def gyro(n: float, b: float = 0.0, k: float = 0.0, duration_s: float = 36_000.0) -> NoiseFit:
    still = Drift(0.0, 1.0, 0.0)
    return NoiseFit(figure(n), figure(b), figure(k), UNSEEN, still, 0.0, 0, 1.0, duration_s)


def suggest(fit: NoiseFit, angles: FloatArray = OPPOSITE) -> DwellSuggestion:
    return suggest_dwell(fit, angles, LATITUDE_RAD, PAUSE_S)


def predicted(angles: FloatArray, visit_s: float, n: float, b: float) -> float:
    """Return the sigma that the procedure's own prediction has for such a run."""
    time_s = (visit_s + PAUSE_S) * np.arange(len(angles))
    design = harmonic_design(angles, n / np.sqrt(visit_s), time_s)
    known = SystematicUncertainty(bias_instability_rad_s=b)
    level = harmonic_design(angles, 1e-12, time_s)
    budget = predict_azimuth(design, level, LATITUDE_RAD, known, visit_s).budget
    return float(budget.sigma_rad)


def test_white_noise_profits_as_far_as_the_record_or_the_longest_dwell_goes() -> None:
    short, long = suggest(gyro(ARW, duration_s=400.0)), suggest(gyro(ARW))
    assert short.dwell_s == pytest.approx(2 * 100.0)  # two visits of a quarter of the record
    assert long.dwell_s == pytest.approx(3600.0)
    assert "a longer record may allow a longer dwell" in short.reason
    assert "the longest dwell allowed still profits" in long.reason
    for suggestion in (short, long):
        bound = ARW * np.sqrt(2.0 / (24 * suggestion.dwell_s)) / LEVEL_RATE
        assert suggestion.sigma_rad == pytest.approx(bound, rel=1e-9)
        assert suggestion.leaves_white_s == np.inf


@pytest.mark.parametrize("angles", [OUT_AND_BACK, OPPOSITE])
@pytest.mark.parametrize("b_deg_h", [0.005, 0.02])
def test_sigma_and_the_choice_are_those_of_the_procedures_prediction(
    angles: FloatArray, b_deg_h: float
) -> None:
    b = b_deg_h * DEG_PER_HOUR
    suggestion = suggest(gyro(ARW, b), angles)
    visit_s = suggestion.dwell_s / 2.0
    here = predicted(angles, visit_s, ARW, b)
    assert suggestion.sigma_rad == pytest.approx(here, rel=1e-3)
    gains = [
        np.log(predicted(angles, at_s, ARW, b) / predicted(angles, longer_s, ARW, b))
        for at_s, longer_s in [
            (visit_s / 1.1, 1.1 * (visit_s / 1.1 + PAUSE_S) - PAUSE_S),
            (visit_s * 1.1, 1.1 * (visit_s * 1.1 + PAUSE_S) - PAUSE_S),
        ]
    ]
    worth = 0.25 * np.log(1.1)  # half of what 10 % more time gives against white noise
    assert gains[0] > worth > gains[1]
    assert "bias instability takes over" in suggestion.reason


def test_an_order_that_cancels_flicker_deserves_longer_visits() -> None:
    fit = gyro(ARW, 0.01 * DEG_PER_HOUR)
    opposite, out_and_back = suggest(fit), suggest(fit, OUT_AND_BACK)
    assert opposite.dwell_s > 4.0 * out_and_back.dwell_s
    assert opposite.sigma_rad < 0.5 * out_and_back.sigma_rad
    assert opposite.leaves_white_s == out_and_back.leaves_white_s


@pytest.mark.parametrize(("b_deg_h", "k"), [(0.01, 0.0), (0.0, 3e-9), (0.01, 3e-9)])
def test_the_allan_deviation_leaves_its_white_slope_by_a_tenth(b_deg_h: float, k: float) -> None:
    fit = gyro(ARW, b_deg_h * DEG_PER_HOUR, k)
    tau_s = leaves_white_s(fit)
    assert_allclose(fit.deviation(tau_s), 1.1 * ARW / np.sqrt(tau_s), rtol=1e-9)


@pytest.mark.parametrize(("b", "k", "slow"), [(1e-7, 0.0, "bias instability"),
                                              (0.0, 4e-9, "rate random walk")])  # fmt: skip
def test_north_seeks_scatter_as_it_promises(b: float, k: float, slow: str) -> None:
    """300 runs on records of one sample a second, fitted by least squares, at the worst azimuth."""
    n = 1e-6
    suggestion = suggest_dwell(gyro(n, b, k), OPPOSITE, LATITUDE_RAD, 2.0)
    assert slow in suggestion.reason
    visit = max(1, round(suggestion.dwell_s / 2))
    start = (visit + 2) * np.arange(48)
    random, errors = np.random.default_rng(9), []
    model = np.stack([np.ones(48), np.cos(OPPOSITE), np.sin(OPPOSITE)], axis=1)
    for _ in range(300):
        noise = white(start[-1] + visit, 1.0, n, random)
        noise += flicker(len(noise), 1.0, b, random) + walk(len(noise), 1.0, k, random)
        means = np.array([noise[at : at + visit].mean() for at in start])
        errors.append(np.linalg.lstsq(model, means)[0][1:] / LEVEL_RATE)
    worst = np.sqrt(np.linalg.eigvalsh(np.cov(np.array(errors).T))[-1])
    assert worst == pytest.approx(suggestion.sigma_rad, rel=0.12)


def test_a_sequential_order_is_judged_with_the_drift_that_its_fit_will_have() -> None:
    fit = gyro(ARW, k=2e-9)
    with_drift = suggest_dwell(fit, SEQUENTIAL, LATITUDE_RAD, PAUSE_S, drift_order=1)
    without = suggest_dwell(fit, SEQUENTIAL, LATITUDE_RAD, PAUSE_S)
    assert with_drift.dwell_s > 1.2 * without.dwell_s


def test_a_gyro_of_nothing_but_slow_noise_is_given_more_revolutions_instead() -> None:
    suggestion = suggest(gyro(ARW, 5.0 * DEG_PER_HOUR), OUT_AND_BACK)
    assert suggestion.dwell_s == pytest.approx(2 * PAUSE_S)
    assert "more revolutions are worth more than longer visits" in suggestion.reason


def test_a_record_shorter_than_the_tables_moves_is_no_reason_to_measure_shorter() -> None:
    suggestion = suggest(gyro(ARW, duration_s=4.0))
    assert suggestion.dwell_s == pytest.approx(2 * PAUSE_S, rel=0.06)


def test_what_gives_no_suggestion_is_refused() -> None:
    with pytest.raises(EstimationError, match="the record shows no angle random walk"):
        suggest(gyro(0.0, 1e-7))
    with pytest.raises(ValueError, match="pause_s must be a positive time"):
        suggest_dwell(gyro(ARW), OPPOSITE, LATITUDE_RAD, 0.0)
    with pytest.raises(EstimationError, match="at least 3 distinct angles"):
        suggest(gyro(ARW), np.array([0.0, np.pi, 0.0]))
