"""The certificate of a noise record: every figure with its interval, or with its bound."""

import re
from dataclasses import replace
from typing import Any

import pytest

from northfinder.report.certificate import certificate
from tests.report.conftest import NAME, Recorded
from tests.report.reading import Page, assert_agrees, figures_of

#: How many of the printed unit one of the recorded unit is.
SCALES = {"gyro": 1.0, "accelerometer": 1e6}


def rows_of(html: str) -> dict[str, list[tuple[str, str, str]]]:
    """Return value, interval and unit by the figure's name; a name may stand for both sensors."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    pattern = (
        r'<th scope="row">([^<]*)</th><td class="number">([^<]*)</td>'
        r'<td class="number">([^<]*)</td><td class="unit">([^<]*)</td>'
    )
    for name, *cells in re.findall(pattern, html):
        value, interval, unit = cells
        found.setdefault(name, []).append((value, interval, unit))
    return found


@pytest.fixture(scope="module")
def html(silent: Recorded) -> str:
    return certificate(*silent)


def test_it_is_complete_in_itself(html: str, silent: Recorded) -> None:
    assert figures_of(html) == 2
    assert NAME not in html
    assert silent.samples_sha256 in html
    for check in silent.result["checks"]:
        assert check["detail"] in Page(html).text


@pytest.mark.parametrize("sensor", SCALES)
def test_each_figure_is_the_results_with_its_interval_or_its_bound(
    html: str, sensor: str, silent: Recorded
) -> None:
    place = [*SCALES].index(sensor)
    rows, scale = rows_of(html), SCALES[sensor]
    seen = 0
    for figure in silent.result[sensor]["figures"]:
        same = rows[figure["name"]]
        value, interval, _ = same[min(place, len(same) - 1)]
        if figure["value"] is None:
            assert value == "not seen"
            assert float(interval.removeprefix("below ")) == pytest.approx(
                figure["upper"] * scale, rel=0.06
            )
            continue
        seen += 1
        lower, _, upper = interval.partition(" to ")
        assert_agrees(value, figure["value"] * scale)
        assert_agrees(lower, figure["lower"] * scale)
        assert_agrees(upper, figure["upper"] * scale)
    assert seen, "half a minute shows the white noise at least"


def test_the_simulated_walk_lies_in_the_printed_interval(html: str) -> None:
    """0.001 deg/sqrt(h) is what the simulation makes; the large number is the same row's."""
    value, interval, unit = rows_of(html)["angle random walk"][0]
    lower, upper = (float(end) for end in interval.split(" to "))
    assert lower < 0.001 < upper
    assert unit == "°/√h"
    assert f"{value} °/√h {interval}, 95 %" in Page(html).text


def test_the_suggested_dwell_stands_with_its_reason(html: str, silent: Recorded) -> None:
    suggestion, text = silent.result["suggestion"], Page(html).text
    assert f"suggested dwell {suggestion['dwell_s']:.3g} s at each angle" in text
    assert suggestion["reason"][1:] in text
    bare = replace(silent.run, result={**silent.result, "suggestion": None})
    text = Page(certificate(bare, *silent[1:])).text
    assert "none: this record does not show the noise, or the rig has no table" in text


def of_gyro(silent: Recorded, changes: dict[str, Any]) -> str:
    result = {**silent.result, "gyro": {**silent.result["gyro"], **changes}}
    return certificate(replace(silent.run, result=result), *silent[1:])


def test_a_drift_and_filled_gaps_are_told(silent: Recorded) -> None:
    drift = {"value": -1.5, "sigma": 0.1, "unit": "deg/h/h", "seen": True}
    html = of_gyro(silent, {"drift": drift, "filled": 3})
    assert ("−1.50", "± 0.20 (2σ)", "°/h per h") in rows_of(html)["drift"]
    assert "3 of them filled in" in Page(html).text


def test_a_figure_without_an_upper_end_has_none_printed(silent: Recorded) -> None:
    figures = [
        {"name": "angle random walk", "unit": "deg/sqrt(h)", "value": 0.002, "lower": 0.001,
         "upper": None},
        {"name": "bias instability", "unit": "deg/h", "value": None, "lower": 0.0, "upper": None},
        {"name": "flicker", "unit": "furlong", "value": 0.0021, "lower": 0.0011, "upper": 0.0031},
    ]  # fmt: skip
    rows = rows_of(of_gyro(silent, {"figures": figures}))
    assert rows["angle random walk"] == [("0.00200", "from 0.00100", "°/√h")]
    assert rows["bias instability"][0] == ("not seen", "nothing can be said", "°/h")
    assert rows["flicker"] == [("0.0021", "0.0011 to 0.0031", "furlong")]


def test_an_unfinished_one_says_what_it_did(silent: Recorded) -> None:
    failed = replace(silent.run, state="interrupted", result=None, error=None)
    html = certificate(failed, silent.visits[:3], silent.estimates, "0" * 64)
    text = Page(html).text
    assert "no figure is stated" in text
    assert "3 stretches of one stream" in text
    assert "suggested dwell" not in text
    assert "So far the gyro's angle random walk was" in text
    assert figures_of(html) == 2
    assert figures_of(certificate(failed, [], [], "0" * 64)) == 0
