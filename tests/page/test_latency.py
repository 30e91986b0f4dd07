"""From what happened at the rig to what a reader sees of it."""

import re
import time
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.evidence import Record
from tests.page.browsing import Browsing, find_button, is_start, rounded, show, wait_for_run
from tests.page.following import recorded
from tests.service.process import Event, ServiceProcess, serving, wait_until_ready

_NUMBER_S = 0.150
_CHARTS_S = 0.700
#: A short form's machine may do other things besides: so much longer there.
_ALLOWANCE = 3.0

# What the number, the dial and the charts say, after every frame in which they changed.
_NOTE_CHANGES = """
window.seen = [];
addEventListener("DOMContentLoaded", () => {
  const text = (selector) => document.querySelector(selector).textContent;
  const drawn = (id) => Number(document.querySelector(`#${id} [data-visits]`)?.dataset.visits ?? 0);
  const note = () => seen.push({
    time_s: (performance.timeOrigin + performance.now()) / 1000,
    number: [text("#azimuth-value > span"), text("#azimuth-u")],
    dial: document.querySelector("#face").getAttribute("aria-label"),
    fit: drawn("fit"),
    settle: drawn("settle"),
  });
  const afterThisFrame = () => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = note;
    port2.postMessage(null);
  };
  new MutationObserver(afterThisFrame).observe(document.body, {
    subtree: true, childList: true, characterData: true,
    attributeFilter: ["aria-label", "data-visits"],
  });
});
"""

Seen = dict[str, Any]
_T = TypeVar("_T", bound=Hashable)


@dataclass(frozen=True, slots=True)
class Delays:
    """How late the events of a run were shown, in seconds."""

    number: list[float]
    dial: list[float]
    charts: list[float]

    def __str__(self) -> str:
        parts = {"number": self.number, "dial": self.dial, "charts": self.charts}
        return ", ".join(
            f"{name} {1000 * np.median(some):.0f} ms (p95 {1000 * p95_s(some):.0f}, n {len(some)})"
            for name, some in parts.items()
        )


def p95_s(delays_s: Sequence[float]) -> float:
    """Return the 95th percentile."""
    return float(np.percentile(delays_s, 95))


def _page(browsing: Browsing, service: ServiceProcess) -> Page:
    page = browsing.context(viewport={"width": 1440, "height": 900}).new_page()
    page.add_init_script(_NOTE_CHANGES)
    show(page, service.address)
    expect(find_button(page)).to_be_enabled()
    return page


def _delays(page: Page, service: ServiceProcess, run_id: str) -> Delays:
    """Compare what the page has shown of a run, and when, with the record."""
    wait_for_run(page, run_id, "completed")
    count = len(service.run(run_id)["result"]["visits"])
    expect(page.locator("#fit [data-visits]")).to_have_attribute("data-visits", str(count))
    seen: list[Seen] = page.evaluate("seen")
    events = recorded(service, run_id)
    estimates = [event for event in events if event.event == "estimate"]
    numbers = [
        rounded(event.data["azimuth_deg"], event.data["azimuth_sigma_deg"]) for event in estimates
    ]
    values = [value for value, _ in numbers]
    visits = [_time_s(event) for event in events if event.event == "visit"]
    times = [_time_s(event) for event in estimates]
    last = max(now["settle"] for now in seen)  # it leaves with the run's end, before the last
    assert last > count / 2
    return Delays(
        number=_until_shown(seen, times, numbers, lambda now: tuple(now["number"])),
        dial=_until_shown(seen, times, values, _value_on_dial),
        charts=_until_drawn(seen, visits, "fit") + _until_drawn(seen, visits[:last], "settle"),
    )


def _time_s(event: Event) -> float:
    return datetime.fromisoformat(event.data["time"]).timestamp()


def _value_on_dial(now: Seen) -> str:
    return "".join(re.findall(r"North at ([\d.]+)°", now["dial"]))


def _until_shown(
    seen: list[Seen], times_s: list[float], texts: Sequence[_T], read: Callable[[Seen], _T]
) -> list[float]:
    """Return how long each text, or one that came after it, took to be read off the page.

    A text that is the same as the one before brings no change that could be timed.
    """
    delays_s = []
    for k in range(1, len(texts)):
        if texts[k] != texts[k - 1]:
            later = set(texts[k:])
            shown_s = (now["time_s"] for now in seen if read(now) in later)
            delays_s.append(_first_after(times_s[k], shown_s))
    return delays_s


def _until_drawn(seen: list[Seen], times_s: list[float], chart: str) -> list[float]:
    """Return how long each visit took to be in a chart."""
    return [
        _first_after(time_s, (now["time_s"] for now in seen if now[chart] >= count))
        for count, time_s in enumerate(times_s, 1)
    ]


def _first_after(since_s: float, times_s: Iterable[float]) -> float:
    """Return how long after an instant the first of these is."""
    return next(time_s for time_s in times_s if time_s >= since_s) - since_s


@pytest.mark.alone
def test_a_click_shows_north_within_ten_seconds_and_every_step_at_once(
    browsing: Browsing, tmp_path: Path, record_property: Record
) -> None:
    with serving(tmp_path, "--sim-speed", "20") as service:  # as `make serve` does
        wait_until_ready(service)
        page = _page(browsing, service)
        with page.expect_response(is_start) as begun:
            find_button(page).click()
        clicked_s = time.monotonic()
        run_id = begun.value.json()["run_id"]
        wait_for_run(page, run_id, "completed")
        north_s = time.monotonic() - clicked_s
        delays = _delays(page, service, run_id)
        browsing.close()
    record_property("measured", f"north {north_s:.1f} s after the click; {delays}")
    assert north_s < 10.0 * _ALLOWANCE
    assert p95_s(delays.number) < _NUMBER_S * _ALLOWANCE
    assert p95_s(delays.dial) < _NUMBER_S * _ALLOWANCE
    assert p95_s(delays.charts) < _CHARTS_S * _ALLOWANCE


@pytest.mark.alone
@pytest.mark.proof
@pytest.mark.timeout(400)
@pytest.mark.parametrize(("speed", "plan"), [("1", (12, 1)), ("2", (24, 2)), ("5", (24, 5))])
def test_every_step_of_a_run_at_real_pace_is_shown_at_once(
    browsing: Browsing,
    tmp_path: Path,
    record_property: Record,
    speed: str,
    plan: tuple[int, float],
) -> None:
    positions, dwell_s = plan
    with serving(tmp_path, "--sim-speed", speed) as service:
        wait_until_ready(service)
        page = _page(browsing, service)
        body = {"kind": "north-seek", "positions": positions, "dwell_s": dwell_s}
        run_id = service.start(body)
        service.wait_for_visits(run_id, 2 * positions)
        delays = _delays(page, service, run_id)
        browsing.close()
    record_property("measured", f"at {speed} times real time: {delays}")
    assert p95_s(delays.number) < _NUMBER_S
    assert p95_s(delays.dial) < _NUMBER_S
    assert p95_s(delays.charts) < _CHARTS_S
