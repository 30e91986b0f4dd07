"""The stated uncertainty against closed forms and against what simulated alignments do."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from northfinder.alignment import METHODS, Limits, SensorErrors, predict_limits
from northfinder.alignment.methods import Method, Solver
from northfinder.alignment.response import find_response
from northfinder.errors import EstimationError
from northfinder.units import ARCMIN, DEG
from tests.alignment.bases import (
    ARCSEC,
    EARTH_RATE_RAD_S,
    LATITUDE_RAD,
    PERFECT,
    SENSORS,
    Preset,
    Stream,
    at_rest,
    nominal,
    paper_like,
    stream,
)
from tests.evidence import Record


def noise_rad(limits: Limits) -> float:
    """Share of the sensors' noise in the heading."""
    return math.hypot(*(line.heading_rad for line in limits.lines[:2]))


def test_equal_weights_have_the_slopes_closed_form() -> None:
    for duration_s in (30.0, 120.0, 600.0):
        limits = predict_limits("quest-raw", LATITUDE_RAD, duration_s, SENSORS)
        walk = 6.0 * SENSORS.gyro_noise_rad_sqrt_s**2 / (5.0 * duration_s)
        white = 12.0 * SENSORS.accelerometer_noise_g_sqrt_hz**2 / duration_s**3
        level_rate = EARTH_RATE_RAD_S * np.cos(LATITUDE_RAD)
        expected = np.sqrt(walk + white) / level_rate
        assert noise_rad(limits) == pytest.approx(expected, rel=1e-4)
    limits = predict_limits("quest-raw", LATITUDE_RAD, 120.0, SENSORS)
    assert noise_rad(limits) / ARCMIN == pytest.approx(1.19, abs=0.005)


@pytest.mark.parametrize(("power", "walk", "white"), [(0, 6 / 5, 12.0), (1, 10 / 7, 120 / 7)])
def test_the_tapers_slope_has_its_beta_functions_closed_form(
    power: int, walk: float, white: float
) -> None:
    """With ``a = (1/4 - x^2)^p``: ``white = int a^2 x^2 / D^2``, ``D = int a x^2``."""
    x = np.polynomial.Polynomial([0.0, 1.0])
    for p, gains in ((power, (walk, white)), (2, None)):
        a = (0.25 - x * x) ** p
        integral = [(f.integ()(0.5) - f.integ()(-0.5)) for f in (a * x * x, a * a * x * x)]
        tail = (0.25 - x * x) ** (p + 1) / (2.0 * (p + 1))
        square = (tail * tail).integ()
        exact = (square(0.5) - square(-0.5)) / integral[0] ** 2, integral[1] / integral[0] ** 2
        assert gains is None or exact == pytest.approx(gains)
        response = find_response(_Power(p, "quest" if p == 0 else "taper"), 0, 2000, 1.0 / 2000)
        steps = np.cumsum(response.slope[::-1])
        found = steps @ steps / 2000, response.slope @ response.slope * 2000
        assert found == pytest.approx(exact, rel=1e-5)


class _Power(Method):
    """The taper with a power of its own."""

    def __init__(self, power: int, solver: Solver) -> None:
        super().__init__("raw", solver)
        object.__setattr__(self, "_power", power)

    @property
    def power(self) -> int:
        return int(getattr(self, "_power"))  # noqa: B009


def test_the_taper_costs_what_was_derived() -> None:
    assert noise_rad(predict_limits("quest-taper", LATITUDE_RAD, 120.0, SENSORS)) / ARCMIN == (
        pytest.approx(1.56, abs=0.005)
    )


def test_biases_cost_what_no_observation_can_tell() -> None:
    """0.01 deg/h: 2.95' at 39.1 deg; 5e-5 g: 0.14' and 10.3''."""
    for method in METHODS:
        lines = {x.source: x for x in predict_limits(method, LATITUDE_RAD, 120.0, SENSORS).lines}
        assert lines["gyro bias"].heading_rad / ARCMIN == pytest.approx(2.95, abs=0.006)
        assert lines["accelerometer bias"].heading_rad / ARCMIN == pytest.approx(0.14, abs=0.001)
        assert lines["accelerometer bias"].level_rad / ARCSEC == pytest.approx(10.3, abs=0.02)


def test_the_prediction_does_not_depend_on_the_grid_and_total_is_the_lines_together() -> None:
    limits = predict_limits("quest", LATITUDE_RAD, 120.0, SENSORS, warm_s=60.0)
    fine = find_response(METHODS["quest"], 3000, 6000, 0.02)
    level_rate = EARTH_RATE_RAD_S * np.cos(LATITUDE_RAD)
    white = SENSORS.accelerometer_noise_g_sqrt_hz / np.sqrt(0.02)
    assert limits.lines[1].heading_rad * level_rate == pytest.approx(
        white * np.linalg.norm(fine.slope), rel=0.01
    )
    headings = [line.heading_rad for line in limits.lines]
    assert limits.heading_sigma_rad == pytest.approx(np.linalg.norm(headings))
    levels = [line.level_rad for line in limits.lines]
    assert limits.level_sigma_rad == pytest.approx(np.linalg.norm(levels))
    hopeless = replace(SENSORS, gyro_bias_rad_s=100.0 * EARTH_RATE_RAD_S)
    lost = predict_limits("quest", LATITUDE_RAD, 120.0, hopeless)
    assert lost.heading_sigma_rad == pytest.approx(np.pi / np.sqrt(3.0))


@pytest.mark.parametrize(
    ("method", "warm_s"), [*((name, 0.0) for name in METHODS), ("quest", 60.0), ("triad", 60.0)]
)
def test_noise_does_to_every_method_what_was_predicted(method: str, warm_s: float) -> None:
    """150 alignments of 60 s at rest without bias; the 99.9 % bounds of a sigma from 150."""
    white = replace(SENSORS, gyro_bias_rad_s=0.0, accelerometer_bias_g=0.0)
    limits = predict_limits(method, LATITUDE_RAD, 60.0, white, warm_s)
    count, errors = 150, []
    for seed in range(count):
        record = stream(at_rest, seed, 60.0 + warm_s, white, 0.02)
        errors.append(record.error(record.align(method, warm_s)))
    sigma = np.std(errors, axis=0, mean=0.0)
    bound = 3.29 / np.sqrt(2.0 * count)
    assert sigma[2] == pytest.approx(limits.heading_sigma_rad, rel=bound)
    assert np.max(sigma[:2]) < (1.0 + bound) * limits.level_sigma_rad
    assert np.max(sigma[:2]) > (1.0 - bound) * limits.level_sigma_rad


def test_the_sway_seen_in_the_data_is_what_it_does() -> None:
    """Perfect sensors: all of the error is the base's, and its line within the usual factor."""
    for preset, method, warm_s in (
        (nominal, "quest-raw", 0.0),
        (paper_like, "quest-raw", 0.0),
        (paper_like, "quest", 0.0),
        (paper_like, "optimized-triad", 120.0),
    ):
        ratios = []
        for seed in range(12):
            record = stream(preset, seed, 120.0 + warm_s, PERFECT)
            found = record.align(method, warm_s, sensors=PERFECT)
            ratios.append(record.error(found)[2] / found.heading_sigma_rad)
        assert 0.3 < np.sqrt(np.mean(np.square(ratios))) < 1.6


def test_the_taper_sees_that_the_sway_does_nothing_to_it() -> None:
    for seed in range(5):
        quiet = stream(at_rest, seed).align("quest-taper")
        rocking = stream(nominal, seed).align("quest-taper")
        assert rocking.limits.lines[-1].source == "sway of the base"
        assert rocking.heading_sigma_rad < 1.02 * quiet.heading_sigma_rad


@pytest.mark.parametrize("preset", [at_rest, nominal, paper_like])
def test_the_interval_covers_the_truth(preset: Preset) -> None:
    """20 draws of noise and biases: fewer than 16 inside would come up once in 300 times."""
    inside = [covers(stream(preset, seed), "quest-taper") for seed in range(20)]
    assert np.mean(inside) >= 16 / 20


@pytest.mark.proof
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("preset", [at_rest, nominal, paper_like])
def test_the_interval_covers_the_truth_as_often_as_it_says(
    preset: Preset, record_property: Record
) -> None:
    """200 draws: the taper cold, the paper's two warm."""
    inside = []
    for seed in range(1000, 1200):
        record = stream(preset, seed, 240.0)
        cold = covers(record.later(120.0), "quest-taper")
        inside.append([cold, *(covers(record, name, 120.0) for name in ("quest", "triad"))])
    share = np.mean(inside, axis=0)
    told = ", ".join(f"{100 * each:.1f}" for each in share)
    record_property("measured", f"{preset.__name__.replace('_', '-')}: {told} %")
    assert share.min() >= 0.90
    assert share.max() <= 0.99


def covers(record: Stream, method: str, warm_s: float = 0.0) -> bool:
    found = record.align(method, warm_s)
    return bool(abs(record.error(found)[2]) < 1.96 * found.heading_sigma_rad)


@pytest.mark.parametrize(
    ("bad", "error", "complaint"),
    [
        ({"method": "quest-tapper"}, ValueError, "unknown method .* mean 'quest-taper'"),
        ({"duration_s": 0.0}, ValueError, "duration_s is 0; an alignment takes a positive"),
        ({"duration_s": np.nan}, ValueError, "duration_s is nan"),
        ({"warm_s": 10.0}, ValueError, "warm_s is 10, but quest-taper has no filter to warm"),
        ({"warm_s": -1.0}, ValueError, "warm_s is -1; the filter starts that many"),
        ({"latitude_rad": 39.1}, ValueError, "latitude_rad is 39.1; .* convert degrees"),
        ({"latitude_rad": np.nan}, ValueError, "latitude_rad is nan"),
        ({"latitude_rad": 89.5 * DEG}, EstimationError, "beyond 89 deg; the latitude is 89.5"),
        ({"latitude_rad": -np.pi / 2}, EstimationError, "beyond 89 deg; the latitude is -90"),
    ],
)
def test_what_cannot_be_predicted_is_refused_in_words(
    bad: dict[str, Any], error: type[Exception], complaint: str
) -> None:
    plain: dict[str, Any] = {
        "method": "quest-taper",
        "latitude_rad": LATITUDE_RAD,
        "duration_s": 120.0,
        "sensors": SENSORS,
    }
    with pytest.raises(error, match=complaint):
        predict_limits(**(plain | bad))


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf])
def test_a_sigma_that_is_none_is_refused_in_words(bad: float) -> None:
    with pytest.raises(ValueError, match=f"gyro_bias_rad_s is {bad:g}; a standard deviation"):
        SensorErrors(
            gyro_noise_rad_sqrt_s=0.0,
            accelerometer_noise_g_sqrt_hz=0.0,
            gyro_bias_rad_s=bad,
            accelerometer_bias_g=0.0,
        )
