"""Numbers as people read them."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from northfinder.formatting import degrees_minutes_seconds


@pytest.mark.parametrize(
    ("azimuth_deg", "uncertainty_deg", "written"),
    [
        (48.05701, 0.0622, "48° 03′ 30″ ± 3′ 40″"),
        (48.1234567, 0.0003, "48° 07′ 24.4″ ± 1.1″"),
        (359.9999, 0.01, "0° 00′ 00″ ± 36″"),  # north from the other side, never 360
        (48.0, 0.5, "48° 00′ ± 30′"),
        (-1.0, 20.0, "359° 00′ ± 20° 00′"),
        (12.5, 33.0, "12° ± 33°"),
    ],
)
def test_degrees_minutes_and_seconds(
    azimuth_deg: float, uncertainty_deg: float, written: str
) -> None:
    assert degrees_minutes_seconds(azimuth_deg, uncertainty_deg) == written


@given(st.floats(0.0, 359.999), st.floats(1e-7, 40.0))
def test_nothing_is_lost_but_what_the_uncertainty_hides(
    azimuth_deg: float, uncertainty_deg: float
) -> None:
    """Read back, it is within 5 % of the uncertainty, or half of a minute, ten or a degree."""
    value, about = degrees_minutes_seconds(azimuth_deg, uncertainty_deg).split(" ± ")
    allowed_deg = max(0.051 * uncertainty_deg, 0.0)
    if uncertainty_deg > 999.0 / 3600.0:
        allowed_deg = max(allowed_deg, (0.5 / 60 if uncertainty_deg < 2.77 else 0.51))
    apart_deg = (_degrees(value) - azimuth_deg + 180.0) % 360.0 - 180.0
    assert abs(apart_deg) <= allowed_deg
    assert abs(_degrees(about) - uncertainty_deg) <= allowed_deg


def _degrees(written: str) -> float:
    units = {"°": 1.0, "′": 60.0, "″": 3600.0}
    parts = re.findall(r"([\d.]+)([°′″])", written)
    assert all(float(number) < 60.0 for number, unit in parts if unit != "°")
    return sum(float(number) / units[unit] for number, unit in parts)
