"""What the page shows of a run, beside what the service has on record."""

from contextlib import closing
from itertools import islice

from playwright.sync_api import Page, expect

from tests.service.process import Event, ServiceProcess

#: Kinds of event that the page lists; progress and estimates it draws instead.
_LISTED = {"state", "visit", "warning", "error", "result"}
_SHOWN = 40  # the newest; older ones have left the list


def recorded(service: ServiceProcess, run_id: str) -> list[Event]:
    """Return a run's events so far."""
    last_seq = service.run(run_id)["last_seq"]
    with closing(service.events(run_id)) as events:
        return list(islice(events, last_seq))


def expect_every_event(page: Page, service: ServiceProcess, run_id: str) -> None:
    """Wait until the page lists each event of a standing run once, in order, and draws it."""
    events = recorded(service, run_id)
    times = [event.data["time"] for event in events if event.event in _LISTED][::-1][:_SHOWN]
    shown = page.locator("#event-list time")
    expect(shown).to_have_count(len(times))
    assert shown.evaluate_all("all => all.map((one) => one.dateTime)") == times
    visits = [event for event in events if event.event == "visit"]
    plot = page.locator("#fit [data-visits]")
    expect(plot).to_have_attribute("data-visits", str(len(visits)))
