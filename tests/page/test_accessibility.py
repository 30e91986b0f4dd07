"""Everyone can use the page: audited by axe-core, with a finger, enlarged, and on any screen."""

import re
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from tests.page.axe import axe_script, grave_findings
from tests.page.browsing import (
    Browsing,
    Reader,
    choose_kind,
    choose_plan,
    wait_for_phase,
    wait_for_run,
)
from tests.service.process import ServiceProcess, serving, wait_until_ready

pytestmark = pytest.mark.slow

_LONG = {"kind": "north-seek", "positions": 90, "dwell_s": 60}
_SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
_WIDTHS_PX = (1440, 390)
_SCREENS_PX = (320, 390, 480, 560, 640, 720, 768, 900, 1024, 1280, 1440, 1920)
_FINGER_PX = 44  # WCAG 2.2, 2.5.5
_HEIGHT_PX = 900


def _before(page: Page, _: ServiceProcess) -> None:
    wait_for_phase(page, "idle")


def _running(page: Page, service: ServiceProcess) -> None:
    run_id = service.start(_LONG)
    service.wait_for_visits(run_id, 6)
    wait_for_run(page, run_id, "running")


def _completed(page: Page, service: ServiceProcess) -> None:
    run_id = service.start({"kind": "north-seek", "positions": 6, "dwell_s": 1})
    wait_for_run(page, run_id, "completed")
    expect(page.locator("#control [data-visits]")).to_be_attached()


def _failed(page: Page, service: ServiceProcess) -> None:
    run_id = service.start(_LONG)
    service.wait_for_visits(run_id, 4)
    service.api.post("/rig/simulation/faults", json={"device": "turntable", "short_by_deg": 0.5})
    wait_for_run(page, run_id, "stopped")


def _aligned(page: Page, service: ServiceProcess) -> None:
    run_id = service.start({"kind": "alignment", "duration_s": 20})
    wait_for_run(page, run_id, "completed")
    choose_kind(page, "heading-hold")
    expect(page.locator("#sureness [data-visits]")).to_be_attached()
    expect(page.locator("#track [data-visits]")).to_be_attached()


def _recorded(page: Page, service: ServiceProcess) -> None:
    run_id = service.start({"kind": "noise", "duration_s": 30})
    wait_for_run(page, run_id, "completed")
    choose_kind(page, "alignment")
    expect(page.locator("#allan [data-visits]")).to_have_count(2)


def _studying(page: Page, _: ServiceProcess) -> None:
    page.locator("#studies > summary").click()
    page.locator("[data-study=coning-rk4] > summary").click()
    expect(page.locator("#studies .drawing svg").last).to_be_visible()


_STATES: dict[str, Callable[[Page, ServiceProcess], None]] = {
    "before": _before,
    "running": _running,
    "completed": _completed,
    "failed": _failed,
    "aligned": _aligned,
    "recorded": _recorded,
    "studying": _studying,
}


@pytest.fixture(scope="module")
def script() -> Path:
    return axe_script()


@pytest.fixture(scope="module", params=_STATES)
def page(
    request: pytest.FixtureRequest, browser: Browser, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Page]:
    """The page in each of its states, of a service without a history: there is a first one."""
    size: ViewportSize = {"width": 1440, "height": _HEIGHT_PX}
    with serving(tmp_path_factory.mktemp("page")) as service, Browsing(browser) as browsing:
        wait_until_ready(service)
        shown = browsing.page(
            service.address, viewport=size, bypass_csp=True, reduced_motion="reduce"
        )
        _STATES[request.param](shown, service)
        yield shown
        assert browsing.complaints() == []


def _turn(page: Page, scheme: Literal["light", "dark"], width_px: int, language: str) -> None:
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width_px, "height": _HEIGHT_PX})
    page.locator(f"[data-lang={language}]").click()
    expect(page.locator("html")).to_have_attribute("lang", re.compile(f"^{language}"))


def test_the_audit_finds_nothing_grave(page: Page, script: Path) -> None:
    found = {}
    for look in product(_SCHEMES, _WIDTHS_PX, ("en", "zh")):
        _turn(page, *look)
        if findings := grave_findings(page, script):
            found[look] = findings
    assert not found


def _overflow_px(page: Page) -> int:
    overflow: int = page.evaluate(
        "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    )
    return overflow


def test_nothing_has_to_be_scrolled_sideways(page: Page) -> None:
    overflows = {}
    for width_px, language in product(_SCREENS_PX, ("en", "zh")):
        _turn(page, "light", width_px, language)
        if overflow_px := _overflow_px(page):
            overflows[width_px, language] = overflow_px
    assert not overflows


# Links within a line of text may be smaller, so WCAG says; what is a control may not. A field is
# hit by its box, a run of the history by its row.
_SMALL_TARGETS = """(least) => [...document.querySelectorAll(
    "button, a.button, select, summary, input:not([type=checkbox])"
  )]
  .filter((one) => one.checkVisibility({ visibilityProperty: true }))
  .map((one) => [one, (one.closest("tbody tr, .box") ?? one).getBoundingClientRect()])
  .filter(([, box]) => box.width && (box.width < least || box.height < least))
  .map(([one, { width, height }]) => `${one.id || one.textContent.trim()}: ${width} x ${height}`)
"""


def test_a_finger_hits_every_control(page: Page) -> None:
    _turn(page, "light", 390, "en")
    if not page.locator(".fields:visible").count():
        page.locator("#change").click()
    assert page.evaluate(_SMALL_TARGETS, _FINGER_PX - 0.5) == []


def test_the_page_enlarged_twice_loses_nothing(service: ServiceProcess, browsing: Browsing) -> None:
    # A browser's 200 % on a screen of 1440 px: half as many CSS pixels, each twice as large.
    enlarged: Reader = {"viewport": {"width": 720, "height": 450}, "device_scale_factor": 2}
    page = browsing.page(service.address, **enlarged)
    _completed(page, service)
    assert _overflow_px(page) == 0
    for shown in ("#stop", "#azimuth-value", "#run-state", "#find", "#history", "#control"):
        page.locator(shown).scroll_into_view_if_needed()
        expect(page.locator(shown)).to_be_in_viewport()
    expect(page.locator("#stop")).to_be_in_viewport(ratio=1)
    choose_plan(page, 4, 1)
