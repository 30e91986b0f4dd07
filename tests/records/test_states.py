"""Every step from every state, against the life of a run written out by hand."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from northfinder.records import IllegalStepError, Records, State
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
    """The table of steps is the same code over any database."""
    folder: Path = tmp_path_factory.mktemp("states")
    with Records.open(f"sqlite:///{folder / 'records.db'}") as records:
        yield records


def step(records: Records, run_id: str, state: State) -> None:
    match state:
        case "completed":
            records.finish(run_id, {}, None)
        case "failed":
            records.fail(run_id, "the table stalled")
        case "queued":
            pytest.fail("no call leads back to the queue")
        case "running" if records.run(run_id).state in {"failed", "interrupted"}:
            records.resume(run_id)
        case _:
            records.set_state(run_id, state)


@pytest.mark.parametrize("new", [state for state in STATES if state != "queued"])
@pytest.mark.parametrize("old", STATES)
def test_only_legal_steps_are_taken(shared: Records, old: State, new: State) -> None:
    run_id = shared.create_run(RUN).id
    for state in WAY_TO[old]:
        step(shared, run_id, state)
    before = shared.run(run_id)
    if (old, new) in LEGAL:
        step(shared, run_id, new)
        assert shared.run(run_id).state == new
    else:
        with pytest.raises(IllegalStepError, match=f"{run_id} is {old} and cannot become {new}: "):
            step(shared, run_id, new)
        assert shared.run(run_id) == before


def test_an_illegal_step_is_answered_with_the_legal_ones(shared: Records) -> None:
    run_id = shared.create_run(RUN).id
    with pytest.raises(IllegalStepError, match=r"only running, failed, aborted,") as caught:
        shared.set_state(run_id, "paused")
    assert (caught.value.run_id, caught.value.state) == (run_id, "queued")
    assert caught.value.legal == ("running", "failed", "aborted", "interrupted")
    shared.set_state(run_id, "aborted")
    with pytest.raises(IllegalStepError, match=r"nothing else, it is over$"):
        shared.set_state(run_id, "running")


@pytest.mark.parametrize("state", ["queued", "running", "paused", "completed", "aborted"])
def test_only_what_failed_or_was_interrupted_is_resumed(shared: Records, state: State) -> None:
    run_id = shared.create_run(RUN).id
    for way in WAY_TO[state]:
        step(shared, run_id, way)
    with pytest.raises(IllegalStepError, match="resumed: only while failed or interrupted"):
        shared.resume(run_id)


@pytest.mark.parametrize("state", ["failed", "interrupted"])
def test_to_run_again_takes_a_lease(shared: Records, state: State) -> None:
    run_id = shared.create_run(RUN).id
    for way in WAY_TO[state]:
        step(shared, run_id, way)
    with pytest.raises(IllegalStepError, match="resume it, or abort it for good"):
        shared.set_state(run_id, "running")
