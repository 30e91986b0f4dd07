"""Earth rate and gravity against the published figures of WGS 84."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from northfinder.earth import EARTH_RATE_RAD_S, earth_rate_n, normal_gravity_m_s2
from northfinder.units import DEG, DEG_PER_HOUR


@pytest.mark.parametrize(
    ("latitude_deg", "expected"),
    [
        pytest.param(0.0, [0, 1, 0], id="equator"),
        pytest.param(90.0, [0, 0, 1], id="north-pole"),
        pytest.param(-30.0, [0, math.sqrt(0.75), -0.5], id="southern-hemisphere"),
    ],
)
def test_the_earth_turns_towards_the_east(latitude_deg: float, expected: list[float]) -> None:
    assert_allclose(earth_rate_n(latitude_deg * DEG) / EARTH_RATE_RAD_S, expected, atol=1e-15)


def test_the_earth_turns_fifteen_degrees_an_hour() -> None:
    assert pytest.approx(15.041067, abs=5e-7) == EARTH_RATE_RAD_S / DEG_PER_HOUR


@pytest.mark.parametrize(
    ("latitude_deg", "published_m_s2"),
    [
        pytest.param(0.0, 9.7803253359, id="equator"),
        pytest.param(90.0, 9.8321849378, id="pole"),
        pytest.param(-90.0, 9.8321849378, id="south-pole"),
    ],
)
def test_normal_gravity_is_that_of_wgs_84(latitude_deg: float, published_m_s2: float) -> None:
    assert normal_gravity_m_s2(latitude_deg * DEG) == pytest.approx(published_m_s2, abs=2e-10)


@pytest.mark.parametrize("latitude_deg", [0.0, 90.0])
def test_gravity_falls_with_height_as_attraction_and_spin_say(latitude_deg: float) -> None:
    # The ellipsoid's potential in zonal harmonics to J4, differentiated along the vertical.
    gm, a, j2, j4, height_m = 3.986004418e14, 6378137.0, 1.08262982e-3, -2.37091222e-6, 3000.0
    radius_m = (a if latitude_deg == 0.0 else 6356752.3142) + height_m
    p2, p4 = (-0.5, 0.375) if latitude_deg == 0.0 else (1.0, 1.0)
    zonal = 3.0 * j2 * p2 * (a / radius_m) ** 2 + 5.0 * j4 * p4 * (a / radius_m) ** 4
    spin = EARTH_RATE_RAD_S**2 * radius_m * math.cos(latitude_deg * DEG) ** 2
    expected = gm / radius_m**2 * (1.0 - zonal) - spin
    got = normal_gravity_m_s2(latitude_deg * DEG, height_m)
    assert got == pytest.approx(expected, abs=1e-6)  # J6 is 6e-9 of it
    assert np.sign(got - normal_gravity_m_s2(latitude_deg * DEG)) == -1
