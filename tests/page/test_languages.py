"""English and Chinese: every word has its translation, and a switch changes nothing else."""

import json
import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.page.browsing import (
    Browsing,
    choose_kind,
    choose_plan,
    north_shown,
    wait_for_phase,
    wait_for_run,
)
from tests.service.process import ServiceProcess

_WEB = Path(__file__).parents[2] / "web"
_WORDS = json.loads((_WEB / "words.json").read_text(encoding="utf-8"))
_HOLE = re.compile(r"\{\w+\}")
#: Latin letters that stay in a Chinese text.
_STAYS = {
    "northfinder",
    "EN",
    "N",
    "E",
    "S",
    "W",
    "R",
    "a",
    "b",
    "z",
    "T",
    "cos",
    "sin",
    "csv",
    "json",
    "parquet",
    "h",
    "s",
    "g",
    "mg",
    "C",
    "byte",
    "Hz",
    "Esc",
    "E_n",
    "QUEST",
    "TRIAD",
}


def _used() -> set[str]:
    """Return every key that stands in the page's files as it is."""
    keys = set()
    for script in _WEB.glob("*.js"):
        text = script.read_text(encoding="utf-8")
        keys |= set(re.findall(r'\bt\("((?:[^"\\]|\\.)+)"', text))
    page = (_WEB / "index.html").read_text(encoding="utf-8")
    keys |= {text.strip() for text in re.findall(r"<[^>]*\sdata-t(?=[\s>])[^>]*>([^<]+)<", page)}
    return keys | set(re.findall(r'data-t-label="([^"]+)"', page))


def test_every_text_has_a_chinese_one() -> None:
    used = _used()
    assert len(used) > 60, "the texts are written in some other way now"
    assert sorted((used | _WORDS["en"].keys()) - _WORDS["zh"].keys()) == []


def test_every_kind_of_state_and_trouble_has_its_words() -> None:
    prefixes = {
        prefix
        for script in _WEB.glob("*.js")
        for prefix in re.findall(r"\bt\(`([a-z]+)\.\$\{", script.read_text(encoding="utf-8"))
    }
    for prefix in prefixes:
        named = {key for key in _WORDS["en"] if key.startswith(f"{prefix}.")}
        assert named
        assert named <= _WORDS["zh"].keys()


def test_a_translation_has_the_same_holes() -> None:
    for key, chinese in _WORDS["zh"].items():
        english = _WORDS["en"].get(key, key)
        assert set(_HOLE.findall(chinese)) == set(_HOLE.findall(english)), key


# Each visible text, label and title, but not what the service itself says (marked as English).
_TEXTS = """() => {
  const foreign = "[lang=en], .unseen, option:not(:checked)";
  const own = (one) => [...one.childNodes].filter(({ nodeType }) => nodeType === Node.TEXT_NODE);
  return [...document.body.querySelectorAll("*")]
    .filter((one) => one.checkVisibility() && !one.closest(foreign))
    .flatMap((one) => [...own(one).map(({ data }) => data), one.ariaLabel, one.title])
    .filter((text) => typeof text === "string" && text.trim());
}"""


def _english_words(page: Page, service: ServiceProcess) -> list[str]:
    """Return the visible texts that have a Latin word which is none of those that stay."""
    rig = service.api.get("/rig").json()
    names = json.dumps([rig["name"], [device["identity"] for device in rig["devices"]]])
    names += json.dumps([device["driver"] for device in rig["devices"]])
    stays = _STAYS | set(re.findall(r"[A-Za-z_]+", names))
    texts: list[str] = page.evaluate(_TEXTS)
    return [text.strip() for text in texts if set(re.findall(r"[A-Za-z_]+", text)) - stays]


@pytest.mark.usefixtures("idle")
def test_a_chinese_page_speaks_chinese_before_during_and_after_a_run(
    browsing: Browsing, service: ServiceProcess
) -> None:
    page = browsing.page(service.address, locale="zh-CN")
    expect(page.locator("html")).to_have_attribute("lang", "zh-Hans")
    choose_plan(page, 90, 20)
    page.locator("#simulation summary").click()
    expect(page.locator("#simulation-body fieldset")).to_have_count(4)
    english = {"before": _english_words(page, service)}
    run_id = service.start({"kind": "north-seek", "positions": 90, "dwell_s": 20})
    service.wait_for_visits(run_id, 5)
    wait_for_run(page, run_id, "running")
    expect(page.locator("#settle [data-visits]")).to_be_attached()
    english["running"] = _english_words(page, service)
    service.api.post(f"/runs/{run_id}/pause")
    wait_for_run(page, run_id, "paused")
    english["paused"] = _english_words(page, service)
    service.api.post("/rig/stop")
    wait_for_run(page, run_id, "ended")
    english["ended"] = _english_words(page, service)
    run_id = service.start()
    wait_for_run(page, run_id, "completed")
    expect(page.locator("#solvers")).to_contain_text("矢量法")
    english["completed"] = _english_words(page, service)
    assert {state: words for state, words in english.items() if words} == {}


@pytest.mark.usefixtures("idle")
def test_every_kind_of_run_speaks_chinese(browsing: Browsing, service: ServiceProcess) -> None:
    browsing.expect_complaint("422")  # there may be no heading to hold yet
    page = browsing.page(service.address, locale="zh-CN")
    english = {}
    for body in (
        {"kind": "alignment", "duration_s": 20},
        {"kind": "heading-hold", "duration_s": 20},
        {"kind": "noise", "duration_s": 30},
    ):
        kind = str(body["kind"])
        run_id = service.start({**body, "duration_s": 3600})
        wait_for_run(page, run_id, "running")
        expect(page.locator("#run-detail")).to_contain_text("剩余")
        choose_kind(page, kind)
        english[f"{kind} running"] = _english_words(page, service)
        service.api.post("/rig/stop")
        wait_for_run(page, run_id, "ended")
        english[f"{kind} ended"] = _english_words(page, service)
        run_id = service.start(body)
        wait_for_run(page, run_id, "completed")
        expect(page.locator("#numbers")).to_contain_text("数值")
        english[f"{kind} completed"] = _english_words(page, service)
    page.locator("#studies > summary").click()
    page.locator("[data-study=coning-rk4] > summary").click()
    expect(page.locator("[data-study=coning-rk4] .verdict").first).to_be_visible()
    english["studies"] = _english_words(page, service)
    assert {state: words for state, words in english.items() if words} == {}


@pytest.mark.usefixtures("idle")
def test_switching_the_language_keeps_the_run(browsing: Browsing, service: ServiceProcess) -> None:
    run_id = service.start({"kind": "north-seek", "positions": 6, "dwell_s": 2})
    page = browsing.page(service.address)
    wait_for_run(page, run_id, "completed")
    before = north_shown(page)
    page.locator("[data-lang=zh]").click()
    expect(page.locator("#run-state")).to_contain_text("已完成")
    expect(page.locator("[data-lang=zh]")).to_have_attribute("aria-pressed", "true")
    wait_for_run(page, run_id, "completed")
    assert north_shown(page) == before
    page.reload()
    wait_for_phase(page, "completed")
    expect(page.locator("#run-state")).to_contain_text("已完成")
    page.locator("[data-lang=en]").click()
    expect(page.locator("#run-state")).to_contain_text("Completed")
    assert north_shown(page) == before
