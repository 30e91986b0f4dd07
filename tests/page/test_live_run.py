"""A click brings north: the run live, its result, its certificate, and STOP."""

import re

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.page.browsing import (
    Browsing,
    choose_plan,
    find_button,
    is_start,
    north_shown,
    rounded,
    wait_for_run,
)
from tests.page.following import expect_every_event
from tests.service.process import ServiceProcess

pytestmark = pytest.mark.usefixtures("idle")

_MOST_TABS = 60


def _click_find(page: Page) -> str:
    """Click the button; return the id of the run that this began."""
    with page.expect_response(is_start) as begun:
        find_button(page).click()
    run_id: str = begun.value.json()["run_id"]
    return run_id


def _begin_long_run(page: Page, service: ServiceProcess) -> str:
    choose_plan(page, 90, 20)
    run_id = _click_find(page)
    wait_for_run(page, run_id, "running")
    service.wait_for_visits(run_id, 1)
    return run_id


def _tab_to(page: Page, target: Locator) -> None:
    for _ in range(_MOST_TABS):
        page.keyboard.press("Tab")
        if target.evaluate_all("all => all.includes(document.activeElement)"):
            return
    pytest.fail(f"{target} takes no focus within {_MOST_TABS} presses of Tab")


def test_a_click_brings_north(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    choose_plan(page, 6, 1)
    run_id = _click_find(page)
    wait_for_run(page, run_id, "completed")
    run = service.run(run_id)
    result = run["result"]
    value, expanded = rounded(result["azimuth_deg"], result["azimuth_sigma_deg"])
    assert north_shown(page) == (value, expanded)
    dial = page.locator("#face")
    expect(dial).to_have_attribute("aria-label", re.compile(rf"{re.escape(value)}°.* 6 .* 6 "))
    expect(page).to_have_title(re.compile(re.escape(value)))
    expect_every_event(page, service, run_id)
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="Certificate").click()
    expect(opened.value.locator("body")).to_contain_text(run_id)


def test_a_run_is_followed_while_it_measures(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    run_id = _begin_long_run(page, service)
    expect(page.locator("#run-state")).to_contain_text("Measuring")
    expect(page.locator("#run-detail")).to_contain_text(re.compile(r"position \d+ of \d+.* left"))
    service.wait_for_visits(run_id, 8)
    expect(page.locator("#north-label")).to_have_text("North so far")
    expect(page.locator("#azimuth-u")).to_have_text(re.compile("^±"))
    expect(page.locator("#settle [data-visits]")).to_have_attribute(
        "data-visits", re.compile(r"^([89]|\d\d+)$")
    )
    expect(page.locator("#events")).to_contain_text("position 1:")


def test_the_keyboard_alone_brings_north(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    if not page.locator("#positions").is_visible():
        _tab_to(page, page.locator("#change"))
        page.keyboard.press("Enter")
    _tab_to(page, page.locator("#positions"))
    page.keyboard.press("Control+A")
    page.keyboard.type("4")
    _tab_to(page, page.locator("#dwell_s"))
    page.keyboard.press("Control+A")
    with page.expect_response("**/api/v1/plans"):
        page.keyboard.type("1")
    _tab_to(page, find_button(page))
    with page.expect_response(is_start) as begun:
        page.keyboard.press("Enter")
    run_id = begun.value.json()["run_id"]
    wait_for_run(page, run_id, "completed")
    certificate = page.get_by_role("link", name="Certificate")
    _tab_to(page, certificate)
    with page.context.expect_page() as opened:
        page.keyboard.press("Enter")
    expect(opened.value.locator("body")).to_contain_text(run_id)


@pytest.mark.parametrize("way", ["click", "Escape twice", "Tab and Enter"])
def test_stop_stops_the_table_and_ends_the_run(
    browsing: Browsing, service: ServiceProcess, way: str
) -> None:
    page = browsing.page(service.address)
    run_id = _begin_long_run(page, service)
    stop = page.get_by_role("button", name="STOP")
    if way == "click":
        stop.click()
    elif way == "Escape twice":
        page.keyboard.press("Escape")
        page.keyboard.press("Escape")
    else:
        _tab_to(page, stop)
        page.keyboard.press("Enter")
    wait_for_run(page, run_id, "ended")
    assert service.run(run_id)["state"] == "aborted"
    rig = service.api.get("/rig").json()
    assert (rig["state"], rig["table"]["moving"]) == ("ready", False)
    expect(page.locator("#what")).to_contain_text("ended by hand")


def test_a_run_is_paused_resumed_and_aborted_by_its_buttons(
    browsing: Browsing, service: ServiceProcess
) -> None:
    page = browsing.page(service.address)
    run_id = _begin_long_run(page, service)
    page.get_by_role("button", name="Pause").click()
    wait_for_run(page, run_id, "paused")
    assert service.run(run_id)["state"] == "paused"
    page.get_by_role("button", name="Resume").click()
    wait_for_run(page, run_id, "running")
    assert service.run(run_id)["state"] == "running"
    page.get_by_role("button", name="Abort").click()
    wait_for_run(page, run_id, "ended")
    assert service.run(run_id)["state"] == "aborted"
    wait_for_run(page, _click_find(page), "running")


def test_switching_the_unit_shows_the_same_north(
    browsing: Browsing, service: ServiceProcess
) -> None:
    result = service.wait(service.start())["result"]
    page = browsing.page(service.address)
    for unit, circle in (("gon", 400), ("mil", 6400)):
        page.locator(f"[data-unit={unit}]").click()
        expect(page.locator("#azimuth-u")).to_contain_text(unit)
        value, _ = north_shown(page)
        step = 10.0 ** -len(value.partition(".")[2])
        assert abs(float(value) - result["azimuth_deg"] * circle / 360) <= step / 2 * 1.001
