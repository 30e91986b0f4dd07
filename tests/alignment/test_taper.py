"""Taper QUEST against scipy on the same weights, as the pairs come and all at once."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from northfinder.alignment import TaperQuest, davenport
from northfinder.errors import EstimationError
from tests.alignment.bases import ARCSEC, Array
from tests.alignment.fans import apart_rad, gravity_fan
from tests.evidence import Record


def swaying(duration_s: float, seed: int) -> tuple[Array, Array, Array]:
    """Times, W and V: a sway of 2e-4 g at 0.17 Hz and noise, seen from any attitude."""
    rng = np.random.default_rng(seed)
    time_s, V = gravity_fan(duration_s, round(50.0 * duration_s))
    sway = np.sin(2.0 * np.pi * 0.17 * time_s + rng.uniform(0.0, 6.0))[:, np.newaxis]
    W = V + 2e-4 * sway * rng.normal(size=3) + 5e-5 * rng.normal(size=V.shape)
    return time_s, Rotation.random(rng=rng).apply(W), V


@pytest.mark.parametrize("power", [0, 1, 2])
@pytest.mark.parametrize("duration_s", [10.0, 30.0, 120.0, 300.0])
def test_level_and_heading_are_scipys_on_the_same_weights(
    power: int, duration_s: float, record_property: Record
) -> None:
    for seed in range(10):
        time_s, W, V = swaying(duration_s, seed)
        taper = TaperQuest(power)
        taper.add(time_s, W, V)
        weights = (time_s * (duration_s - time_s)).clip(0.0) ** power
        theirs = Rotation.align_vectors(W, V, weights=weights)[0]
        ours = Rotation.from_quat(taper.solve(), scalar_first=True)
        east, north, up = np.abs((theirs.inv() * ours).as_rotvec())
        level_arcsec, heading_arcsec = np.hypot(east, north) / ARCSEC, up / ARCSEC
        told = f'level {level_arcsec:.1e}", heading {heading_arcsec:.1e}"'
        record_property("measured", told)
        assert level_arcsec < 5e-3
        assert heading_arcsec < 1e-4


@given(st.integers(0, 2**32 - 1), st.sampled_from([0, 1, 2]), st.floats(0.0, 0.3))
def test_it_maximises_the_anchored_gain(seed: int, power: int, noise: float) -> None:
    """``B = w v' + C/|C|`` has three singular pairs; Davenport's matrix knows its optimum."""
    rng = np.random.default_rng(seed)
    time_s, V = np.sort(rng.uniform(0.0, 90.0, 12)), rng.normal([0.0, 0.0, 3.0], size=(12, 3))
    W = Rotation.random(rng=rng).apply(V + noise * rng.normal(size=V.shape))
    taper = TaperQuest(power)
    taper.add(time_s, W, V)
    a = (time_s * (100.0 - time_s)) ** power
    middle = [a @ x / a.sum() for x in (W, V)]
    w, v = (x / np.linalg.norm(x) for x in middle)
    C = ((W - middle[0]) * a[:, np.newaxis]).T @ (V - middle[1])
    C = (np.eye(3) - np.outer(w, w)) @ C @ (np.eye(3) - np.outer(v, v))
    left, size, right = np.linalg.svd(C)
    pairs = [np.vstack([w, left.T]), np.vstack([v, right])]
    gains = [1.0, *(size / np.linalg.norm(C))]
    expected = davenport(pairs[0], pairs[1], gains)
    found = Rotation.from_quat(taper.solve(100.0), scalar_first=True)
    assert apart_rad(expected, found) < 1e-9


@given(st.lists(st.integers(0, 40), max_size=6), st.sampled_from([0, 1, 2]))
def test_chunks_and_their_order_do_not_matter(cuts: list[int], power: int) -> None:
    time_s, W, V = swaying(1.0, 11)
    whole, parts = TaperQuest(power), TaperQuest(power)
    whole.add(time_s, W, V)
    edges = sorted({0, len(time_s), *cuts})
    for first, last in reversed(list(pairwise(edges))):
        parts.add(time_s[first:last], W[first:last], V[first:last])
    q = Rotation.from_quat(whole.solve(2.0), scalar_first=True)
    assert apart_rad(parts.solve(2.0), q) < 1e-2 * ARCSEC


def test_one_pair_at_a_time_and_a_solution_at_any_time() -> None:
    time_s, W, V = swaying(20.0, 12)
    one, many = TaperQuest(), TaperQuest()
    for t, w, v in zip(time_s, W, V, strict=True):
        one.add(t, w, v)
    many.add(time_s, W, V)
    assert one.last_s == 20.0
    for end_s in (None, 20.0, 25.0, 1e4):
        q = Rotation.from_quat(many.solve(end_s), scalar_first=True)
        assert apart_rad(one.solve(end_s), q) < 1e-2 * ARCSEC
    before = many.solve()
    many.add(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
    np.testing.assert_array_equal(many.solve(), before)


@pytest.mark.parametrize(
    "axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0.0), (0.0, 0.6, -0.8)]
)
def test_half_a_turn_is_as_good_as_any(axis: tuple[float, ...]) -> None:
    rng = np.random.default_rng(13)
    turn = Rotation.from_rotvec(np.pi * np.asarray(axis))
    V = rng.normal([0.0, 0.0, 2.0], size=(20, 3))
    taper = TaperQuest()
    taper.add(np.arange(20.0), turn.apply(V), V)
    assert apart_rad(taper.solve(30.0), turn) < 1e-12


def test_an_hour_loses_nothing() -> None:
    time_s, V = gravity_fan(3600.0, 36_000)
    turn = Rotation.random(rng=np.random.default_rng(14))
    taper = TaperQuest()
    for i in range(0, len(time_s), 500):
        taper.add(time_s[i : i + 500], turn.apply(V[i : i + 500]), V[i : i + 500])
    assert apart_rad(taper.solve(), turn) < 1e-6 * ARCSEC


@pytest.mark.parametrize(
    ("bad", "complaint"),
    [
        ({"t_s": -1.0}, "time is -1 s; count from the beginning"),
        ({"t_s": np.nan}, r"t_s holds nan at index \(0,\)"),
        ({"W": [1.0, np.inf, 0.0]}, r"W, V holds inf at index \(0, 1\)"),
        ({"W": np.eye(3)}, r"a row \(3,\) for each time; got \(3, 3\), \(3,\) for \(\)"),
        ({"V": [1.0, 0.0]}, r"got \(3,\), \(2,\) for \(\)"),
        ({"t_s": [1.0, 2.0]}, r"for \(2,\)"),
        ({"t_s": [[1.0]]}, r"for \(1, 1\)"),
    ],
)
def test_bad_pairs_are_refused_in_words(bad: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        TaperQuest().add(**({"t_s": 1.0, "W": np.eye(3)[0], "V": np.eye(3)[0]} | bad))


def test_what_cannot_be_solved_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match=r"power is 3; .* p = 0, 1 or 2"):
        TaperQuest(3)
    taper = TaperQuest()
    with pytest.raises(EstimationError, match="no pair has weight yet; add pairs at times"):
        taper.solve()
    taper.add(5.0, np.eye(3)[2], np.eye(3)[2])
    with pytest.raises(EstimationError, match="no pair has weight yet"):
        taper.solve()
    with pytest.raises(ValueError, match="T is 4 s, but a pair came at 5 s"):
        taper.solve(4.0)
    with pytest.raises(ValueError, match="T is nan s"):
        taper.solve(np.nan)
    taper.add(6.0, 2.0 * np.eye(3)[2], 2.0 * np.eye(3)[2])
    with pytest.raises(EstimationError, match=r"up to 6 s the vectors are parallel, \|C\| = 0"):
        taper.solve(10.0)


def test_vectors_that_cancel_are_refused_in_words() -> None:
    taper = TaperQuest(0)
    taper.add(np.arange(3.0), np.eye(3), [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    with pytest.raises(EstimationError, match="vectors of V cancel: their mean has no direction"):
        taper.solve()
