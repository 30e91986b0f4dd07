"""A page that lost the service, or came late, shows what it missed: nothing lost, nothing twice."""

import re
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page, Route, expect

from tests.page.browsing import Browsing, show, wait_for_run
from tests.page.cable import Cable, cable_to
from tests.page.following import expect_every_event
from tests.service.process import ServiceProcess, serving, wait_until_ready

#: Its events fit into the page's list, and it lasts long enough to be disturbed.
_RUN = {"kind": "north-seek", "positions": 12, "dwell_s": 10}
#: What Chromium, and the page after it, say of a connection that is gone.
_CUT = r"net::ERR_|dynamically imported module|The service did not answer"


def _begin(page: Page, service: ServiceProcess) -> str:
    """Begin a run and wait until the page draws it."""
    run_id = service.start(_RUN)
    expect(page.locator("#event-list")).to_contain_text("position 3:")
    return run_id


def test_a_killed_service_leaves_a_run_that_the_page_resumes(
    browsing: Browsing, tmp_path: Path
) -> None:
    browsing.expect_complaint(_CUT)
    with serving(tmp_path, "--sim-speed", "20") as first:
        wait_until_ready(first)
        page = browsing.page(first.address)
        run_id = _begin(page, first)
        first.kill()
        expect(page.locator("#banner")).to_contain_text("connection to the service is lost")
        expect(page.locator("#run-state")).to_contain_text("Link lost")
    with serving(tmp_path, "--port", str(urlsplit(first.address).port)) as second:
        wait_for_run(page, run_id, "stopped")
        expect(page.locator("#run-state")).to_contain_text("Interrupted")
        expect(page.locator("#what")).to_contain_text("service ended")
        expect(page.locator("#banner")).to_be_empty()
        page.get_by_role("button", name="Resume").click()
        wait_for_run(page, run_id, "completed")
        assert second.run(run_id)["state"] == "completed"
        expect_every_event(page, second, run_id)
        browsing.close()


@pytest.mark.usefixtures("idle")
@pytest.mark.parametrize("lose", [Cable.cut, Cable.hold])
def test_a_page_whose_network_dropped_catches_up(
    browsing: Browsing, service: ServiceProcess, lose: Callable[[Cable], None]
) -> None:
    browsing.expect_complaint(_CUT)
    with cable_to(service.address) as cable:
        page = browsing.page(cable.address)
        run_id = _begin(page, service)
        lose(cable)
        expect(page.locator("#banner")).to_contain_text("connection to the service is lost")
        service.wait(run_id)
        cable.mend()
        wait_for_run(page, run_id, "completed")
        expect_every_event(page, service, run_id)
        expect(page.locator("#banner")).to_be_empty()
        browsing.close()


@pytest.mark.usefixtures("idle")
@pytest.mark.parametrize("what", ["/api/v1/runs/[^/?]+$", "/static/events[.]js$"])
def test_what_did_not_come_the_first_time_is_asked_for_again(
    browsing: Browsing, service: ServiceProcess, what: str
) -> None:
    browsing.expect_complaint(_CUT)
    page = browsing.context().new_page()
    failed: list[str] = []

    def fail_once(route: Route) -> None:
        if failed:
            route.continue_()
        else:
            failed.append(route.request.url)
            route.abort("connectionreset")

    show(page, service.address)
    page.route(re.compile(what), fail_once)
    run_id = service.start(_RUN)
    wait_for_run(page, run_id, "completed")
    assert failed
    expect_every_event(page, service, run_id)


@pytest.mark.usefixtures("idle")
def test_a_run_that_ended_before_the_page_heard_of_the_rig_is_shown(
    browsing: Browsing, service: ServiceProcess
) -> None:
    page = browsing.context().new_page()
    runs: list[str] = []

    def run_first(route: Route) -> None:
        runs.append(service.start())
        service.wait(runs[0])
        route.continue_()

    page.route(re.compile("/rig/events$"), run_first, times=1)
    with page.expect_response(re.compile("/rig/events$")):
        show(page, service.address)
    wait_for_run(page, runs[0], "completed")


@pytest.mark.usefixtures("idle")
def test_a_page_that_slept_catches_up(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    run_id = _begin(page, service)
    browser = page.context.new_cdp_session(page)
    browser.send("Page.setWebLifecycleState", {"state": "frozen"})
    service.wait(run_id)
    browser.send("Page.setWebLifecycleState", {"state": "active"})
    wait_for_run(page, run_id, "completed")
    expect_every_event(page, service, run_id)


@pytest.mark.usefixtures("idle")
def test_a_page_opened_in_mid_run_shows_everything_so_far(
    browsing: Browsing, service: ServiceProcess
) -> None:
    run_id = service.start(_RUN)
    service.wait_for_visits(run_id, 5)
    service.api.post(f"/runs/{run_id}/pause")
    service.wait(run_id, "paused")
    page = browsing.page(service.address)
    wait_for_run(page, run_id, "paused")
    expect_every_event(page, service, run_id)
    service.api.post(f"/runs/{run_id}/resume")
    wait_for_run(page, run_id, "completed")
    expect_every_event(page, service, run_id)


@pytest.mark.usefixtures("idle")
def test_two_pages_show_the_same_run(browsing: Browsing, service: ServiceProcess) -> None:
    pages = [browsing.page(service.address) for _ in range(2)]
    run_id = service.start(_RUN)
    for page in pages:
        wait_for_run(page, run_id, "completed")
        expect_every_event(page, service, run_id)
