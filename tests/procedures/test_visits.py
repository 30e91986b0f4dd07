"""The orders of visits, whatever the number of angles and revolutions."""

import math
from collections import defaultdict

import pytest
from hypothesis import given
from hypothesis import strategies as st

from northfinder.procedures.visits import Order, schedule

ORDERS: tuple[Order, ...] = ("sequential", "out-and-back", "opposite")

positions = st.integers(3, 60)
revolutions = st.integers(1, 4)


@given(n=positions, order=st.sampled_from(ORDERS), turns=revolutions)
def test_every_angle_gets_the_dwell_in_all(n: int, order: Order, turns: int) -> None:
    dwell_s: dict[float, float] = defaultdict(float)
    for visit in schedule(n, 5.0, order, turns):
        dwell_s[visit.angle_rad] += visit.dwell_s
    assert sorted(dwell_s) == pytest.approx([2 * math.pi * k / n for k in range(n)])
    assert list(dwell_s.values()) == pytest.approx([5.0] * n)


@given(n=positions, order=st.sampled_from(ORDERS), turns=revolutions)
def test_visits_count_up_and_angles_stay_within_a_turn(n: int, order: Order, turns: int) -> None:
    visits = schedule(n, 5.0, order, turns)
    assert [visit.index for visit in visits] == list(range(len(visits)))
    assert all(0.0 <= visit.angle_rad < 2 * math.pi for visit in visits)


@given(n=positions, order=st.sampled_from(("out-and-back", "opposite")))
def test_the_way_back_mirrors_the_way_out(n: int, order: Order) -> None:
    visits = schedule(n, 5.0, order, 1)
    angles = [visit.angle_rad for visit in visits]
    assert angles == angles[::-1]
    assert [visit.direction for visit in visits] == ["out"] * n + ["back"] * n


@given(n=positions)
def test_opposite_angles_follow_each_other_and_an_odd_one_stands_last(n: int) -> None:
    out = [visit.angle_rad for visit in schedule(n, 5.0, "opposite", 1)][:n]
    pairs = list(zip(out[::2], out[1::2], strict=False))
    half_turn = 2 * math.pi * (n // 2) / n
    assert [second - first for first, second in pairs] == pytest.approx([half_turn] * (n // 2))
    if n % 2:
        assert out[-1] == pytest.approx(2 * math.pi * (n - 1) / n)


def test_sequential_goes_round_once_per_revolution() -> None:
    visits = schedule(3, 6.0, "sequential", 2)
    thirds = [round(visit.angle_rad * 3 / (2 * math.pi)) for visit in visits]
    assert thirds == [0, 1, 2, 0, 1, 2]
    assert {visit.dwell_s for visit in visits} == {3.0}
