"""On paper: a browser prints every certificate on two sheets of A4, and complains of nothing.

A computer that has none of the fonts that the sheet names sets it wider, on three.
"""

import re
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest
from playwright.sync_api import Browser, ConsoleMessage, sync_playwright

from northfinder.report.certificate import certificate
from tests.report.conftest import Recorded

pytestmark = pytest.mark.slow

_CHROMIUM = Path("/usr/bin/chromium")
_ARGUMENTS = ["--no-sandbox", "--disable-gpu"]


class Sheets(NamedTuple):
    """What became of a page in a browser."""

    number: int
    complaints: list[str]


def printed(pages: dict[str, str], folder: Path, font: str) -> dict[str, Sheets]:
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=_CHROMIUM, args=_ARGUMENTS) as browser,
    ):
        return {name: _sheets(browser, html, folder, font) for name, html in pages.items()}


def _sheets(browser: Browser, html: str, folder: Path, font: str) -> Sheets:
    file = folder / "certificate.html"
    file.write_text(html, encoding="utf-8")
    page, said = browser.new_page(), list[str]()

    def hear(message: ConsoleMessage) -> None:
        said.append(message.text)

    page.on("console", hear)
    page.goto(file.as_uri())
    page.add_style_tag(content=f'body {{ font-family: "{font}" }}')
    pdf = page.pdf(prefer_css_page_size=True, print_background=True)
    page.close()
    return Sheets(len(re.findall(rb"/Type\s*/Page\b", pdf)), said)


@pytest.fixture(scope="module")
def pages(
    recorded: Recorded, aligned: Recorded, held: Recorded, silent: Recorded
) -> dict[str, str]:
    """Every kind's certificate; made before a browser is open: then this thread runs a loop."""
    pages = {}
    for each in (recorded, aligned, held, silent):
        pages[each.run.kind] = certificate(*each)
        stopped = replace(each.run, state="failed", result=None, error="The cable was pulled.")
        pages[f"{each.run.kind}-unfinished"] = certificate(stopped, *each[1:])
    return pages


@pytest.mark.parametrize(("font", "most"), [("Liberation Sans", 2), ("DejaVu Sans", 3)])
def test_each_certificate_is_two_sheets(
    pages: dict[str, str], tmp_path: Path, font: str, most: int
) -> None:
    sheets = printed(pages, tmp_path, font)
    assert {name: each.complaints for name, each in sheets.items() if each.complaints} == {}
    assert {
        name: each.number for name, each in sheets.items() if not 1 <= each.number <= most
    } == {}
