"""The stream against a dense truth, however it is cut; observations against scipy's turning."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from northfinder.alignment.increments import InertialIncrements
from northfinder.alignment.observations import (
    Observations,
    increments_in_observation,
    reaction_to_gravity,
)
from northfinder.attitude import ConingMotion
from northfinder.units import ARCMIN, DEG
from tests.alignment.bases import ARCSEC, EARTH_RATE_RAD_S, LATITUDE_RAD
from tests.alignment.fans import apart_rad, gravity_fan


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 9), min_size=1, max_size=12))
def test_how_the_stream_is_cut_changes_nothing(seed: int, sizes: list[int]) -> None:
    rng = np.random.default_rng(seed)
    angle, gained = rng.normal(scale=[[[0.02]], [[0.1]]], size=(2, 8 + sum(sizes), 3))
    whole, parts = InertialIncrements(), InertialIncrements()
    expected = whole.add(angle, gained)
    edges = [0, *np.cumsum(sizes), len(angle)]
    pieces = [parts.add(angle[i:j], gained[i:j]) for i, j in pairwise(edges)]
    assert_allclose(np.vstack(pieces), expected, atol=1e-14)
    assert_allclose(parts.attitude, whole.attitude, atol=1e-14)


def test_a_cone_with_a_resting_force_is_resolved_to_its_sculling() -> None:
    """5 deg at 2 Hz, 200/s: without the correction the force would seem to slant by 4'."""
    motion, vector = ConingMotion(5.0 * DEG, 4.0 * np.pi), np.array([0.6, 0.0, 0.8])
    edges_s = 0.005 * np.arange(2001.0)
    stream = InertialIncrements()
    angle, gained = motion.increments(edges_s), motion.body_integrals(vector, edges_s)
    found = stream.add(angle, gained)
    start = Rotation.from_quat(motion.attitude(0.0), scalar_first=True)
    end = start.inv() * Rotation.from_quat(motion.attitude(10.0), scalar_first=True)
    assert apart_rad(stream.attitude, end) < 0.05 * ARCSEC
    mean = found.sum(axis=0) / 10.0
    assert np.abs(mean - start.inv().apply(vector)).max() < 1.0 * ARCSEC
    worst = np.abs(found / 0.005 - start.inv().apply(vector)).max()
    assert worst < 0.5 * ARCMIN
    turned = start.inv() * Rotation.from_quat(motion.attitude(edges_s[:-1]), scalar_first=True)
    uncorrected = turned.apply(gained) / 0.005
    assert np.abs(uncorrected - start.inv().apply(vector)).max() > 20.0 * worst


def test_increments_that_do_not_fit_are_refused_in_words() -> None:
    stream = InertialIncrements()
    with pytest.raises(ValueError, match=r"one velocity for each angle .* \(3, 3\) for \(2, 3\)"):
        stream.add(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="sample 1 holds nan on axis 2; bridge such gaps first"):
        stream.add(np.zeros((2, 3)), [[0.0, 0.0, 1.0], [0.0, 0.0, np.nan]])
    assert stream.add(np.zeros((6, 3)), np.zeros((6, 3))).shape == (0, 3)
    assert stream.add(np.zeros((1, 3)), np.zeros((1, 3))).shape == (7, 3)
    assert stream.add(np.empty((0, 3)), np.empty((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("latitude_deg", [-88.0, -30.0, 0.0, 39.1, 70.0])
def test_gravitys_reaction_is_the_vertical_turned_by_scipy(latitude_deg: float) -> None:
    time_s, fan = gravity_fan(86400.0, 1000, latitude_deg * DEG)
    now = reaction_to_gravity(latitude_deg * DEG, time_s, time_s)
    assert_allclose(now, fan, atol=1e-14)


def test_over_an_interval_it_is_the_mean() -> None:
    nodes, weights = np.polynomial.legendre.leggauss(20)
    axis = np.array([0.0, np.cos(LATITUDE_RAD), np.sin(LATITUDE_RAD)])
    at_s = 5000.0 + 4000.0 * nodes
    turns = Rotation.from_rotvec(EARTH_RATE_RAD_S * at_s[:, np.newaxis] * axis)
    expected = 0.5 * weights @ turns.apply([0.0, 0.0, 1.0])
    found = reaction_to_gravity(LATITUDE_RAD, [1000.0], [9000.0])
    assert_allclose(found[0], expected, atol=1e-14)


@pytest.mark.parametrize(
    ("dt", "each"), [(0.001, 20), (0.002, 10), (0.008, 2), (0.01, 2), (0.02, 1), (0.5, 1)]
)
def test_an_observation_sums_up_to_a_fiftieth_of_a_second(dt: float, each: int) -> None:
    assert increments_in_observation(dt) == each


@pytest.mark.parametrize("form", ["raw", "velocity", "low-passed"])
def test_every_form_keeps_w_is_a_v_and_its_chunks_do_not_show(form: str) -> None:
    _, V = gravity_fan(120.0, 6000)
    A = Rotation.random(rng=np.random.default_rng(1))
    whole = Observations(form, 0.02)  # type: ignore[arg-type]
    w, v = whole.add(A.apply(V), V)
    # The filter's poles lie 6e-4 from 1: its states magnify rounding thousands of times.
    assert np.abs(w - A.apply(v)).max() < 3e-6 * ARCSEC * np.abs(v).max()
    cut = Observations(form, 0.02)  # type: ignore[arg-type]
    parts = [cut.add(A.apply(V[i : i + 700]), V[i : i + 700]) for i in range(0, 6000, 700)]
    assert_allclose(np.vstack([p[0] for p in parts]), w, rtol=1e-12, atol=1e-15)
    assert (form == "raw") == np.array_equal(v, V)


def test_the_low_pass_is_the_papers() -> None:
    """Through at 0.005 Hz, stopped by 40 dB at 0.1 Hz; half the power at its corner."""
    time_s = 0.02 * np.arange(150_000.0)
    for hz, low, high in ((0.005, 0.88, 0.90), (0.00701, 0.70, 0.71), (0.1, 0.004, 0.006)):
        tone = np.sin(2.0 * np.pi * hz * time_s)[:, np.newaxis] * np.ones(3)
        passed, _ = Observations("low-passed", 0.02).add(tone, tone)
        assert low < np.abs(passed[100_000:]).max() < high
