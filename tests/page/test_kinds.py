"""The other kinds of run from the page: alignment, heading hold, noise; each by its own form."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, Response, expect

from tests.page.browsing import (
    Browsing,
    choose_kind,
    is_start,
    north_shown,
    rounded,
    wait_for_phase,
    wait_for_run,
)
from tests.service.process import ServiceProcess, serving, wait_until_ready

pytestmark = pytest.mark.usefixtures("idle")

_GYRO_NOISE_DEG_SQRT_H = 0.001  # the simulated rig's


@pytest.fixture(autouse=True)
def _still(service: ServiceProcess) -> Iterator[None]:
    yield
    service.api.patch("/rig/simulation", json={"base": "still"})


def _begin(page: Page, button: str) -> str:
    """Press the button that begins a run; return the run's id."""
    with page.expect_response(is_start) as begun:
        page.get_by_role("button", name=button, exact=True).locator("visible=true").click()
    run_id: str = begun.value.json()["run_id"]
    return run_id


def _fill(page: Page, field: str, value: float) -> None:
    with page.expect_response("**/api/v1/plans"):
        page.locator(f"#{field}").fill(f"{value:g}")


def _chart(page: Page, panel: str) -> Locator:
    return page.locator(f"#{panel} [role=img][data-visits]")


def _asked(answer: Response) -> dict[str, Any]:
    """Return what the page asked, of the answer that it got."""
    asked: dict[str, Any] = json.loads(answer.request.post_data or "")
    return asked


def _apart_deg(one_deg: float, other_deg: float) -> float:
    return abs((one_deg - other_deg + 180) % 360 - 180)


def test_an_alignment_on_a_rocking_base_brings_north(
    browsing: Browsing, service: ServiceProcess
) -> None:
    page = browsing.page(service.address)
    page.locator("#simulation > summary").click()
    base = page.get_by_label("base")
    with page.expect_response(lambda answer: answer.request.method == "PATCH"):
        base.select_option(label="vehicle, light wind")
    assert service.api.get("/rig/simulation").json()["base"] == "nominal"
    choose_kind(page, "alignment")
    _fill(page, "align-duration_s", 30)
    run_id = _begin(page, "Align")
    wait_for_run(page, run_id, "completed")
    result = service.run(run_id)["result"]
    assert north_shown(page) == rounded(result["azimuth_deg"], result["azimuth_sigma_deg"])
    truth_deg = service.api.get("/rig/simulation").json()["azimuth_deg"]
    assert _apart_deg(result["azimuth_deg"], truth_deg) < 4 * result["azimuth_sigma_deg"]
    expect(_chart(page, "track")).to_have_attribute("aria-label", re.compile(r"After 30 s"))
    pitch, expanded = rounded(result["pitch_deg"], result["level_sigma_deg"])
    written = f"pitch{pitch.replace('-', '−')}°{expanded.removesuffix('°')}"
    expect(page.locator("#numbers")).to_contain_text(written)
    expect(page.locator("#checks li")).to_have_count(len(result["checks"]))
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="Certificate").click()
    expect(opened.value.locator("body")).to_contain_text(run_id)


def test_a_heading_is_held_after_a_north_seek(browsing: Browsing, service: ServiceProcess) -> None:
    found = service.wait(service.start({"kind": "north-seek", "positions": 6, "dwell_s": 1}))
    page = browsing.page(service.address)
    page.get_by_role("button", name="Hold this heading").click()
    expect(page.locator("#hold-from_run")).to_have_value(found["run_id"])
    _fill(page, "hold-duration_s", 30)
    run_id = _begin(page, "Hold heading")
    wait_for_run(page, run_id, "completed")
    run = service.run(run_id)
    assert run["plan"]["from_run"] == found["run_id"]
    held = run["result"]
    assert north_shown(page) == rounded(held["azimuth_deg"], held["azimuth_sigma_deg"])
    assert held["azimuth_sigma_deg"] >= found["azimuth_sigma_deg"]  # what is not known grows
    expect(page.locator("#sureness h2")).to_have_text("How it grows uncertain")
    grown = rounded(0.0, held["azimuth_sigma_deg"])[1]
    expect(_chart(page, "sureness")).to_have_attribute("aria-label", re.compile(re.escape(grown)))


def test_a_noise_record_suggests_the_next_dwell(
    browsing: Browsing, service: ServiceProcess
) -> None:
    page = browsing.page(service.address)
    choose_kind(page, "noise")
    expect(page.locator("#giving")).to_be_hidden()  # it finds no north
    _fill(page, "noise-duration_s", 24)
    run_id = _begin(page, "Record noise")
    wait_for_run(page, run_id, "completed")
    result = service.run(run_id)["result"]
    walk = result["gyro"]["angle_random_walk_deg_sqrt_h"]["value"]
    assert walk == pytest.approx(_GYRO_NOISE_DEG_SQRT_H, rel=0.1)
    shown = page.locator("#azimuth-value > span").inner_text()
    assert float(shown) == pytest.approx(walk, rel=6e-3)  # three digits
    expect(_chart(page, "allan")).to_have_count(2)
    expect(page.locator("#figures tbody tr")).to_have_count(2 + 4 + 4)
    row = page.locator("#history tbody tr").first
    expect(row).to_contain_text(shown)
    expect(row.get_by_role("checkbox")).to_be_hidden()
    with page.expect_response("**/api/v1/plans") as predicted:
        page.get_by_role("button", name="Use this dwell").click()
    dwell_s = float(f"{result['suggestion']['dwell_s']:.2g}")
    assert _asked(predicted.value)["dwell_s"] == dwell_s
    expect(page.locator("#dwell_s")).to_have_value(f"{dwell_s:g}")
    expect(page.get_by_role("radio", name="Seek")).to_be_checked()
    expect(page.get_by_role("button", name="Find north").locator("visible=true")).to_be_focused()


def test_an_alignment_can_only_be_aborted(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    choose_kind(page, "alignment")
    _fill(page, "align-duration_s", 3600)
    run_id = _begin(page, "Align")
    wait_for_run(page, run_id, "running")
    expect(page.locator("#run-detail")).to_contain_text("aligning")
    expect(page.get_by_role("button", name="Pause")).to_be_hidden()
    page.get_by_role("button", name="Abort").click()
    wait_for_run(page, run_id, "ended")
    assert service.run(run_id)["state"] == "aborted"
    expect(page.locator("#what")).to_contain_text("ended by hand")
    expect(page.get_by_role("button", name="Resume")).to_be_hidden()
    with page.expect_response(is_start) as again:
        page.locator("#message").get_by_role("button", name="Again").click()
    assert _asked(again.value)["duration_s"] == 3600
    assert "sensors" not in _asked(again.value)  # of that day
    wait_for_run(page, again.value.json()["run_id"], "running")


def test_a_refusal_stands_beside_its_field(browsing: Browsing, service: ServiceProcess) -> None:
    browsing.expect_complaint("422")
    page = browsing.page(service.address)
    choose_kind(page, "alignment")
    _fill(page, "align-duration_s", 2)
    expect(page.locator("#align-duration_s-error")).to_contain_text("greater than or equal to 10")
    expect(page.get_by_role("button", name="Align").locator("visible=true")).to_be_disabled()
    expect(page.locator("#warm")).to_be_hidden()  # this method has no filter
    page.locator("#align-method").select_option(label="TRIAD")
    expect(page.locator("#warm")).to_be_visible()
    _fill(page, "align-duration_s", 20)
    expect(page.locator("#align-duration_s-error")).to_be_empty()


def test_a_north_seek_and_an_alignment_are_compared(
    browsing: Browsing, service: ServiceProcess
) -> None:
    for body in (
        {"kind": "north-seek", "positions": 6, "dwell_s": 1},
        {"kind": "alignment", "duration_s": 20},
    ):
        service.wait(service.start(body))
    page = browsing.page(service.address)
    for row in (0, 1):
        page.locator("#history tbody tr").nth(row).get_by_role("checkbox").check()
    compared = page.get_by_role("region", name="Compare")
    expect(compared.get_by_role("columnheader")).to_have_count(2)
    expect(compared).to_contain_text(re.compile(r"pitch.*E_n"))


def test_the_keyboard_chooses_a_kind_and_learns_what_is_missing(
    browsing: Browsing, tmp_path: Path
) -> None:
    browsing.expect_complaint("422")
    with serving(tmp_path) as fresh:
        wait_until_ready(fresh)
        page = browsing.page(fresh.address)
        wait_for_phase(page, "idle")
        page.get_by_role("radio", name="Seek").focus()
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        expect(page.get_by_role("radio", name="Hold")).to_be_checked()
        expect(page.locator("#find-why")).to_contain_text("find north or align first")
        expect(page.locator("#first")).to_be_disabled()
        page.keyboard.press("ArrowRight")
        expect(page.locator("#promise-words")).to_contain_text("Nothing is moved.")
        expect(page.locator("#first")).to_have_text("Record noise")
        browsing.close()
