"""What a procedure without a schedule of visits promises before it begins."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel

from northfinder.rig import JsonObject


@dataclass(frozen=True, slots=True)
class Promise:
    """A plan with nothing left open, and what it takes and brings.

    Attributes:
        plan: The plan.
        duration_s: Of the whole run.
        warnings: Sentences for whoever is about to start it.
        numbers: What else is promised, as JSON: ``azimuth_sigma_deg`` and ``budget``, say.
    """

    plan: BaseModel
    duration_s: float
    warnings: Sequence[str] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> JsonObject:
        """Return it as REST and the command line show it."""
        return {
            "duration_s": self.duration_s,
            "warnings": list(self.warnings),
            "plan": self.plan.model_dump(mode="json"),
            **self.numbers,
        }
