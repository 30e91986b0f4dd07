"""Wahba's problem against scipy's align_vectors, in wide and narrow fans, at every angle."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from northfinder.alignment import davenport, quest, svd
from northfinder.attitude.quaternion import conjugate, rotate
from northfinder.errors import EstimationError
from tests.alignment.bases import ARCSEC, Array
from tests.alignment.fans import apart_rad, gravity_fan
from tests.evidence import Record

Solver = Callable[..., Array]
SOLVERS = pytest.mark.parametrize("solver", [quest, davenport, svd])
X, Y, Z = np.eye(3)


def test_q_takes_the_frame_of_v_to_the_frame_of_w() -> None:
    """The base stands a quarter turn to the left of north: its right is north, its front west."""
    seen_b, known_n = [Z, X], [Z, Y]
    q = quest(seen_b, known_n)
    assert apart_rad(q, Rotation.from_rotvec(-0.5 * np.pi * Z)) < 1e-15
    body_to_n = conjugate(q)
    np.testing.assert_allclose(rotate(body_to_n, Y), -X, atol=1e-15)


@SOLVERS
@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.floats(0.0, 0.5))
def test_the_optimum_is_scipys(solver: Solver, seed: int, pairs: int, noise: float) -> None:
    """Vectors of any length, any weights, some of them zero."""
    rng = np.random.default_rng(seed)
    V = rng.normal(size=(pairs, 3))
    W = Rotation.random(rng=rng).apply(V) + noise * rng.normal(size=V.shape)
    weights = rng.exponential(size=pairs) * (np.arange(pairs) != 2)
    theirs, _, sensitivity = Rotation.align_vectors(W, V, weights=weights, return_sensitivity=True)
    scale = float(np.abs(sensitivity).max() * weights.sum())
    q = solver(W, V, weights)
    assert q[0] >= 0.0
    assert apart_rad(q, theirs) < 1e-13 * max(1.0, scale)


@SOLVERS
@pytest.mark.parametrize("axis", [X, Y, Z, X + Y, Y - Z, X + Y + Z, 0.1 * X - 2.0 * Y + 1e-9 * Z])
@pytest.mark.parametrize("short_of_rad", [0.0, 1e-16, 1e-12, 1e-8, 1e-4])
def test_half_a_turn_is_as_good_as_any(
    solver: Solver, axis: Array, short_of_rad: float, record_property: Record
) -> None:
    turn = Rotation.from_rotvec((np.pi - short_of_rad) * axis / np.linalg.norm(axis))
    V = np.random.default_rng(3).normal(size=(5, 3))
    off_rad = apart_rad(solver(turn.apply(V), V), turn)
    record_property("measured", f"{off_rad:.1e} rad")
    assert off_rad < 1e-12


@SOLVERS
@pytest.mark.parametrize(
    ("duration_s", "limit_rad"),
    [
        (0.02, 5e-12),
        (0.1, 1e-12),
        (1.0, 5e-13),
        (10.0, 5e-14),
        (30.0, 1e-14),
        (120.0, 1e-10),
        (1200.0, 1e-12),
    ],
)
def test_a_narrow_fan_costs_no_digits(solver: Solver, duration_s: float, limit_rad: float) -> None:
    """Textbook QUEST errs by 10'' in the worst tenth of attitudes at 120 s, by minutes at 30 s."""
    rng = np.random.default_rng(4)
    _, V = gravity_fan(duration_s, 750)
    for turn in Rotation.random(60, rng=rng):
        assert apart_rad(solver(turn.apply(V), V), turn) < limit_rad


def test_a_noisy_narrow_fan_has_scipys_optimum() -> None:
    rng = np.random.default_rng(5)
    for duration_s in (10.0, 120.0):
        _, V = gravity_fan(duration_s, 1500)
        W = Rotation.random(rng=rng).apply(V + 1e-4 * rng.normal(size=V.shape))
        assert apart_rad(quest(W, V), Rotation.align_vectors(W, V)[0]) < 2e-3 * ARCSEC


@pytest.mark.parametrize("solver", [quest, davenport, svd])
def test_many_problems_at_once_are_each_the_single_one(solver: Solver) -> None:
    rng = np.random.default_rng(6)
    V = rng.normal(size=(4100, 2, 3))
    V[7] = V[7, 0] + 1e-5 * V[7]  # the eigenvalues nearly meet
    V[8] = V[8, 0] + 3e-4 * V[8]
    W = V @ Rotation.random(rng=rng).as_matrix() + 0.1 * rng.normal(size=V.shape)
    weights = rng.exponential(size=(4100, 2))
    found = solver(W, V, weights)
    assert found.shape == (4100, 4)
    for i in (0, 7, 8, 2047, 2048, 4099):
        single = Rotation.from_quat(solver(W[i], V[i], weights[i]), scalar_first=True)
        assert apart_rad(found[i], single) < 1e-9
    block = (2, 50)
    folded = solver(*(x[:100].reshape(*block, *x.shape[1:]) for x in (W, V, weights)))
    np.testing.assert_allclose(folded.reshape(100, 4), found[:100], atol=1e-9)


def test_weights_count_only_against_each_other() -> None:
    rng = np.random.default_rng(7)
    V = rng.normal(size=(6, 3))
    W = V + 0.1 * rng.normal(size=V.shape)
    weights = rng.exponential(size=6)
    np.testing.assert_allclose(quest(W, V, 1e9 * weights), quest(W, V, weights), atol=1e-14)
    np.testing.assert_allclose(quest(W, V, np.full(6, 3.0)), quest(W, V), atol=1e-14)


@SOLVERS
@pytest.mark.parametrize(("w", "v"), [(1e3, 1e-3), (9.8, 1.0), (1e90, 1e90), (1e-90, 1e-90)])
def test_units_do_not_count(solver: Solver, w: float, v: float) -> None:
    turn = Rotation.random(rng=np.random.default_rng(7))
    for fan in (gravity_fan(30.0, 750)[1], np.random.default_rng(8).normal(size=(6, 3))):
        assert apart_rad(solver(w * turn.apply(fan), v * fan), turn) < 1e-14


def test_a_reflection_still_gives_the_best_rotation() -> None:
    rng = np.random.default_rng(8)
    V = rng.normal(size=(30, 3))
    W = Rotation.random(rng=rng).apply(V) * [1.0, 1.0, -1.0] + 0.3 * V
    theirs = Rotation.align_vectors(W, V)[0]
    for solver in (quest, davenport, svd):
        assert apart_rad(solver(W, V), theirs) < 1e-12


@SOLVERS
@pytest.mark.parametrize(
    ("bad", "complaint"),
    [
        ({"W": np.zeros(3)}, r"W needs shape \(k, 3\), one row a vector; it has \(3,\)"),
        ({"V": np.zeros((4, 2))}, r"V needs shape \(k, 3\)"),
        ({"W": np.eye(3)[:2]}, r"same shape, .* got \(2, 3\) and \(3, 3\)"),
        ({"W": [X], "V": [X]}, "leaves the turn about it open: give two pairs, not 1"),
        ({"W": np.diag([1.0, np.nan, 1.0])}, r"W holds nan at index \(1, 1\); leave such"),
        ({"V": np.diag([1.0, 1.0, np.inf])}, r"V holds (inf|nan) at index \(2, "),
        ({"W": np.diag([1e200, 1.0, 1.0]), "V": np.diag([1e200, 1.0, 1.0])}, "overflow; scale"),
        ({"weights": [1.0, -0.5, 1.0]}, r"a weight is -0\.5; .* cannot be negative"),
        ({"weights": [0.0, 0.0, 0.0]}, "weights are all zero: no pair counts"),
        ({"weights": [1.0, np.nan, 1.0]}, r"weights holds nan at index \(1,\)"),
        ({"weights": [1.0, 1.0]}, r"one number for each of 3 pairs; they have \(2,\)"),
        ({"weights": np.ones((2, 3))}, r"one number for each of 3 pairs; they have \(2, 3\)"),
        ({"weights": 1.0}, r"they have \(\)"),
    ],
)
def test_bad_pairs_are_refused_in_words(
    solver: Solver, bad: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        solver(**({"W": np.eye(3), "V": np.eye(3)} | bad))


@SOLVERS
@pytest.mark.parametrize(
    "parallel",
    [
        [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [3.0, 0.0, 0.0]],
        [[0.6, 0.0, 0.8], [1.2, 0.0, 1.6]],
        [[0.0, 0.0, 1.0], [1e-8, 0.0, 1.0]],
        [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ],
)
def test_parallel_vectors_are_refused_in_words(solver: Solver, parallel: list[list[float]]) -> None:
    turn = Rotation.random(rng=np.random.default_rng(9))
    with pytest.raises(EstimationError, match=r"parallel, .* turn; observe longer, or add another"):
        solver(turn.apply(parallel), parallel)


def test_parallel_vectors_of_any_direction_are_refused() -> None:
    """Where the eigenvalues are the same, Newton never settles."""
    rng = np.random.default_rng(10)
    for direction, length in zip(
        rng.normal(size=(50, 3)), rng.normal(size=(50, 4, 1)), strict=True
    ):
        with pytest.raises(EstimationError, match="parallel"):
            quest(length * direction, length * Z)


@SOLVERS
@given(st.integers(0, 2**32 - 1))
def test_a_mirrored_cross_is_refused(solver: Solver, seed: int) -> None:
    """Every direction turned round: three eigenvalues are the same, and no rotation is best."""
    V = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    with pytest.raises(EstimationError, match="W mirrors V"):
        solver(-V, V)


@SOLVERS
def test_weights_that_leave_one_direction_are_refused(solver: Solver) -> None:
    with pytest.raises(EstimationError, match="parallel"):
        solver(np.eye(3), np.eye(3), [0.0, 1.0, 0.0])
