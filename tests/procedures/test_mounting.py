"""How the instrument sits and how the table stands, against the simulation's own matrices."""

import math

import numpy as np
import pytest

from northfinder.errors import AcquisitionError
from northfinder.procedures.mounting import Mounting, TableAttitude, earth_turn
from sim.bench import Mounting as SimulatedMounting
from sim.truth import EARTH_RATE_RAD_S, Truth

AXES = ["x", "y", "z", "-x", "-y", "-z"]


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("turned_rad", [0.0, 0.7, 4.0])
def test_the_table_is_found_from_the_body_however_the_instrument_sits(
    axis: str, turned_rad: float
) -> None:
    truth = Truth(0.7, 5.1, 0.12, -0.08)
    cos, sin = math.cos(turned_rad), math.sin(turned_rad)
    along = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])  # right, sensing, up
    body_axes_n = SimulatedMounting(axis).body_axes() @ along @ truth.table_axes_n()
    force = body_axes_n @ [0.0, 0.0, 1.0]
    found = Mounting.found(axis, turned_rad, force)
    table = found.table_attitude(body_axes_n.T)
    assert table == pytest.approx((5.1, 0.12, -0.08))
    assert found.body_to_n(table) == pytest.approx(body_axes_n.T)


def test_the_table_axes_are_those_of_the_simulation() -> None:
    truth = Truth(0.7, 2.0, 0.3, 0.2)
    assert TableAttitude(2.0, 0.3, 0.2).axes_n() == pytest.approx(truth.table_axes_n())


def test_an_instrument_that_stands_askew_is_refused() -> None:
    with pytest.raises(AcquisitionError, match="one of the other axes should point up"):
        Mounting.found("x", 0.0, np.array([0.0, 0.7, 0.7]))


def test_in_a_sidereal_day_the_earth_turns_once_and_in_an_hour_by_its_rate() -> None:
    latitude_rad, day_s = 0.7, 2.0 * math.pi / EARTH_RATE_RAD_S
    assert earth_turn(latitude_rad, day_s) == pytest.approx(np.eye(3), abs=1e-12)
    hour = earth_turn(latitude_rad, 3600.0)
    axis = np.array([0.0, math.cos(latitude_rad), math.sin(latitude_rad)])
    assert hour @ axis == pytest.approx(axis)
    # What stood in the east is carried up and away: the star rises.
    east_then = hour @ np.array([1.0, 0.0, 0.0])
    assert east_then[2] > 0.0
    assert np.trace(hour) == pytest.approx(1.0 + 2.0 * math.cos(EARTH_RATE_RAD_S * 3600.0))
