"""One browser for all tests of the page, a fresh context for each, and a service for each file."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.page.browsing import Browsing
from tests.service.process import ServiceProcess, serving, wait_until_ready

pytest.register_assert_rewrite("tests.page.following")

_CHROMIUM = Path("/usr/bin/chromium")
_ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


# Not of the session: while it is open this thread has a running loop, and no other test can
# use asyncio.run.
@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    if not _CHROMIUM.exists():
        pytest.fail(f"{_CHROMIUM} is missing: sudo apt-get install chromium", pytrace=False)
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=_CHROMIUM, args=_ARGUMENTS) as chromium,
    ):
        yield chromium


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    with serving(tmp_path_factory.mktemp("page")) as running:
        wait_until_ready(running)
        yield running


@pytest.fixture
def browsing(browser: Browser) -> Iterator[Browsing]:
    with Browsing(browser) as contexts:
        yield contexts
    assert contexts.complaints() == []
    assert contexts.outside() == []


@pytest.fixture
def idle(service: ServiceProcess) -> None:
    """No test leaves a run or a fault behind for the next."""
    service.api.delete("/rig/simulation/faults")
    run_id = service.api.get("/rig").json()["run_id"]
    if run_id is not None:
        service.api.post("/rig/stop")
        service.wait(run_id)
    for run in service.api.get("/runs").json()["runs"]:
        if run["state"] in {"failed", "interrupted"}:
            service.api.post(f"/runs/{run['run_id']}/abort")
