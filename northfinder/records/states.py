"""The one life of every run: its states, and the legal steps between them as a table."""

from typing import Literal, get_args

from northfinder.records.errors import IllegalStepError

State = Literal["queued", "running", "paused", "completed", "failed", "aborted", "interrupted"]
STATES: tuple[State, ...] = get_args(State)

#: States that a call of their own name enters; the others come with a result, a reason, a lease.
SettableState = Literal["running", "paused", "aborted", "interrupted"]

#: From each state, where a run may go. A failed or interrupted run may be resumed, or aborted
#: for good; a completed or aborted one never changes again.
LEGAL_STEPS: dict[State, tuple[State, ...]] = {
    "queued": ("running", "failed", "aborted", "interrupted"),
    "running": ("paused", "completed", "failed", "aborted", "interrupted"),
    "paused": ("running", "failed", "aborted", "interrupted"),
    "completed": (),
    "failed": ("running", "aborted"),
    "aborted": (),
    "interrupted": ("running", "aborted"),
}

#: States in which nothing happens any more unless somebody resumes the run.
ENDED: frozenset[State] = frozenset({"completed", "failed", "aborted", "interrupted"})

#: States in which somebody carries the run out.
LIVE: tuple[State, ...] = ("queued", "running", "paused")

#: Ended, but not for good.
RESUMABLE: tuple[State, ...] = ("failed", "interrupted")


def require_legal_step(run_id: str, old: State, new: State) -> None:
    """Refuse a step that the table does not have.

    Raises:
        IllegalStepError: The message names the legal ones.
    """
    legal = LEGAL_STEPS[old]
    if new not in legal:
        ways = f"only {', '.join(legal)}" if legal else "nothing else, it is over"
        msg = f"run {run_id} is {old} and cannot become {new}: {ways}"
        raise IllegalStepError(msg, run_id, old, legal)
