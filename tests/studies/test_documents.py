"""Studies as JSON, SVG, one HTML page, and ``docs/papers.md``."""

import json
import runpy
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from northfinder.studies import registry
from northfinder.studies.drawing import draw
from northfinder.studies.page import study_page
from northfinder.studies.registry import NAMES, run_study
from northfinder.studies.study_json import study_json
from tests.studies.conftest import Worked

SVG = "{http://www.w3.org/2000/svg}"
PAPERS = Path(__file__).parents[2] / "docs" / "papers.md"
Studies = dict[str, Worked]


def test_the_papers_page_is_what_a_fresh_run_writes(
    worked: Studies, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(registry, "run_study", lambda name: worked[name].study)
    runpy.run_module("northfinder.studies", run_name="__main__")
    fresh = capsys.readouterr().out
    stale = PAPERS.read_text(encoding="utf-8")
    assert fresh.splitlines() == stale.splitlines(), (
        "python -m northfinder.studies > docs/papers.md"
    )


@pytest.mark.parametrize("name", ["coning-rk4", "levelling"])
def test_a_study_gives_the_same_figures_every_time(worked: Studies, name: str) -> None:
    first, second = (_repeatable(study_json(s)) for s in (worked[name].study, run_study(name)))
    assert first == second


def _repeatable(found: dict[str, Any]) -> dict[str, Any]:
    return {**found, "tables": [table for table in found["tables"] if table["repeatable"]]}


@pytest.mark.parametrize("name", NAMES)
def test_json_holds_every_claim_with_its_figures(worked: Studies, name: str) -> None:
    found = json.loads(json.dumps(study_json(worked[name].study), allow_nan=False))
    assert found["kind"] == "study"
    assert found["name"] == name
    for claim in found["claims"]:
        assert claim["verdict"] in {
            "reproduced",
            "not reproduced",
            "misprint",
            "beyond the paper",
        }
        assert claim["reason"].endswith(".")
        assert claim["command"] == f"northfinder study {name}"
        assert {"value", "unit", "text"} == set(claim["ours"])
    for table in found["tables"]:
        assert {len(row) for row in table["rows"]} == {len(table["columns"])}
    assert len({figure["name"] for figure in found["figures"]}) == len(found["figures"])


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_says_what_is_seen_and_needs_nothing_else(worked: Studies, name: str) -> None:
    for chart in worked[name].study.charts:
        svg = draw(chart)
        root = ET.fromstring(svg)  # noqa: S314 -- our own text
        assert root.findtext(f"{SVG}title") == chart.title
        assert root.findtext(f"{SVG}desc") == chart.description
        assert root.get("role") == "img"
        assert {e.tag.removeprefix(SVG) for e in root.iter()}.isdisjoint({"script", "image"})
        assert svg.count("http") == 2, "the two namespaces, and nothing to fetch"
        assert "mathdefault" not in svg
        words = " ".join(root.itertext())
        for panel in chart.panels:
            assert panel.upwards in words
            assert all(curve.name in words for curve in panel.curves)


def test_equal_charts_are_equal_text(worked: Studies) -> None:
    chart = worked["levelling"].study.charts[0]
    assert draw(chart) == draw(chart)


class Page(HTMLParser):
    """Tags that are still open, and everything that would be fetched."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.words: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.fetched += [
            str(value)
            for key, value in attrs
            if key in {"src", "href"} or (key == "xlink:href" and not str(value).startswith("#"))
        ]

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.mark.parametrize("name", NAMES)
def test_the_page_is_complete_in_itself(worked: Studies, name: str) -> None:
    study = worked[name].study
    text, page = study_page(study), Page()
    page.feed(text)
    assert page.fetched == []
    assert {"script", "link", "img"}.isdisjoint(page.tags)
    words = " ".join(page.words)
    for claim in study.claims:
        assert claim.says in words
        assert claim.reason in words
        assert claim.verdict.value in words
    assert page.tags.count("figure") == len(study.charts)
    assert "url(" not in text.replace("url(#", "")


def test_the_page_follows_the_readers_light(worked: Studies) -> None:
    """The drawings take the page's colours, which the dark scheme gives anew."""
    text = study_page(worked["coning-rk4"].study)
    assert "prefers-color-scheme: dark" in text
    assert "stroke: var(--blue, #0b5cd5)" in text
    figures = text[text.index("<figure>") :]
    assert "#ffffff" not in figures.replace("var(--paper, #ffffff)", "")


def test_importing_the_registry_computes_and_draws_nothing() -> None:
    code = (
        "import sys, northfinder.studies.registry;"
        "sys.exit(bool({'matplotlib', 'scipy', 'northfinder.studies.levelling'} & {*sys.modules}))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0
