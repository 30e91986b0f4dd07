"""From what happened at the rig to what a reader sees of it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from tests.page.browsing import Browsing, choose_plan, find_button, rounded, wait_for_phase
from tests.page.following import events_of_kind
from tests.service.process import ServiceProcess, serving, wait_until_ready

_NUMBER_S = 0.150
_CHARTS_S = 0.700
#: A machine that does other things besides may take so much longer in a short form.
_ALLOWANCE = 3.0

# Every change of the number, the dial and the charts, at the end of the frame that brought it.
_NOTE_CHANGES = """
window.seen = [];
addEventListener("DOMContentLoaded", () => {
  const text = (selector) => document.querySelector(selector).textContent;
  const plots = () => [...document.querySelectorAll("#fit [data-visits], #settle [data-visits]")];
  const note = () => seen.push({
    time_s: (performance.timeOrigin + performance.now()) / 1000,
    north: [text("#azimuth-value > span"), text("#azimuth-u")],
    dial: document.querySelector("#face").getAttribute("aria-label"),
    charts: plots().map((plot) => Number(plot.dataset.visits)),
  });
  new MutationObserver(() => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = note;
    port2.postMessage(null);
  }).observe(document.body, {
    subtree: true, childList: true, characterData: true, attributeFilter: ["aria-label", "data-visits"],
  });
});
"""


@dataclass(frozen=True, slots=True)
class Delays:
    """How late each event of a run was shown, in seconds."""

    number: Sequence[float]
    dial: Sequence[float]
    charts: Sequence[float]

    def p95_s(self) -> tuple[float, float, float]:
        """Return the 95th percentiles."""
        number, dial, charts = (
            float(np.percentile(some, 95)) for some in (self.number, self.dial, self.charts)
        )
        return number, dial, charts
