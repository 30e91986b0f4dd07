"""Whichever way a sensor is bolted on, it feels the turning Earth, gravity and the table."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from drivers.interfaces import FloatArray
from sim.bench import Bench, BenchSensor, Mounting
from sim.motion import Plate
from sim.noise import NoiseLevels
from sim.truth import Truth

DEG = np.pi / 180
STANDARD_GRAVITY = 9.80665
TRUTH = Truth(40 * DEG, 48 * DEG, 8 * DEG, -12 * DEG, gravity_m_s2=9.8017)
PERIOD_S = 0.001
NANO_EARTH_RATE = 1e-9 * 7.292115e-5
NANO_G = 1e-9

AXES = ["x", "y", "z", "-x", "-y", "-z"]
mounted = pytest.mark.parametrize(
    "mounting", [Mounting(axis, angle * DEG) for axis in AXES for angle in (0, 35, -110)], ids=str
)


def at_rest(angle_rad: float, *, clockwise: bool = False) -> Bench:
    return Bench(TRUTH, Plate(angle_rad, 0.0, np.random.default_rng(1)), clockwise=clockwise)


def sensed(mounting: Mounting, vector: FloatArray) -> float:
    """Return the component along the sensing axis, which a sign may turn round."""
    sign = -1.0 if mounting.axis.startswith("-") else 1.0
    return sign * float(vector["xyz".index(mounting.axis[-1])])


def periods(count: int) -> FloatArray:
    """Return the ends of consecutive periods from time zero on."""
    return np.arange(1, count + 1).astype(np.float64) * PERIOD_S


def feel(bench: Bench, mounting: Mounting) -> tuple[FloatArray, FloatArray]:
    rate, force = bench.felt(mounting, np.array([0.5]), PERIOD_S)
    return rate[0], force[0]


@pytest.mark.parametrize("axis", AXES)
def test_the_body_axes_are_a_right_handed_triad_with_one_axis_up(axis: str) -> None:
    axes = Mounting(axis).body_axes()
    assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert np.any(np.all(axes == [0.0, 0.0, 1.0], axis=1))


@mounted
@pytest.mark.parametrize("table_deg", [0, 15, 123, 290])
def test_the_sensing_axis_reads_the_papers_harmonic(mounting: Mounting, table_deg: float) -> None:
    angle_rad = table_deg * DEG
    rate, force = feel(at_rest(angle_rad), mounting)
    cos, sin = (f(angle_rad + mounting.angle_rad) for f in (np.cos, np.sin))
    for felt, vector_t, tolerance in (
        (rate, TRUTH.earth_rate_t(), NANO_EARTH_RATE),
        (force, TRUTH.specific_force_t(), NANO_G),
    ):
        a, b = vector_t[1], -vector_t[0]
        assert sensed(mounting, felt) == pytest.approx(a * cos + b * sin, abs=tolerance)


@mounted
def test_the_body_feels_the_same_vectors_however_it_is_mounted(mounting: Mounting) -> None:
    rate, force = feel(at_rest(1.0), mounting)
    assert np.linalg.norm(force) == pytest.approx(9.8017 / STANDARD_GRAVITY, abs=NANO_G)
    assert np.linalg.norm(rate) == pytest.approx(7.292115e-5, abs=NANO_EARTH_RATE)
    assert rate @ force == pytest.approx(
        TRUTH.earth_rate_t() @ TRUTH.specific_force_t(), abs=NANO_EARTH_RATE
    )


@mounted
@pytest.mark.parametrize("clockwise", [False, True])
def test_a_table_at_rest_is_felt_the_same_while_and_after_it_may_ring(
    mounting: Mounting, clockwise: bool
) -> None:
    bench = at_rest(1.0, clockwise=clockwise)
    early, late = (bench.felt(mounting, start_s + periods(50), PERIOD_S) for start_s in (0.0, 60.0))
    for first, second in zip(early, late, strict=True):
        assert first.shape == second.shape == (50, 3)
        assert_allclose(first, second, rtol=1e-15, atol=1e-20)


@pytest.mark.parametrize(("clockwise", "sign"), [(False, 1.0), (True, -1.0)])
@pytest.mark.parametrize("axis", AXES)
def test_a_turning_table_integrates_to_its_angle_about_the_axis_that_points_up(
    axis: str, clockwise: bool, sign: float
) -> None:
    bench = at_rest(0.0, clockwise=clockwise)
    bench.plate.move_to(0.7, speed_rad_s=0.5, acceleration_rad_s2=2.0, now_s=0.0)
    rate, _ = bench.felt(Mounting(axis), periods(5000), PERIOD_S)
    turned = rate.sum(axis=0) * PERIOD_S
    up = np.argmax(Mounting(axis).body_axes()[:, 2])
    earth_rad = 5.0 * TRUTH.earth_rate_t()[2]
    assert turned[up] - earth_rad == pytest.approx(sign * 0.7, abs=1e-9)
    assert np.max(np.abs(np.delete(turned, up))) < 5.0 * 7.3e-5


def test_on_a_table_that_counts_clockwise_a_positive_angle_brings_the_mark_to_the_right() -> None:
    rate, force = feel(at_rest(90 * DEG, clockwise=True), Mounting("y"))
    x_t, _, _ = TRUTH.earth_rate_t()
    assert rate[1] == pytest.approx(x_t, abs=NANO_EARTH_RATE)
    assert force[1] == pytest.approx(TRUTH.specific_force_t()[0], abs=NANO_G)


def test_the_mean_rate_over_a_period_is_taken_at_its_middle() -> None:
    bench = at_rest(0.0)
    bench.plate.move_to(100.0, speed_rad_s=1.0, acceleration_rad_s2=1e6, now_s=0.0)
    rate, _ = bench.felt(Mounting("y"), np.array([2.0]), 1.0)
    middle_rad = float(bench.plate.angle_rad(np.array([1.0, 2.0])).mean())
    x_t, y_t, _ = TRUTH.earth_rate_t()
    assert rate[0, 1] == pytest.approx(
        y_t * np.cos(middle_rad) - x_t * np.sin(middle_rad), abs=NANO_EARTH_RATE
    )


def test_a_sensor_without_noise_reads_what_is_felt_and_one_with_noise_has_its_own() -> None:
    bench, time_s = at_rest(1.0), periods(100)
    rate, force = bench.felt(Mounting("x"), time_s, PERIOD_S)

    def sensor(white: float, seed: int) -> BenchSensor:
        noise = NoiseLevels(white_sqrt_s=white)
        return BenchSensor(bench, Mounting("x"), noise, noise, np.random.default_rng(seed))

    ideal = sensor(0.0, seed=1).sense(time_s, PERIOD_S)
    assert_allclose(ideal.rate_rad_s, rate, rtol=0)
    assert_allclose(ideal.specific_force_g, force, rtol=0)
    assert ideal.temperature_deg_c.shape == (100,)
    first, second = (sensor(1e-6, seed).sense(time_s, PERIOD_S) for seed in (1, 2))
    assert not np.any(first.rate_rad_s == second.rate_rad_s)
    assert not np.any(first.rate_rad_s - rate == first.specific_force_g - force)
