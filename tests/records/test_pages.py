"""The list of runs: newest first, in pieces that neither repeat nor skip."""

from dataclasses import replace

import pytest
from sqlalchemy import event

from northfinder.records import Idempotency, IdempotencyKeyUsedError, Records, UnknownRunError
from tests.records.examples import RUN


def ids(records: Records, limit: int) -> list[list[str]]:
    """Every page, as ids."""
    pages, cursor = [], None
    while True:
        page = records.page(limit, cursor)
        pages.append([run.id for run in page.runs])
        cursor = page.next_cursor
        if cursor is None:
            return pages


def test_pages_hold_every_run_once_newest_first(records: Records) -> None:
    made = [records.create_run(RUN).id for _ in range(7)]
    newest = made[::-1]
    assert ids(records, 3) == [newest[:3], newest[3:6], newest[6:]]
    assert ids(records, 7) == [newest]
    assert ids(records, 8) == [newest]


def test_there_is_a_page_without_runs(records: Records) -> None:
    assert ids(records, 50) == [[]]


def test_runs_that_begin_meanwhile_shift_nothing(records: Records) -> None:
    made = [records.create_run(RUN).id for _ in range(4)]
    first = records.page(2)
    records.create_run(RUN)
    second = records.page(2, first.next_cursor)
    assert [run.id for run in (*first.runs, *second.runs)] == made[::-1]


def test_pages_show_one_kind_state_or_rig(records: Records) -> None:
    seek, noise, elsewhere = (
        records.create_run(new).id
        for new in (RUN, replace(RUN, kind="noise"), replace(RUN, rig_name="Lab 4"))
    )
    records.set_state(noise, "aborted")
    assert [run.id for run in records.page(9, kind="noise").runs] == [noise]
    assert [run.id for run in records.page(9, state="queued").runs] == [elsewhere, seek]
    assert [run.id for run in records.page(9, rig_name="Lab 3").runs] == [noise, seek]
    assert records.page(9, rig_name="Lab 4", kind="noise").runs == []


def test_a_cursor_of_nobody_is_refused(records: Records) -> None:
    with pytest.raises(UnknownRunError, match="take the cursor from the page before"):
        records.page(2, "20261122T034512Z-7f3a9c")


def test_a_list_does_not_load_what_is_large(records: Records) -> None:
    """Ten thousand results of 20 kB shall not pass through memory to show fifty lines."""
    statements: list[str] = []
    event.listen(records._engine, "before_cursor_execute", lambda *args: statements.append(args[2]))
    records.create_run(RUN)
    statements.clear()
    records.page(50)
    asked = " ".join(statements)
    assert "runs.headline" in asked
    for column in ("result", "site", "runs.rig,", "software", "simulation", "prediction"):
        assert column not in asked


def test_the_same_request_finds_its_run(records: Records) -> None:
    asked = replace(RUN, idempotency=Idempotency("7d3e", "5" * 64))
    run = records.create_run(asked)
    assert records.same_request("7d3e") == run
    assert run.idempotency == Idempotency("7d3e", "5" * 64)
    assert records.same_request("other") is None


def test_an_idempotency_key_begins_one_run(records: Records) -> None:
    asked = replace(RUN, idempotency=Idempotency("7d3e", "5" * 64))
    records.create_run(asked)
    with pytest.raises(IdempotencyKeyUsedError, match="had the idempotency key '7d3e'"):
        records.create_run(asked)
    assert len(records.page(9).runs) == 1
    records.create_run(RUN)
    records.create_run(RUN)  # without a key there is nothing to be the same
