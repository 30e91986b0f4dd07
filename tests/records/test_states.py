"""Every step from every state, against the life of a run written out by hand."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from northfinder.records import Records, RecordsError, State
from northfinder.records.states import STATES
from tests.records.examples import RUN

WAY_TO: dict[State, tuple[State, ...]] = {
    "queued": (),
    "running": ("running",),
    "paused": ("running", "paused"),
    "completed": ("running", "completed"),
    "failed": ("running", "failed"),
    "aborted": ("running", "aborted"),
    "interrupted": ("running", "interrupted"),
}
# "resume is legal from paused, failed, interrupted"; "abort ends a failed or interrupted run
# for good"; what is completed or aborted never changes.
LEGAL = {
    ("queued", "running"),
    ("queued", "failed"),
    ("queued", "aborted"),
    ("queued", "interrupted"),
    ("running", "paused"),
    ("running", "completed"),
    ("running", "failed"),
    ("running", "aborted"),
    ("running", "interrupted"),
    ("paused", "running"),
    ("paused", "failed"),
    ("paused", "aborted"),
    ("paused", "interrupted"),
    ("failed", "running"),
    ("failed", "aborted"),
    ("interrupted", "running"),
    ("interrupted", "aborted"),
}


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Records]:
    folder: Path = tmp_path_factory.mktemp("states")
    with Records.open(f"sqlite:///{folder / 'records.db'}") as records:
        yield records


def step(records: Records, run_id: str, state: State) -> None:
    match state:
        case "completed":
            records.finish(run_id, {})
        case "failed":
            records.fail(run_id, "the table stalled")
        case "queued":
            pytest.fail("no call leads back to the queue")
        case _:
            records.set_state(run_id, state)


@pytest.mark.parametrize("new", [state for state in STATES if state != "queued"])
@pytest.mark.parametrize("old", STATES)
def test_only_legal_steps_are_taken(shared: Records, old: State, new: State) -> None:
    run_id = shared.create_run(RUN)
    for state in WAY_TO[old]:
        step(shared, run_id, state)
    before = shared.run(run_id)
    if (old, new) in LEGAL:
        step(shared, run_id, new)
        assert shared.run(run_id).state == new
    else:
        with pytest.raises(RecordsError, match=f"{run_id} is {old} and cannot become {new}: "):
            step(shared, run_id, new)
        assert shared.run(run_id) == before


def test_an_illegal_step_is_answered_with_the_legal_ones(shared: Records) -> None:
    run_id = shared.create_run(RUN)
    with pytest.raises(RecordsError, match=r"only running, failed, aborted, interrupted$"):
        shared.set_state(run_id, "paused")
    shared.set_state(run_id, "aborted")
    with pytest.raises(RecordsError, match=r"nothing else, it is over$"):
        shared.set_state(run_id, "running")
