"""On paper: a browser prints every certificate on two sheets of A4, and complains of nothing."""

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


def printed(pages: dict[str, str], folder: Path) -> dict[str, Sheets]:
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=_CHROMIUM, args=_ARGUMENTS) as browser,
    ):
        return {name: _sheets(browser, html, folder) for name, html in pages.items()}


def _sheets(browser: Browser, html: str, folder: Path) -> Sheets:
    file = folder / "certificate.html"
    file.write_text(html, encoding="utf-8")
    page, said = browser.new_page(), list[str]()

    def hear(message: ConsoleMessage) -> None:
        said.append(message.text)

    page.on("console", hear)
    page.goto(file.as_uri())
    pdf = page.pdf(prefer_css_page_size=True, print_background=True)
    page.close()
    return Sheets(len(re.findall(rb"/Type\s*/Page\b", pdf)), said)


def test_each_certificate_is_two_sheets(
    recorded: Recorded, aligned: Recorded, held: Recorded, silent: Recorded, tmp_path: Path
) -> None:
    """The recordings come first: while the browser is open this thread has a running loop."""
    pages = {}
    for each in (recorded, aligned, held, silent):
        pages[each.run.kind] = certificate(*each)
        stopped = replace(each.run, state="failed", result=None, error="The cable was pulled.")
        pages[f"{each.run.kind}-unfinished"] = certificate(stopped, *each[1:])
    sheets = printed(pages, tmp_path)
    assert {name: each.complaints for name, each in sheets.items() if each.complaints} == {}
    assert {name: each.number for name, each in sheets.items() if not 1 <= each.number <= 2} == {}
