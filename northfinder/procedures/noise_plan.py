"""What a static record is asked to be."""

from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

_STRETCHES: Final = 60  # durable one by one: a crash costs a minute of an hour
_SHORTEST_STRETCH_S: Final = 5.0


class Wish(BaseModel):
    """How long to record; the table stands where it is."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: Literal["noise"] = "noise"
    duration_s: Annotated[float, Field(ge=20.0, le=86400.0)] = 1800.0
    settle_s: Annotated[float, Field(ge=0.0, le=600.0)] = 0.5

    @property
    def stretches(self) -> int:
        """Return in how many pieces the record is kept."""
        return max(1, min(_STRETCHES, int(self.duration_s / _SHORTEST_STRETCH_S)))


class Plan(Wish):
    """The same with what is filled in from the rig.

    ``pause_s`` is how long the table takes between two visits of a north-seek: the dwell that is
    suggested depends on it.
    """

    pause_s: Annotated[float, Field(gt=0.0, le=3600.0)] | None = None
