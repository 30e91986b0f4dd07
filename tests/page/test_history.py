"""The history: filtered, paged, compared, and as a control chart."""

import re
from collections.abc import Iterator
from pathlib import Path
from statistics import mean, stdev
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from northfinder.procedures.plain_json import headline
from northfinder.records import NewRun, Records
from tests.page.browsing import Browsing, north_shown, rounded, wait_for_run
from tests.service.process import ServiceProcess, serving, stored, wait_until_ready

_COMPLETED = 55  # more than one page of fifty
_FAILED = 3


def _measure(folder: Path) -> dict[str, Any]:
    """Measure once, for a result that is a result."""
    with serving(folder) as service:
        wait_until_ready(service)
        return service.wait(service.start({"kind": "north-seek", "positions": 6, "dwell_s": 1}))


def _add(records: Records, run: dict[str, Any], azimuth_deg: float | None) -> None:
    """Record a run as if it had been carried out; without an azimuth it failed."""
    same = {key: run[key] for key in ("kind", "rig_name", "plan", "site", "rig", "simulation")}
    new = NewRun(**same, prediction=run["prediction"], software=run["software"])
    run_id = records.create_run(new).id
    records.set_state(run_id, "running")
    if azimuth_deg is None:
        records.fail(run_id, "the table stopped 0.31 deg short of 135 deg")
        records.set_state(run_id, "aborted")
    else:
        result = {**run["result"], "run_id": run_id, "azimuth_deg": azimuth_deg}
        records.finish(run_id, result, headline(result))


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """A rig with weeks of runs behind it."""
    folder = tmp_path_factory.mktemp("history")
    run = _measure(folder)
    sigma_deg = run["azimuth_sigma_deg"]
    scatter_deg = np.random.default_rng(3).normal(0.0, sigma_deg, _COMPLETED - 1)
    with stored(folder) as records:
        for _ in range(_FAILED):
            _add(records, run, None)
        for off_deg in scatter_deg:
            _add(records, run, run["azimuth_deg"] + off_deg)
    with serving(folder) as running:
        wait_until_ready(running)
        yield running


def _rows(page: Page) -> Locator:
    return page.locator("#history tbody tr")


def test_more_shows_the_older_runs(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    expect(_rows(page)).to_have_count(50)
    page.locator("#history").get_by_role("button", name="more").click()
    expect(_rows(page)).to_have_count(_COMPLETED + _FAILED)
    expect(page.locator("#history").get_by_role("button", name="more")).to_be_hidden()


def test_a_filter_shows_only_what_it_names(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    state = page.get_by_role("combobox", name="state")
    state.select_option("aborted")
    expect(_rows(page)).to_have_count(_FAILED)
    expect(_rows(page).filter(has_text="aborted")).to_have_count(_FAILED)
    state.select_option("completed")
    expect(_rows(page)).to_have_count(50)
    page.locator("#history").get_by_role("button", name="more").click()
    expect(_rows(page)).to_have_count(_COMPLETED)
    state.select_option("interrupted")
    expect(page.locator("#history")).to_contain_text("No such run.")
    state.select_option("")
    expect(_rows(page)).to_have_count(50)


def test_a_run_of_before_is_shown_by_a_click(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    run = service.api.get("/runs").json()["runs"][7]
    _rows(page).nth(7).get_by_role("button").click()
    wait_for_run(page, run["run_id"], "completed")
    shown = rounded(run["azimuth_deg"], run["azimuth_sigma_deg"])
    assert north_shown(page) == shown
    expect(_rows(page).nth(7)).to_contain_text(shown[0])


def test_two_runs_are_compared(browsing: Browsing, service: ServiceProcess) -> None:
    page = browsing.page(service.address)
    newest, other = service.api.get("/runs").json()["runs"][:2]
    for row in (0, 1):
        _rows(page).nth(row).get_by_role("checkbox").check()
    compared = page.get_by_role("region", name="Compare")
    expect(compared.get_by_role("columnheader")).to_have_count(2)
    for run in (newest, other):
        value, expanded = rounded(run["azimuth_deg"], run["azimuth_sigma_deg"])
        expect(compared).to_contain_text(f"{value} {expanded.removesuffix('°')}")
    # ISO 13528: the difference over its expanded uncertainty.
    apart_deg = other["azimuth_deg"] - newest["azimuth_deg"]
    both_deg = 2 * float(np.hypot(newest["azimuth_sigma_deg"], other["azimuth_sigma_deg"]))
    expect(compared).to_contain_text(f"{abs(apart_deg) / both_deg:.2f}")
    page.locator("#compare").get_by_role("button", name="close").click()
    expect(compared).to_have_count(0)


def test_the_control_chart_tells_mean_and_scatter(
    browsing: Browsing, service: ServiceProcess
) -> None:
    page = browsing.page(service.address)
    plot = page.locator("#control [role=img][data-visits]")
    expect(plot).to_have_attribute("aria-label", re.compile(r"^\d+ completed runs"))
    told = plot.get_attribute("aria-label") or ""
    count, mean_deg, scatter_deg = re.findall(r"[\d.]+\d", told.partition("runs")[0] + told)[-3:]
    runs = service.api.get("/runs", params={"state": "completed"}).json()["runs"]
    azimuths_deg = [run["azimuth_deg"] for run in runs][: int(count)]
    assert int(count) >= 10
    assert mean(azimuths_deg) == pytest.approx(
        float(mean_deg), abs=0.6 * 10.0 ** -len(mean_deg.partition(".")[2])
    )
    assert stdev(azimuths_deg) == pytest.approx(float(scatter_deg), abs=0.6e-4)
