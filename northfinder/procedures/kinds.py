"""Every procedure by its kind."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from pydantic import BaseModel

from northfinder.procedures import alignment, heading_hold, noise, north_seek
from northfinder.procedures.procedure import Procedure

PROCEDURES: Final[Mapping[str, Procedure]] = MappingProxyType(
    {
        "north-seek": north_seek,
        "alignment": alignment,
        "noise": noise,
        "heading-hold": heading_hold,
    }
)


def procedure_of(plan: BaseModel) -> Procedure:
    """Return the procedure that carries a plan out."""
    return PROCEDURES[plan.model_dump(include={"kind"})["kind"]]
