"""What every procedure is: a module with the same parts, found by the kind of its plan."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from pydantic import BaseModel

from northfinder.config import RigConfig
from northfinder.procedures.events import Emit
from northfinder.procedures.gate import Gate
from northfinder.procedures.visits import Visit
from northfinder.rig import JsonObject, Rig


class Predicted(Protocol):
    """A plan with nothing left open, and what it promises."""

    @property
    def plan(self) -> BaseModel:
        """Return the plan, everything chosen."""

    def to_json(self) -> JsonObject:
        """Return it as REST and the command line show it; ``duration_s`` and ``warnings`` at least.

        What predicts an azimuth adds ``azimuth_sigma_deg`` and ``budget``.
        """


class Procedure(Protocol):
    """One kind of run. The modules of this package that are one differ in Plan and result alone.

    Attributes:
        Plan: What to measure, checked; its ``kind`` is the run's.
        RESUMABLE: Whether a run can wait between two visits, and be carried on after it was
            stopped; a static record cannot: what it missed meanwhile is what it is about.
    """

    # Of each module's own Plan and result: nobody mixes them, `kinds` keeps them apart.
    Plan: Any
    RESUMABLE: bool

    def predict(self, plan: Any, rig: Rig) -> Predicted:  # noqa: ANN401
        """Work out what the plan takes and brings, on an open rig, moving nothing.

        Raises:
            ConfigError: The plan cannot be carried out on this rig.
        """

    async def run(  # noqa: PLR0913
        self,
        rig: Rig,
        plan: Any,  # noqa: ANN401
        emit: Emit,
        *,
        done: Sequence[Visit] = (),
        elapsed_s: float = 0.0,
        gate: Gate | None = None,
    ) -> Any:  # noqa: ANN401
        """Carry it out; the table stands still afterwards whatever happens."""

    def reduce_visits(self, visits: Sequence[Visit], plan: Any, config: RigConfig) -> Any:  # noqa: ANN401
        """Return the same result from the recorded visits alone."""

    def result_json(self, result: Any) -> JsonObject:  # noqa: ANN401
        """Return every number of the result; ``azimuth_deg`` and ``checks`` where there are any."""

    def headline(self, numbers: Mapping[str, Any]) -> JsonObject:
        """Return what a list of runs shows of a result's numbers, or of those so far."""
