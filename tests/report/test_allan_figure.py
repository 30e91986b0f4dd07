"""The Allan deviation on paper: in decades, with its band, whatever of it is known."""

from typing import Any
from xml.etree import ElementTree as ET

import pytest

from northfinder.report.figures import draw
from northfinder.report.wording import plural, power_of_ten
from tests.report.conftest import Recorded

SVG = "{http://www.w3.org/2000/svg}"


def texts(svg: str) -> list[str]:
    root = ET.fromstring(svg)  # noqa: S314 -- our own text
    return [element.text or "" for element in root.iter(f"{SVG}text")]


@pytest.mark.parametrize(
    ("sensor", "heading"),
    [("gyro", "Allan deviation of the gyro, °/h"), ("accelerometer", "accelerometer, µg")],
)
def test_it_names_its_quantities_and_its_curves(
    sensor: str, heading: str, silent: Recorded
) -> None:
    words = texts(draw(f"allan-{sensor}", silent.result))
    assert [word for word in words if word.endswith(heading)]
    for word in ("averaging time τ, s", "measured, 95 % band", "model of what was seen"):
        assert word in words


def test_its_words_are_the_records_numbers(silent: Recorded) -> None:
    allan = silent.result["accelerometer"]["allan"]
    root = ET.fromstring(draw("allan-accelerometer", silent.result))  # noqa: S314 -- our own
    said = root.findtext(f"{SVG}desc") or ""
    for which, place in (("From", 0), ("to", -1)):
        deviation, tau_s = allan["deviation"][place] * 1e6, allan["tau_s"][place]
        assert f"{which} {deviation:.3g} µg at {tau_s:.3g} s" in said
    assert f"{min(allan['deviation']) * 1e6:.3g} µg" in said


def test_an_open_band_and_an_unseen_model_are_drawn_too(silent: Recorded) -> None:
    gyro = silent.result["gyro"]
    allan: dict[str, Any] = {**gyro["allan"]}
    allan["high95"] = [*allan["high95"][:-2], None, None]
    allan["model"] = [0.0] * len(allan["tau_s"])
    result = {**silent.result, "gyro": {**gyro, "allan": allan}}
    assert draw("allan-gyro", result) != draw("allan-gyro", silent.result)


def test_what_was_told_on_the_way_is_drawn_of_an_unfinished_record(silent: Recorded) -> None:
    svg = draw("allan-gyro", {"kind": "noise", "visits": []}, silent.estimates)
    assert svg == draw("allan-gyro", silent.estimates[-1] | {"kind": "noise"})


@pytest.mark.parametrize(
    ("value", "written"),
    [(0.001, "0.001"), (20.0, "20"), (1e-5, "10⁻⁵"), (2e5, "2 × 10⁵"), (1e4, "10⁴")],
)
def test_a_tick_of_decades_is_written_out(value: float, written: str) -> None:
    assert power_of_ten(value) == written


def test_plurals() -> None:
    assert plural(1, "stretch") == "1 stretch"
    assert plural(3, "stretch") == "3 stretches"
    assert plural(0, "time") == "0 times"
