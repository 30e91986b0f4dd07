"""Heading and level over time: across north, after a new beginning, and for hours."""

import re
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from northfinder.report.figures import draw
from northfinder.report.history import History
from tests.report.conftest import Recorded
from tests.report.reading import assert_agrees

SVG = "{http://www.w3.org/2000/svg}"


def moment(time_s: float, azimuth_deg: float, sigma_deg: float) -> dict[str, Any]:
    return {
        "time_s": time_s,
        "azimuth_deg": azimuth_deg,
        "azimuth_sigma_deg": sigma_deg,
        "pitch_deg": 0.8,
        "roll_deg": -0.5,
        "checks": [],
    }


def texts(svg: str) -> list[str]:
    root = ET.fromstring(svg)  # noqa: S314 -- our own text
    return [element.text or "" for element in root.iter(f"{SVG}text")]


def described(svg: str) -> str:
    return ET.fromstring(svg).findtext(f"{SVG}desc") or ""  # noqa: S314 -- our own text


def test_a_heading_does_not_leap_at_north_and_ends_at_the_result() -> None:
    azimuths_deg = [359.0, 359.8, 0.4, 1.0, 359.9, 0.2]
    estimates = [moment(n + 1.0, azimuth, 0.1) for n, azimuth in enumerate(azimuths_deg)]
    history = History.of({}, estimates)
    np.testing.assert_allclose(history.azimuth_deg, [-1.0, -0.2, 0.4, 1.0, -0.1, 0.2], atol=1e-9)
    words = texts(draw("heading", {"kind": "alignment"}, estimates))
    assert {"359", "0", "1"} <= set(words)
    assert not [word for word in words if re.match(r"360|[−-]\d", word)]


def test_after_a_gap_only_what_came_since_is_drawn() -> None:
    before = [moment(10.0 + n, 200.0, 5.0) for n in range(20)]
    since = [moment(10.0 + n, 48.0, 5.0 - n) for n in range(4)]
    history = History.of({}, before + since)
    np.testing.assert_array_equal(history.time_s, [10.0, 11.0, 12.0, 13.0])
    np.testing.assert_array_equal(history.azimuth_deg, [48.0] * 4)


def test_a_scale_is_for_what_has_settled() -> None:
    estimates = [moment(10.0, 300.0, 90.0), moment(11.0, 50.0, 5.0), moment(12.0, 48.0, 1.0)]
    assert History.of({}, estimates).settled.tolist() == [False, True, True]


def test_the_level_has_the_uncertainty_that_was_told_at_each_moment(aligned: Recorded) -> None:
    history = History.of(aligned.result, aligned.estimates)
    told = [estimate["level_sigma_deg"] for estimate in aligned.estimates]
    np.testing.assert_allclose(history.level_sigma_deg[:-1], told[:-1], rtol=1e-12)
    assert history.level_sigma_deg[-1] == aligned.result["level_sigma_deg"]
    bare = History.of(aligned.result, [])
    assert np.isnan(bare.level_sigma_deg[:-1]).all()
    assert "pitch, °, ±2σ" in texts(draw("level", aligned.result, []))


def test_a_hold_states_no_uncertainty_of_its_level(held: Recorded) -> None:
    words = texts(draw("level", held.result, held.estimates))
    assert "pitch, ° (no uncertainty stated)" in words
    assert "roll, ° (no uncertainty stated)" in words


def test_a_hold_shows_what_it_has_added_since_its_rest(held: Recorded) -> None:
    words = texts(draw("heading", held.result, held.estimates))
    assert "2σ that the hold has added, °" in words
    assert words.count("held") == 2
    rested_on = {**held.result, "plan": {**held.result["plan"], "rest_s": 0.0}}
    assert "held" not in texts(draw("heading", rested_on, held.estimates))


def test_an_alignments_uncertainty_falls_over_decades(aligned: Recorded) -> None:
    words = texts(draw("heading", aligned.result, aligned.estimates))
    assert "2σ of the azimuth, °" in words
    assert {"1", "10"} <= set(words)
    said = described(draw("heading", aligned.result, aligned.estimates))
    azimuth, _, expanded = said.partition(" to ")[2].split()[:3]
    assert_agrees(azimuth, aligned.result["azimuth_deg"])
    assert_agrees(expanded, 2.0 * aligned.result["azimuth_sigma_deg"])


@pytest.mark.parametrize(("lasted_s", "unit"), [(600.0, "s"), (601.0, "min"), (11000.0, "h")])
def test_time_is_counted_in_what_it_takes(lasted_s: float, unit: str) -> None:
    estimates = [moment(1.0, 48.0, 0.1), moment(lasted_s, 48.0, 0.1)]
    assert f"time, {unit}" in texts(draw("heading", {"kind": "heading-hold"}, estimates))


def test_a_heading_that_is_exact_can_still_be_drawn() -> None:
    estimates = [moment(1.0, 48.0, 0.0), moment(2.0, 48.0, 0.0)]
    assert "48.0000" in texts(draw("heading", {"kind": "heading-hold"}, estimates))
