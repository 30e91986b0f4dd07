"""What the page shows of a run, beside what the service has on record."""

from playwright.sync_api import Page, expect

from tests.service.process import Event, ServiceProcess

#: Kinds of event that the page lists; progress and estimates it draws instead.
_LISTED = ("state", "visit", "warning", "error", "result")
_SHOWN = 40  # the newest; older ones have left the list


def listed(service: ServiceProcess, run_id: str) -> list[str]:
    """Return the times of a finished run's events as the page lists them, newest first."""
    events = [event.data["time"] for event in service.events(run_id, *_LISTED)]
    return events[::-1][:_SHOWN]


def count_of(service: ServiceProcess, run_id: str, kind: str) -> int:
    """Return how many events of a kind a finished run has."""
    return len(events_of_kind(service, run_id, kind))


def events_of_kind(service: ServiceProcess, run_id: str, kind: str) -> list[Event]:
    """Return a finished run's events of a kind."""
    return list(service.events(run_id, kind))


def expect_every_event(page: Page, service: ServiceProcess, run_id: str) -> None:
    """Wait until the page lists each event of a finished run once, in order, and draws it."""
    times = listed(service, run_id)
    expect(page.locator("#event-list time")).to_have_count(len(times))
    shown = page.locator("#event-list time").evaluate_all("all => all.map((one) => one.dateTime)")
    assert shown == times
    visits = str(count_of(service, run_id, "visit"))
    expect(page.locator("#fit [data-visits]")).to_have_attribute("data-visits", visits)
