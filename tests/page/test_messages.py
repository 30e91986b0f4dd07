"""What goes wrong is said in words, with what to do, and mends when it is mended."""

import re
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.page.browsing import (
    Browsing,
    choose_plan,
    find_button,
    is_start,
    show,
    wait_for_phase,
    wait_for_run,
)
from tests.service.process import LONG, SHORT, ServiceProcess, serving, wait_until_ready

_TOKEN = "a token of the tests".replace(" ", "-")


def _refused(status: int) -> str:
    return rf"status of {status}"


@pytest.mark.usefixtures("idle")
def test_a_failed_run_says_why_and_is_resumed(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    fault = {"device": "turntable", "short_by_deg": 0.31}
    run_id = service.start({**SHORT, "positions": 24, "dwell_s": 10})
    service.wait_for_visits(run_id, 4)
    service.api.post("/rig/simulation/faults", json=fault)
    wait_for_run(page, run_id, "stopped")
    expect(page.locator("#run-state")).to_contain_text("Stopped")
    expect(page.locator("#what")).to_contain_text(re.compile(r"0\.3\d? deg"))
    expect(page.locator("#what")).to_contain_text("short of")
    expect(page.locator("#means")).to_contain_text(re.compile(r"\d+ of \d+ visits"))
    expect(page.locator("#what-to-do")).to_contain_text("resume")
    expect(find_button(page)).to_be_disabled()
    expect(page.locator("#find-why")).to_contain_text("Resume or end the stopped run")
    service.api.delete("/rig/simulation/faults")
    page.get_by_role("button", name="Resume").click()
    wait_for_run(page, run_id, "completed")
    assert service.run(run_id)["state"] == "completed"


@pytest.mark.usefixtures("idle")
def test_a_failure_after_a_pause_names_its_cause_first(
    browsing: Browsing, service: ServiceProcess
) -> None:
    page = browsing.page(service.address)
    # A pause that is longer than a dwell, however soon the page shows it: then it homes anew.
    run_id = service.start({**SHORT, "positions": 48, "dwell_s": 2})
    service.wait_for_visits(run_id, 4)
    service.api.post(f"/runs/{run_id}/pause")
    wait_for_run(page, run_id, "paused")
    fault = {"device": "turntable", "short_by_deg": 0.31}
    service.api.post("/rig/simulation/faults", json=fault)
    service.api.post(f"/runs/{run_id}/resume")
    wait_for_run(page, run_id, "stopped")
    assert service.run(run_id)["error"].startswith("to see that nothing moved, visit")
    expect(page.locator("#what")).to_have_text(re.compile("^The table .* short of"))
    service.api.post(f"/runs/{run_id}/abort")
    service.api.delete("/rig/simulation/faults")


@pytest.mark.usefixtures("idle")
def test_a_stopped_run_can_be_ended(browsing: Browsing, service: ServiceProcess) -> None:
    service.api.post("/rig/simulation/faults", json={"device": "turntable", "short_by_deg": 1})
    run_id = service.start()
    service.wait(run_id, "failed")
    page = browsing.page(service.address)
    page.get_by_role("button", name="End run").click()
    wait_for_run(page, run_id, "ended")
    assert service.run(run_id)["state"] == "aborted"
    expect(find_button(page)).to_be_enabled()


@pytest.mark.usefixtures("idle")
def test_an_offline_rig_is_said_and_comes_back(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    service.api.post("/rig/simulation/faults", json={"device": "turntable", "silent": True})
    banner = page.get_by_role("alert").filter(has_text="The rig is offline.")
    expect(banner).to_contain_text("power and cables")
    expect(find_button(page)).to_be_disabled()
    expect(page.locator("#find-why")).to_have_text("The rig is offline.")
    service.api.delete("/rig/simulation/faults")
    expect(banner).to_have_count(0)
    expect(find_button(page)).to_be_enabled()


@pytest.mark.slow
def test_locked_records_are_said_and_come_back(browsing: Browsing, tmp_path: Path) -> None:
    browsing.expect_complaint(_refused(503))
    with serving(tmp_path) as service:
        wait_until_ready(service)
        page = browsing.page(service.address)
        banner = page.get_by_role("alert").filter(has_text="The records cannot be written.")
        with closing(sqlite3.connect(tmp_path / "records.db", isolation_level=None)) as other:
            other.execute("BEGIN EXCLUSIVE")
            with page.expect_response(is_start) as answer:
                find_button(page).click()
            assert answer.value.status == 503
            expect(banner).to_contain_text("locked")
            expect(page.locator("#find-why")).to_contain_text("records")
            expect(find_button(page)).to_be_disabled()
            other.execute("ROLLBACK")
        expect(banner).to_have_count(0)
        choose_plan(page, 4, 1)
        find_button(page).click()
        wait_for_phase(page, "completed")
        browsing.close()


@pytest.mark.slow
def test_records_locked_during_a_run_stop_it_in_words(browsing: Browsing, tmp_path: Path) -> None:
    with serving(tmp_path) as service:
        wait_until_ready(service)
        page = browsing.page(service.address)
        run_id = service.start({**LONG, "positions": 90, "dwell_s": 20})
        service.wait_for_visits(run_id, 1)
        banner = page.get_by_role("alert").filter(has_text="The records cannot be written.")
        with closing(sqlite3.connect(tmp_path / "records.db", isolation_level=None)) as other:
            other.execute("PRAGMA busy_timeout = 20000")
            other.execute("BEGIN EXCLUSIVE")
            expect(banner).to_contain_text("Check the database")
            # The banner may come from who reads; the run ends when its own write gives up.
            service.wait_for_log(f"run {run_id} failed")
            assert service.api.get("/rig").json()["table"]["moving"] is False
            other.execute("ROLLBACK")
        wait_for_run(page, run_id, "stopped")
        expect(banner).to_have_count(0)
        page.get_by_role("button", name="Resume").click()
        wait_for_run(page, run_id, "running")
        browsing.close()


def test_a_service_with_a_token_asks_for_it(browsing: Browsing, tmp_path: Path) -> None:
    browsing.expect_complaint(_refused(401))
    with serving(tmp_path, NORTHFINDER_TOKEN=_TOKEN) as service:
        page = browsing.context().new_page()
        page.goto(service.address)
        dialog = page.get_by_role("dialog", name="Access token")
        expect(dialog).to_be_visible()
        dialog.get_by_label("token").fill("not this one, certainly")
        dialog.get_by_role("button").click()
        expect(dialog.get_by_role("alert")).to_have_text("This is not the token.")
        dialog.get_by_label("token").fill(_TOKEN)
        page.keyboard.press("Enter")
        expect(dialog).to_be_hidden()
        expect(find_button(page)).to_be_enabled()
        show(page, service.address)
        expect(dialog).to_be_hidden()
        choose_plan(page, 4, 1)
        find_button(page).click()
        wait_for_phase(page, "completed")
        browsing.close()


@pytest.mark.usefixtures("idle")
def test_a_second_run_is_refused_with_the_reason(
    browsing: Browsing, service: ServiceProcess
) -> None:
    page = browsing.page(service.address)
    service.start({**LONG, "positions": 90, "dwell_s": 20})
    expect(page.locator("#find")).to_be_disabled()
    expect(page.locator("#find-why")).to_contain_text("One run at a time.")
    expect(page.locator("#find-why")).to_contain_text("Ready in")
    assert page.locator("#find").get_attribute("aria-describedby") == "find-why"
    service.api.post("/rig/stop")
    expect(page.locator("#find")).to_be_enabled()


@pytest.mark.usefixtures("idle")
@pytest.mark.parametrize(
    ("name", "value", "says"),
    [("positions", "2", "3"), ("dwell_s", "-1", "0"), ("latitude_deg", "89.5", "89")],
)
def test_what_the_service_refuses_stands_beside_the_field(
    browsing: Browsing, service: ServiceProcess, name: str, value: str, says: str
) -> None:
    browsing.expect_complaint(_refused(422))
    page = browsing.page(service.address)
    choose_plan(page, 12, 5)
    field = page.locator(f"#{name}")
    before = field.input_value()
    field.fill(value)
    expect(page.locator(f"#{name}-error")).to_contain_text(says)
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(find_button(page)).to_be_disabled()
    field.fill(before)
    expect(page.locator(f"#{name}-error")).to_be_empty()
    expect(find_button(page)).to_be_enabled()
