"""A sensor that is faulty errs as its faults say, and a footstep leaves the floor as it was."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from drivers.interfaces import FloatArray
from sim.bench import Bench, BenchSensor, Mounting
from sim.footstep import Footstep
from sim.interfaces import Felt
from sim.motion import Plate
from sim.noise import NoiseLevels
from sim.truth import Truth

DEG = np.pi / 180
DEG_PER_HOUR = DEG / 3600
PERIOD_S = 0.001
SECOND = 1000  # samples
NOISE = NoiseLevels(white_sqrt_s=1e-6)
LEVEL = Truth(40 * DEG, 0.0, 0.0, 0.0, gravity_m_s2=9.80665)


def bench() -> Bench:
    return Bench(LEVEL, Plate(0.0, 0.0, np.random.default_rng(1)))


def sensor(noise: NoiseLevels = NOISE, on: Bench | None = None) -> BenchSensor:
    return BenchSensor(on or bench(), Mounting("y"), noise, noise, np.random.default_rng(2))


def sense(of: BenchSensor, from_s: float = 0.0, count: int = SECOND) -> Felt:
    return of.sense(ends_s(from_s, count), PERIOD_S)


def ends_s(from_s: float, count: int) -> FloatArray:
    times: FloatArray = from_s + np.arange(1, count + 1).astype(np.float64) * PERIOD_S
    return times


def test_a_frozen_sensor_repeats_its_last_reading_until_it_thaws() -> None:
    ours, sound = sensor(), sensor()
    before = sense(ours)
    sense(sound)
    ours.faults.frozen = True
    for part, last in zip(sense(ours, 1.0), before, strict=True):
        assert_array_equal(part, np.repeat(last[-1:], SECOND, axis=0))
    ours.faults.frozen = False
    sense(sound, 1.0)
    assert_array_equal(sense(ours, 2.0).rate_rad_s, sense(sound, 2.0).rate_rad_s)


def test_spikes_come_as_often_as_they_shall_and_are_single_samples() -> None:
    ours, sound = sensor(), sensor()
    ours.faults.spikes_per_s, ours.faults.spike_rad_s = 20.0, 5 * DEG
    off = sense(ours, count=60 * SECOND).rate_rad_s - sense(sound, count=60 * SECOND).rate_rad_s
    hit = np.abs(off[:, 1]) > 1e-9
    assert np.count_nonzero(hit) == pytest.approx(1200, abs=5 * np.sqrt(1200))
    assert_allclose(np.abs(off[hit]), 5 * DEG)
    assert 0.3 < np.mean(off[hit] > 0.0) < 0.7


def test_a_saturated_gyro_reads_its_limit_and_its_accelerometers_go_on() -> None:
    ours, sound = sensor(), sensor()
    ours.faults.limit_rad_s = 8 * DEG_PER_HOUR
    read, true = sense(ours), sense(sound)
    limit = 8 * DEG_PER_HOUR
    assert_array_equal(read.rate_rad_s, np.clip(true.rate_rad_s, -limit, limit))
    assert np.any(true.rate_rad_s > limit)
    assert_array_equal(read.specific_force_g, true.specific_force_g)


def test_a_drift_begins_where_it_is_set_and_grows_as_the_closed_form_says() -> None:
    ours, sound = sensor(), sensor()
    for of in (ours, sound):
        sense(of)
    ours.faults.drift_rad_s2, ours.faults.curvature_rad_s3 = 1e-6, 3e-7
    gained = sense(ours, 1.0, 5 * SECOND).rate_rad_s - sense(sound, 1.0, 5 * SECOND).rate_rad_s
    t = ends_s(0.0, 5 * SECOND)[:, np.newaxis]
    assert_allclose(gained, np.repeat(1e-6 * t + 3e-7 * t**2, 3, axis=1), atol=1e-18)


def test_a_footstep_tilts_back_to_where_it_was() -> None:
    """Its rate integrates to nothing; what the direction that rises feels is g times the tilt."""
    quiet = NoiseLevels()
    floor = bench()
    ours, sound = sensor(quiet, floor), sensor(quiet)
    before = sense(sound, count=3 * SECOND)
    floor.step_beside(Footstep(0.5, 0.02 * DEG))
    felt = sense(ours, count=3 * SECOND)
    rate = felt.rate_rad_s - before.rate_rad_s
    force = felt.specific_force_g - before.specific_force_g
    assert_array_equal(rate[:500], 0.0)
    # The y axis lies along the mark, which rises: so the turn is about x, and gravity on y.
    assert_array_equal(rate[:, 1:], 0.0)
    tilt_rad = np.cumsum(rate[:, 0]) * PERIOD_S
    assert 0.01 * DEG < np.max(np.abs(tilt_rad)) < 0.02 * DEG
    assert_allclose(force[:, 1], tilt_rad, atol=1e-15)
    assert abs(tilt_rad[-1]) < 1e-5 * np.max(np.abs(tilt_rad))
    assert 0.3 * DEG < np.max(np.abs(rate)) < 1.0 * DEG
