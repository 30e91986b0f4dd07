"""The page as a reader has it: opened in a fresh context, watched for complaints."""

import re
from dataclasses import dataclass, field
from types import TracebackType
from typing import Literal, Self, TypedDict, Unpack
from urllib.parse import urlsplit

from playwright.sync_api import (
    Browser,
    BrowserContext,
    Locator,
    Page,
    Response,
    ViewportSize,
    expect,
)

#: A loaded machine's, not the page's: what is measured is asserted where it is measured.
PATIENCE_MS = 30_000
expect.set_options(timeout=PATIENCE_MS)


class Reader(TypedDict, total=False):
    """What a reader's browser is like; the rest is Playwright's usual."""

    viewport: ViewportSize
    device_scale_factor: float
    locale: str
    reduced_motion: Literal["reduce"]
    bypass_csp: bool


@dataclass
class Browsing:
    """Contexts of one browser, and everything that their pages asked for or complained of."""

    browser: Browser
    requests: list[str] = field(default_factory=list)
    _complaints: list[str] = field(default_factory=list)
    _expected: list[str] = field(default_factory=list)
    _contexts: list[BrowserContext] = field(default_factory=list)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def context(self, **reader: Unpack[Reader]) -> BrowserContext:
        """Open a context with a cold cache."""
        reader.setdefault("locale", "en-GB")
        context = self.browser.new_context(**reader)
        context.set_default_timeout(PATIENCE_MS)
        context.on("request", lambda request: self.requests.append(request.url))
        context.on(
            "weberror",
            lambda error: self._complaints.append(f"{error.error.message}\n{error.error.stack}"),
        )
        context.on(
            "console",
            lambda message: (
                self._complaints.append(f"{message.text} ({message.location['url']})")
                if message.type in {"error", "warning"}
                else None
            ),
        )
        self._contexts.append(context)
        return context

    def close(self) -> None:
        """Close every page: before the end of a service, which they would miss."""
        for context in self._contexts:
            context.close()

    def page(self, address: str, **reader: Unpack[Reader]) -> Page:
        """Open the page in a context of its own and wait until it knows the rig."""
        page = self.context(**reader).new_page()
        show(page, address)
        return page

    def expect_complaint(self, pattern: str) -> None:
        """Let the browser's console say this: Chromium reports every refused request there."""
        self._expected.append(pattern)

    def complaints(self) -> list[str]:
        """Return what went wrong in the pages and was not expected."""
        return [
            said
            for said in self._complaints
            if not any(re.search(pattern, said) for pattern in self._expected)
        ]

    def outside(self) -> list[str]:
        """Return every request that was not for this computer."""
        inner = {"127.0.0.1", None}  # None: a data: or blob: URL, made by the page itself
        return [url for url in self.requests if urlsplit(url).hostname not in inner]


def show(page: Page, address: str) -> None:
    """Open the page and wait until it knows the rig."""
    page.goto(address)
    page.wait_for_selector("body:not([data-phase=connecting])", timeout=PATIENCE_MS)


def find_button(page: Page) -> Locator:
    """Return the button that begins a run, wherever the page has it now."""
    return page.get_by_role("button", name="Find north", exact=True)


def is_start(answer: Response) -> bool:
    """Say whether this is the answer to a new run's request, for Page.expect_response."""
    return answer.request.method == "POST" and answer.url.endswith("/api/v1/runs")


def wait_for_phase(page: Page, phase: str) -> None:
    """Wait until the page says that the run shown is in this phase."""
    page.wait_for_selector(f"body[data-phase={phase}]", timeout=PATIENCE_MS)


def wait_for_run(page: Page, run_id: str, phase: str) -> None:
    """Wait until the page shows this run, and that it is in this phase."""
    shown = f"body[data-phase={phase}]:has([data-get][href*='{run_id}'])"
    page.wait_for_selector(shown, timeout=PATIENCE_MS)


def choose_plan(page: Page, positions: int, dwell_s: float) -> None:
    """Write a plan into the form, and wait until its prediction stands beside it."""
    if not page.locator("#positions").is_visible():
        page.locator("#change").click()
    with page.expect_response("**/api/v1/plans"):
        page.locator("#positions").fill(str(positions))
        page.locator("#dwell_s").fill(f"{dwell_s:g}")
    expect(page.locator("#new-summary")).to_contain_text(f"{positions} ")


def choose_kind(page: Page, kind: str) -> None:
    """Choose the kind of the next run, and wait until its prediction has come."""
    if not page.locator("#kinds").is_visible():
        page.locator("#change").click()
    with page.expect_response("**/api/v1/plans"):
        page.locator(f"#kinds input[value={kind}]").check()


def rounded(azimuth_deg: float, azimuth_sigma_deg: float) -> tuple[str, str]:
    """Return an azimuth and its two sigma as GUM 7.2.6 wants them: two significant digits."""
    expanded_deg = 2 * azimuth_sigma_deg
    exponent = int(f"{expanded_deg:.1e}".partition("e")[2])
    places = max(0, 1 - exponent)
    return f"{azimuth_deg:.{places}f}", f"±{expanded_deg:.{places}f}°"


def north_shown(page: Page) -> tuple[str, str]:
    """Return the number that the page shows, and its uncertainty."""
    value = page.locator("#azimuth-value > span").inner_text()
    return value, page.locator("#azimuth-u").inner_text()
