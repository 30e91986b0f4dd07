"""An inclinometer's slopes, against right angles and thirds of them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.codecs.cia410 import PROFILE, RESOLUTIONS, slopes, specific_force, unit_rad

ROUNDING = 1e-9


@pytest.mark.parametrize(
    ("resolution", "unit_deg"), [(1, 0.001), (10, 0.01), (100, 0.1), (1000, 1.0)]
)
def test_a_resolution_is_in_thousandths_of_a_degree(resolution: int, unit_deg: float) -> None:
    assert math.degrees(unit_rad(resolution)) == pytest.approx(unit_deg)
    assert resolution in RESOLUTIONS
    assert PROFILE == 0x019A


@pytest.mark.parametrize("resolution", [0, 2, 999, -1])
def test_another_resolution_is_refused(resolution: int) -> None:
    with pytest.raises(ValueError, match=f"a resolution of {resolution} is none of"):
        unit_rad(resolution)


@pytest.mark.parametrize(
    ("longitudinal_deg", "lateral_deg", "force"),
    [
        (0, 0, (0, 0, 1)),
        (30, 0, (0.5, 0, math.sqrt(0.75))),
        (0, -30, (0, -0.5, math.sqrt(0.75))),
        (90, 0, (1, 0, 0)),
        (30, 30, (0.5, 0.5, math.sqrt(0.5))),
    ],
)
def test_known_angles_stand_for_known_forces(
    longitudinal_deg: float, lateral_deg: float, force: tuple[float, float, float]
) -> None:
    along, across = np.radians([longitudinal_deg]), np.radians([lateral_deg])
    assert specific_force(along, across)[0] == pytest.approx(force, abs=ROUNDING)
    assert slopes(np.array(force)) == pytest.approx([along[0], across[0]], abs=ROUNDING)


def test_slopes_that_cannot_belong_together_have_no_third_axis() -> None:
    force = specific_force(np.radians([60.0]), np.radians([60.0]))
    assert np.isnan(force[0, 2])
    assert not np.isnan(force[0, :2]).any()


def test_only_the_direction_of_a_force_counts() -> None:
    assert slopes(np.array([[0.0, 4.9, 4.9 * math.sqrt(3)]]))[0] == pytest.approx(
        [0.0, math.radians(30)]
    )


@given(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7))
def test_slopes_survive_the_way_to_a_force_and_back(along_rad: float, across_rad: float) -> None:
    force = specific_force(np.array([along_rad]), np.array([across_rad]))
    assert np.linalg.norm(force) == pytest.approx(1.0)
    assert slopes(force)[0] == pytest.approx([along_rad, across_rad], abs=1e-7)
