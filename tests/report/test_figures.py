"""The figures: SVG that any XML reader takes, and that is the same every time."""

import math
import re
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from northfinder.report.canvas import Sheet, render
from northfinder.report.dial import exaggeration
from northfinder.report.figures import FIGURES, UnknownFigureError, draw
from northfinder.report.readings import Readings
from tests.report.conftest import Recorded

SVG = "{http://www.w3.org/2000/svg}"
XLINK = "http://www.w3.org/1999/xlink"


#: Each kind's recording, by the name of its fixture.
RECORDINGS = {
    "north-seek": "recorded",
    "alignment": "aligned",
    "heading-hold": "held",
    "noise": "silent",
}


@pytest.mark.parametrize(
    ("kind", "name"), [(kind, name) for kind, figures in FIGURES.items() for name in figures]
)
def test_a_figure_is_an_svg_element_that_needs_nothing_else(
    kind: str, name: str, request: pytest.FixtureRequest
) -> None:
    recorded: Recorded = request.getfixturevalue(RECORDINGS[kind])
    svg = draw(name, recorded.result, recorded.estimates)
    root = ET.fromstring(svg)  # noqa: S314 -- our own text
    assert root.tag == f"{SVG}svg"
    assert root.findtext(f"{SVG}title")
    assert re.search(r"\d", root.findtext(f"{SVG}desc") or ""), "what it shows, in numbers"
    assert {element.tag.removeprefix(SVG) for element in root.iter()}.isdisjoint(
        {"script", "style", "image", "metadata", "foreignObject"}
    )
    references = [element.get(f"{{{XLINK}}}href") for element in root.iter(f"{SVG}use")]
    targets = {element.get("id") for element in root.iter() if element.get("id")}
    assert {str(reference).removeprefix("#") for reference in references} <= targets
    assert svg.count("http") == 2, "the two namespaces, and nothing to fetch"


def test_threads_draw_the_same_text(recorded: Recorded) -> None:
    names = [*FIGURES["north-seek"]] * 2
    with ThreadPoolExecutor(4) as pool:
        drawn = list(pool.map(lambda n: draw(n, recorded.result, recorded.estimates), names))
    assert drawn == [draw(name, recorded.result, recorded.estimates) for name in names]


def test_one_thread_draws_for_all() -> None:
    """Or each of the service's many threads keeps fonts and memory of its own, for ever."""
    painters = set()

    def paint(_: object) -> None:
        painters.add(threading.get_ident())

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda n: render(Sheet(f"{n}", "empty", 72.0, 72.0), paint), range(8)))
    assert len(painters) == 1


def test_a_figure_that_cannot_be_drawn_says_why(recorded: Recorded) -> None:
    with pytest.raises(
        UnknownFigureError, match="a north-seek has no figure 'fitt'; it has fit, res"
    ):
        draw("fitt", recorded.result)
    with pytest.raises(UnknownFigureError, match=r"a noise record .* it has allan-gyro, allan-acc"):
        draw("dial", {"kind": "noise", "visits": recorded.result["visits"]})
    with pytest.raises(UnknownFigureError, match="no recorded heading"):
        draw("level", {"kind": "heading-hold", "visits": []})
    with pytest.raises(UnknownFigureError, match="no noise determined"):
        draw("allan-gyro", {"kind": "noise", "visits": []})
    with pytest.raises(UnknownFigureError, match="no recorded estimates"):
        draw("convergence", recorded.result)
    with pytest.raises(UnknownFigureError, match="no result"):
        draw("dial", {"visits": recorded.result["visits"]})
    with pytest.raises(UnknownFigureError, match="no completed visits"):
        draw("fit", {"visits": []})


def test_an_unfinished_run_shows_its_readings_without_a_curve(recorded: Recorded) -> None:
    svg = draw("fit", {"visits": recorded.result["visits"][:5]})
    words = "".join(ET.fromstring(svg).itertext())  # noqa: S314 -- our own text
    assert "rate" in words
    assert "residual," not in words


def _visit(index: int, angle_deg: float, rate_deg_h: float, segment: int) -> dict[str, Any]:
    return {
        "index": index,
        "segment": segment,
        "direction": "out",
        "angle_deg": angle_deg,
        "gyro_mean_deg_h": rate_deg_h,
        "gyro_sigma_deg_h": 0.01,
        "start_s": 10.0 * index,
    }


def test_segments_with_drift_and_mounting_fall_on_one_curve() -> None:
    """Readings by the signal model of the package's first page; segment 1 was refused."""
    visits, biases, drift_deg_h_h, mount_deg = [], {0: 0.3, 2: -1.1}, 4.0, 30.0
    for index in range(12):
        segment, angle_deg = (0 if index < 6 else 2), 30.0 * index
        since_h = 10.0 * (index % 6 - 2.5) / 3600.0
        angle_rad = math.radians(angle_deg + mount_deg)
        rate = biases[segment] + drift_deg_h_h * since_h
        rate += 7.7 * math.cos(angle_rad) + 8.6 * math.sin(angle_rad)
        visits.append(_visit(index, angle_deg, rate, segment))
    visits.append(_visit(12, 0.0, 99.0, 1))
    terms = [
        {"segment": number, "R_deg_h": R, "drift_deg_h_h": drift_deg_h_h}
        for number, R in biases.items()
    ]
    result = {
        "visits": visits,
        "segments": terms,
        "gyro_fit": {"R_deg_h": 0.3, "a_deg_h": 7.7, "b_deg_h": 8.6},
        "rig": {"config": {"gyro": {"mount_angle_deg": mount_deg}}},
    }
    readings = Readings.of(result)
    assert readings.fit is not None
    assert len(readings.rate_deg_h) == 12
    np.testing.assert_allclose(
        readings.rate_deg_h, readings.fit.rate_deg_h(readings.angle_deg), atol=1e-12
    )


@pytest.mark.parametrize("two_sigma_deg", [1e-6, 0.0123, 0.0577, 0.4, 1.0, 3.9])
def test_the_drawn_wedge_can_be_read(two_sigma_deg: float) -> None:
    """Half of it 4 to 10 degrees wide, as long as the factor has not come down to 1."""
    assert 4.0 <= exaggeration(two_sigma_deg) * two_sigma_deg <= 10.0 or two_sigma_deg > 10.0
    assert exaggeration(25.0) == 1.0


def test_importing_the_report_does_not_import_matplotlib() -> None:
    code = "import sys, northfinder.report.certificate; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0
