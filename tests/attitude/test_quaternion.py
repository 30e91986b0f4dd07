"""Quaternion identities against scipy's Rotation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from northfinder.attitude.quaternion import (
    conjugate,
    from_rotation_vector,
    multiply,
    normalise,
    rotate,
    to_matrix,
    to_rotation_vector,
)
from northfinder.attitude.scan import cumulative_product
from tests.attitude.motions import Array, rotation

seeds = st.integers(0, 2**32 - 1)
small_or_large = st.floats(-10.0, 0.49)  # decimal exponent of an angle up to 3.1 rad


def random_rotations(seed: int, count: int = 5) -> tuple[Array, Rotation]:
    theirs = Rotation.random(count, rng=np.random.default_rng(seed))
    ours: Array = theirs.as_quat(scalar_first=True)
    return ours, theirs


def same_up_to_sign(q: Array, p: Array) -> None:
    sign = np.sign(np.sum(q * p, axis=-1, keepdims=True))
    assert_allclose(q, sign * p, atol=1e-15)


@given(seeds)
def test_the_product_is_the_rotation_by_the_second_and_then_the_first(seed: int) -> None:
    (p, their_p), (q, their_q) = random_rotations(seed), random_rotations(seed + 1)
    same_up_to_sign(multiply(p, q), (their_p * their_q).as_quat(scalar_first=True))


@given(seeds)
def test_the_conjugate_is_the_inverse(seed: int) -> None:
    q, theirs = random_rotations(seed)
    same_up_to_sign(conjugate(q), theirs.inv().as_quat(scalar_first=True))
    identity = np.broadcast_to([1.0, 0.0, 0.0, 0.0], (5, 4))
    assert_allclose(multiply(q, conjugate(q)), identity, atol=1e-15)


@given(seeds)
def test_rotating_a_vector_is_applying_the_rotation(seed: int) -> None:
    q, theirs = random_rotations(seed)
    v = np.random.default_rng(seed).normal(size=(5, 3))
    assert_allclose(rotate(q, v), theirs.apply(v), atol=5e-15)
    assert_allclose(to_matrix(q[0]), theirs[0].as_matrix(), atol=5e-15)


@given(seeds, small_or_large)
def test_a_rotation_vector_survives_both_ways_however_small(seed: int, exponent: float) -> None:
    direction = np.random.default_rng(seed).normal(size=(5, 3))
    phi = 10.0**exponent * direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    q = from_rotation_vector(phi)
    same_up_to_sign(q, Rotation.from_rotvec(phi).as_quat(scalar_first=True))
    assert_allclose(to_rotation_vector(q), phi, rtol=1e-13, atol=1e-13 * 10.0**exponent)
    assert_allclose(to_rotation_vector(-q), phi, rtol=1e-13, atol=1e-13 * 10.0**exponent)


def test_no_rotation_is_the_identity_both_ways() -> None:
    assert_allclose(from_rotation_vector([0.0, 0.0, 0.0]), [1.0, 0.0, 0.0, 0.0], rtol=0.0)
    assert_allclose(to_rotation_vector([1.0, 0.0, 0.0, 0.0]), np.zeros(3), rtol=0.0)


def test_products_and_rotations_broadcast() -> None:
    q, theirs = random_rotations(7)
    v = np.eye(3)
    assert_allclose(rotate(q[:, np.newaxis], v), [r.apply(v) for r in theirs], atol=1e-15)
    assert multiply(q[:, np.newaxis], q).shape == (5, 5, 4)


@given(seeds, st.integers(1, 400))
def test_the_blocked_scan_is_the_product_one_by_one(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    steps = normalise(random.normal(size=(count + 1, 4)))
    pairs = steps.view(np.complex128)
    a, b = cumulative_product((pairs[0, 0], pairs[0, 1]), (pairs[1:, 0], pairs[1:, 1]))
    scanned = np.stack([a, b], axis=-1).view(np.float64)
    now = steps[0]
    for step, found in zip(steps[1:], scanned, strict=True):
        now = multiply(now, step)
        assert_allclose(found, now, atol=1e-13)


def test_a_zero_quaternion_has_no_direction() -> None:
    assert_allclose(normalise([0.0, 0.0, 3.0, 4.0]), [0.0, 0.0, 0.6, 0.8])
    for q in ([0.0] * 4, [np.nan, 0.0, 0.0, 1.0]):
        with pytest.raises(ValueError, match="no direction"):
            normalise(q)


def test_a_quarter_turn_about_up_takes_the_bodys_x_to_the_references_y() -> None:
    q = from_rotation_vector([0.0, 0.0, np.pi / 2])
    assert_allclose(rotate(q, [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0], atol=1e-15)
    assert_allclose(rotation(q).apply([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0], atol=1e-15)
