"""TRIAD and Optimized TRIAD against ahrs, closed forms and the statistics of their paper."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from northfinder.alignment import optimized_triad, quest, triad
from northfinder.attitude.quaternion import rotate
from northfinder.errors import EstimationError
from tests.alignment.bases import ARCSEC, Array
from tests.alignment.fans import apart_rad, gravity_fan

Solver = Callable[..., Array]
SOLVERS = pytest.mark.parametrize("solver", [triad, optimized_triad])


def noisy_pair(seed: int, noise: float) -> tuple[Array, Array, Rotation]:
    rng = np.random.default_rng(seed)
    V = rng.normal(size=(2, 3))
    truth = Rotation.random(rng=rng)
    return truth.apply(V) + noise * rng.normal(size=(2, 3)), V, truth


@SOLVERS
@given(st.integers(0, 2**32 - 1))
def test_without_noise_the_rotation_comes_back(solver: Solver, seed: int) -> None:
    W, V, truth = noisy_pair(seed, 0.0)
    sine = np.linalg.norm(np.cross(*V)) / np.prod(np.linalg.norm(V, axis=1))
    assert apart_rad(solver(W, V), truth) < 1e-14 / sine


@given(st.integers(0, 2**32 - 1))
def test_triad_is_that_of_ahrs(seed: int) -> None:
    W, V, _ = noisy_pair(seed, 0.2)
    theirs = import_module("ahrs.filters").TRIAD(*W, v1=V[0], v2=V[1]).A
    assert apart_rad(triad(W, V), Rotation.from_matrix(theirs)) < 1e-12


def test_triad_meets_the_heavier_direction_and_in_a_tie_the_first() -> None:
    W, V, _ = noisy_pair(1, 0.2)
    unit = W / np.linalg.norm(W, axis=1, keepdims=True)
    for weights, met in ((None, 0), ([1.0, 1.0], 0), ([1.0, 2.0], 1), ([2.0, 1.0], 0)):
        q = triad(W, V, weights)
        found = rotate(q, V / np.linalg.norm(V, axis=1, keepdims=True))
        assert np.abs(found[met] - unit[met]).max() < 1e-15
        assert np.abs(found[1 - met] - unit[1 - met]).max() > 1e-3


def test_optimized_triad_lies_between_the_two_triads_as_the_weights_say() -> None:
    """Small errors: the turn about the common normal is shared out by weight."""
    W, V, _ = noisy_pair(2, 1e-4)
    first, second = (
        Rotation.from_quat(triad(W, V, w), scalar_first=True) for w in ([1, 0], [0, 1])
    )
    between = (first.inv() * second).as_rotvec()
    for weights, share in ((None, 0.5), ([3.0, 1.0], 0.25), ([1.0, 3.0], 0.75), ([1, 0], 0.0)):
        expected = first * Rotation.from_rotvec(share * between)
        assert apart_rad(optimized_triad(W, V, weights), expected) < 1e-12


def test_optimized_triad_is_the_optimum_of_two_unit_directions_to_second_order() -> None:
    W, V, _ = noisy_pair(3, 1e-5)
    W, V = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (W, V))
    ours = Rotation.from_quat(optimized_triad(W, V, [3.0, 1.0]), scalar_first=True)
    assert apart_rad(quest(W, V, [3.0, 1.0]), ours) < 1e-9


@SOLVERS
def test_half_a_turn_and_a_narrow_pair(solver: Solver) -> None:
    _, fan = gravity_fan(120.0, 2)
    for axis in np.vstack([np.eye(3), [[0.6, 0.8, 0.0]]]):
        truth = Rotation.from_rotvec(np.pi * axis)
        assert apart_rad(solver(truth.apply(np.eye(3)[:2]), np.eye(3)[:2]), truth) < 1e-12
        assert apart_rad(solver(truth.apply(fan), fan), truth) < 1e-5 * ARCSEC


@SOLVERS
def test_many_pairs_at_once_are_each_the_single_one(solver: Solver) -> None:
    rng = np.random.default_rng(4)
    V = rng.normal(size=(20, 2, 3))
    W = V + 0.1 * rng.normal(size=V.shape)
    weights = rng.exponential(size=(20, 2))
    for found, w, v, a in zip(solver(W, V, weights), W, V, weights, strict=True):
        np.testing.assert_allclose(found, solver(w, v, a), atol=1e-14)


@SOLVERS
@pytest.mark.parametrize(
    ("bad", "error", "complaint"),
    [
        ({"W": np.eye(3), "V": np.eye(3)}, ValueError, "two pairs; got 3: choose two, or use"),
        ({"W": [[1.0, 0.0, 0.0], [np.nan, 0.0, 0.0]]}, ValueError, r"W holds nan at index \(1, 0"),
        ({"V": [[1.0, 0.0, 0.0], [0.0, np.inf, 0.0]]}, ValueError, r"V holds inf at index \(1, 1"),
        ({"weights": [-1.0, 2.0]}, ValueError, "a weight is -1; "),
        ({"W": [[1.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]}, EstimationError, "two vectors of W are para"),
        ({"V": [[1.0, 2.0, 0.0], [1.0, 2.0, 0.0]]}, EstimationError, "two vectors of V are para"),
        ({"V": [[1.0, 2.0, 0.0], [0.0, 0.0, 0.0]]}, EstimationError, "a vector of V is zero"),
    ],
)
def test_pairs_that_determine_nothing_are_refused_in_words(
    solver: Solver, bad: dict[str, Any], error: type[Exception], complaint: str
) -> None:
    with pytest.raises(error, match=complaint):
        solver(**({"W": np.eye(3)[:2], "V": np.eye(3)[:2]} | bad))
