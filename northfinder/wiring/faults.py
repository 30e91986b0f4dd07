"""What can be made to go wrong with simulated devices while they run, in degrees and by role."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from northfinder.config import AngleDeg
from northfinder.errors import ConfigError
from northfinder.rig import JsonObject
from northfinder.units import DEG
from northfinder.validation import validated
from sim.world import World

Probability = Annotated[float, Field(ge=0.0, le=1.0)]
_TABLE = "turntable"


class WireFaultSettings(BaseModel):
    """What goes wrong on a device's wire; bytes are hit on their way from the device."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    drop_per_byte: Probability = 0.0
    corrupt_per_byte: Probability = 0.0
    delay_s: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    silent: bool = False


class TableFaultSettings(WireFaultSettings):
    """The same, and what stops the table: an obstacle, and moves that end short of their target.

    The obstacle meets the index mark at its angle counter-clockwise seen from above; a negative
    shortness is a table that turns too far.
    """

    blocked_at_deg: AngleDeg | None = None
    short_by_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 0.0


class WorldFaults:
    """The faults of a world's devices, read from where they act.

    Args:
        world: The world.
        clockwise: Whether the table's own angles count clockwise.
    """

    def __init__(self, world: World, *, clockwise: bool) -> None:
        self._world = world
        self._direction = -1.0 if clockwise else 1.0

    def to_json(self) -> dict[str, JsonObject]:
        """Return the faults of each device, the turntable's angles in degrees."""
        return {
            device: self._present(device).model_dump(mode="json") for device in self._world.roles
        }

    def set(self, device: str, given: Mapping[str, Any]) -> None:
        """Set some faults of a device.

        Raises:
            ConfigError: No such device or fault, or out of its limits; nothing has changed then.
        """
        if device not in self._world.roles:
            simulated = ", ".join(self._world.roles)
            msg = f"faults: device = {device!r}: simulated are {simulated}"
            raise ConfigError(msg)
        present = self._present(device)
        wanted = {**present.model_dump(), **given}
        self._apply(device, validated(type(present), wanted, f"faults of the {device}"))

    def clear(self, device: str) -> None:
        """Mend a device."""
        self._apply(device, type(self._present(device))())

    def _present(self, device: str) -> WireFaultSettings:
        wire = self._world.faults(device)
        on_the_wire = {name: getattr(wire, name) for name in WireFaultSettings.model_fields}
        if device != _TABLE:
            return WireFaultSettings(**on_the_wire)
        plate = self._world.plate
        blocked_rad = plate.blocked_rad
        return TableFaultSettings(
            **on_the_wire,
            blocked_at_deg=None if blocked_rad is None else _deg(self._direction * blocked_rad),
            short_by_deg=_deg(plate.short_rad),
        )

    def _apply(self, device: str, settings: WireFaultSettings) -> None:
        wire = self._world.faults(device)
        for name in WireFaultSettings.model_fields:
            setattr(wire, name, getattr(settings, name))
        if isinstance(settings, TableFaultSettings):
            blocked_deg, plate = settings.blocked_at_deg, self._world.plate
            blocked_rad = None if blocked_deg is None else self._direction * blocked_deg * DEG
            if blocked_rad != plate.blocked_rad:  # another fault must not touch a move under way
                plate.block_at(blocked_rad)
            plate.fall_short_by(settings.short_by_deg * DEG)


def _deg(angle_rad: float) -> float:
    """Return degrees as they were given: the way there and back leaves some 1e-14 of it."""
    return round(angle_rad / DEG, 9)
