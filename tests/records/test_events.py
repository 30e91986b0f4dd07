"""What happens in a run is told once, in order, together with what it changed."""

import threading

import pytest

from northfinder.records import IllegalStepError, Records, UnknownRunError
from tests.records.examples import RUN, samples, visit

ESTIMATE = {"azimuth_deg": 48.1, "azimuth_sigma_deg": 0.2}


def told(records: Records, run_id: str) -> list[tuple[int, str]]:
    return [(event.seq, event.event) for event in records.events(run_id)]


def test_a_run_tells_its_whole_life_in_order(records: Records) -> None:
    run_id = records.create_run(RUN).id
    returned = [
        records.set_state(run_id, "running"),
        records.add_event(run_id, "progress", {"progress": 0.1}, progress=0.1),
        records.add_visit(run_id, visit(0), samples(0), {"index": 0, "angle_deg": 0.0}, 0.2),
        records.add_event(run_id, "estimate", ESTIMATE, headline=ESTIMATE),
        records.set_state(run_id, "paused"),
        records.set_state(run_id, "running"),
        *records.finish(run_id, {"azimuth_deg": 48.0, "visits": [{"index": 0}]}, None),
    ]
    assert records.events(run_id, after=1) == returned
    events = records.events(run_id)
    assert [event.seq for event in events] == [*range(1, 10)]
    assert [(event.event, event.data) for event in events] == [
        ("state", {"state": "queued"}),
        ("state", {"state": "running"}),
        ("progress", {"progress": 0.1}),
        ("visit", {"index": 0, "angle_deg": 0.0}),
        ("estimate", ESTIMATE),
        ("state", {"state": "paused"}),
        ("state", {"state": "running"}),
        ("result", {"azimuth_deg": 48.0}),
        ("state", {"state": "completed"}),
    ]
    assert [event.time_utc for event in events] == sorted(event.time_utc for event in events)


def test_a_failed_run_tells_why_and_its_next_life_counts_on(records: Records, running: str) -> None:
    error, state = records.fail(running, "the table stalled at 45 deg; clear it")
    assert (error.event, error.data) == (
        "error",
        {"message": "the table stalled at 45 deg; clear it"},
    )
    assert (state.seq, state.data) == (4, {"state": "failed"})
    assert records.resume(running).seq == 5


def test_a_state_may_say_more(records: Records, running: str) -> None:
    event = records.set_state(running, "interrupted", {"detail": "the service was shut down"})
    assert event.data == {"state": "interrupted", "detail": "the service was shut down"}


def test_a_list_shows_how_far_a_run_is_and_its_north_so_far(records: Records, running: str) -> None:
    records.add_event(running, "estimate", ESTIMATE, progress=0.4, headline=ESTIMATE)
    records.add_event(running, "warning", {"message": "a frame was lost"})
    (shown,) = records.page(1).runs
    assert (shown.progress, shown.headline, shown.last_seq) == (0.4, ESTIMATE, 4)


def test_events_are_read_from_anywhere_and_in_pieces(records: Records, running: str) -> None:
    for _ in range(5):
        records.add_event(running, "warning", {"message": "a frame was lost"})
    assert [event.seq for event in records.events(running, after=3)] == [4, 5, 6, 7]
    assert [event.seq for event in records.events(running, after=3, limit=2)] == [4, 5]
    assert records.events(running, after=7) == []
    assert records.events(running, after=10**30) == []  # whatever a client sends
    with pytest.raises(UnknownRunError):
        records.events("20261122T034512Z-7f3a9c")


def test_what_is_refused_tells_nothing(records: Records, running: str) -> None:
    records.add_visit(running, visit(0), samples(0), {}, 0.1)
    before = told(records, running)
    with pytest.raises(IllegalStepError):
        records.add_visit(running, visit(0), samples(0), {}, 0.1)
    with pytest.raises(ValueError, match=r"visit\.angle_deg is nan"):
        records.add_visit(running, visit(1), samples(1), {"angle_deg": float("nan")}, 0.1)
    assert told(records, running) == before
    assert records.run(running).last_seq == before[-1][0]
    assert records.visits(running) == [visit(0)]


def test_after_its_end_a_run_tells_nothing_more(records: Records, running: str) -> None:
    records.set_state(running, "aborted")
    with pytest.raises(IllegalStepError, match="is aborted and takes no events"):
        records.add_event(running, "progress", {"progress": 0.9})
    assert records.events(running)[-1].data == {"state": "aborted"}


def test_several_threads_leave_no_gap(records: Records, running: str) -> None:
    def tell() -> None:
        for _ in range(10):
            records.add_event(running, "warning", {"message": "a frame was lost"})

    threads = [threading.Thread(target=tell) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [seq for seq, _ in told(records, running)] == [*range(1, 43)]


def test_a_reason_that_a_database_cannot_hold_is_spelled_out(
    records: Records, running: str
) -> None:
    records.fail(running, "the device answered \0\ud800")
    assert records.run(running).error == r"the device answered \0\ud800"


@pytest.mark.parametrize("text", ["\0", "\ud800", "2026\0"])
def test_a_text_that_no_database_can_hold_is_nowhere_to_be_found(
    records: Records, running: str, text: str
) -> None:
    with pytest.raises(UnknownRunError, match=f"the newest is {running}"):
        records.run(text)
    with pytest.raises(UnknownRunError, match="there is no page after"):
        records.page(1, text)
    assert records.page(1, rig_name=text).runs == []
    assert records.same_request(text) is None
