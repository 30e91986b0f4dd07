"""The papers on the page: opened by keyboard while a run goes on, each claim with its verdict."""

import pytest
from playwright.sync_api import Page, expect

from tests.page.browsing import Browsing, wait_for_run
from tests.service.process import ServiceProcess

pytestmark = pytest.mark.usefixtures("idle")

_STUDY = "coning-rk4"  # the quickest


def _open_by_keyboard(page: Page, summary: str) -> None:
    page.locator(summary).focus()
    page.keyboard.press("Enter")


def test_a_study_is_opened_by_keyboard_while_a_run_goes_on(
    browsing: Browsing, service: ServiceProcess
) -> None:
    run_id = service.start({"kind": "north-seek", "positions": 90, "dwell_s": 60})
    page = browsing.page(service.address)
    wait_for_run(page, run_id, "running")
    assert not [url for url in browsing.requests if "studies" in url]  # nothing before it is wanted
    _open_by_keyboard(page, "#studies > summary")
    listed = service.api.get("/studies").json()["studies"]
    expect(page.locator("[data-study]")).to_have_count(len(listed))
    _open_by_keyboard(page, f"[data-study={_STUDY}] > summary")
    shown = page.locator(f"[data-study={_STUDY}]")
    study = service.api.get(f"/studies/{_STUDY}").json()
    expect(shown.locator("tbody tr")).to_have_count(len(study["claims"]))
    for row, claim in zip(shown.locator("tbody tr").all(), study["claims"], strict=True):
        expect(row.locator(".verdict")).to_have_text(f" {claim['verdict']}")
        expect(row.locator(".verdict svg")).to_be_visible()
    expect(shown.locator("figure .drawing svg")).to_have_count(len(study["figures"]))
    assert service.run(run_id)["state"] == "running"
    expect(page.locator("body")).to_have_attribute("data-phase", "running")
    with page.context.expect_page() as opened:
        _open_by_keyboard(page, f"[data-study={_STUDY}] a")
    expect(opened.value.locator("h1")).to_contain_text(study["title"])
