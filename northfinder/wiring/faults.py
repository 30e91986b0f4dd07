"""What can be made to go wrong with simulated devices while they run, in degrees and by role."""

import asyncio
from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from northfinder.config import AngleDeg
from northfinder.errors import ConfigError
from northfinder.rig import JsonObject
from northfinder.units import DEG, DEG_PER_HOUR_PER_HOUR, HOUR
from northfinder.validation import validated
from sim.faults import WireFaults
from sim.sensor_faults import SensorFaults
from sim.world import World

Probability = Annotated[float, Field(ge=0.0, le=1.0)]
_TABLE = "turntable"
_WIRE = tuple(field.name for field in fields(WireFaults))
#: Of a sensor, by what is set: the name where it acts, and its unit there.
_SENSOR = {
    "frozen": ("frozen", None),
    "spikes_per_s": ("spikes_per_s", 1.0),
    "spike_deg_s": ("spike_rad_s", DEG),
    "limit_deg_s": ("limit_rad_s", DEG),
    "drift_deg_h2": ("drift_rad_s2", DEG_PER_HOUR_PER_HOUR),
    "curvature_deg_h3": ("curvature_rad_s3", DEG_PER_HOUR_PER_HOUR / HOUR),
}


class WireFaultSettings(BaseModel):
    """What goes wrong on a device's wire; bytes are hit on their way from the device.

    Unplugged is the computer's end: a port that is gone; on CAN the adapter, with all devices.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    drop_per_byte: Probability = 0.0
    corrupt_per_byte: Probability = 0.0
    duplicate_per_byte: Probability = 0.0
    repeat_per_burst: Probability = 0.0
    delay_s: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    silent: bool = False
    unplugged: bool = False


class SensorFaultSettings(WireFaultSettings):
    """The same, and what goes wrong inside a sensor.

    Frozen repeats the last reading on every axis; a spike is one sample that is so far off; a rate
    is cut off at the limit; a drift, and one that curves, begin when they are set.
    """

    frozen: bool = False
    spikes_per_s: Annotated[float, Field(ge=0.0, le=1e4)] = 0.0
    spike_deg_s: Annotated[float, Field(ge=-1e4, le=1e4)] = 0.0
    limit_deg_s: Annotated[float, Field(ge=0.0, le=1e4)] | None = None
    drift_deg_h2: Annotated[float, Field(ge=-1e7, le=1e7)] = 0.0
    curvature_deg_h3: Annotated[float, Field(ge=-1e9, le=1e9)] = 0.0


class TableFaultSettings(WireFaultSettings):
    """The same, and what hinders the table: an obstacle, and moves that end elsewhere.

    The obstacle meets the index mark at its angle counter-clockwise seen from above; a negative
    shortness is a table that turns too far. A plate that slipped stands so far from where its
    motor's encoder sees it, counter-clockwise; one that slips stays behind that much each move.
    """

    blocked_at_deg: AngleDeg | None = None
    short_by_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 0.0
    slipped_deg: Annotated[float, Field(ge=-1e6, le=1e6)] = 0.0
    slip_per_move_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 0.0


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
        on_the_wire = {
            "unplugged": self._world.is_unplugged(device),
            **{name: getattr(wire, name) for name in _WIRE},
        }
        if device == _TABLE:
            return TableFaultSettings(**on_the_wire, **self._of_the_table())
        return SensorFaultSettings(
            **on_the_wire, **_of_a_sensor(self._world.sensors[device].faults)
        )

    def _of_the_table(self) -> JsonObject:
        plate = self._world.plate
        blocked_rad = plate.blocked_rad
        return {
            "blocked_at_deg": None if blocked_rad is None else _deg(self._direction * blocked_rad),
            "short_by_deg": _deg(plate.short_rad),
            "slipped_deg": _deg(self._direction * plate.slipped_rad),
            "slip_per_move_deg": _deg(plate.slip_per_move_rad),
        }

    def _apply(self, device: str, settings: WireFaultSettings) -> None:
        wire = self._world.faults(device)
        for name in _WIRE:
            setattr(wire, name, getattr(settings, name))
        if settings.unplugged != self._world.is_unplugged(device):
            act = self._world.unplug if settings.unplugged else self._world.plug_in
            act(device)
        if isinstance(settings, TableFaultSettings):
            self._hinder_the_table(settings)
        elif isinstance(settings, SensorFaultSettings):
            _spoil(self._world.sensors[device].faults, settings)

    def _hinder_the_table(self, settings: TableFaultSettings) -> None:
        blocked_deg, plate = settings.blocked_at_deg, self._world.plate
        blocked_rad = None if blocked_deg is None else self._direction * blocked_deg * DEG
        if blocked_rad != plate.blocked_rad:  # another fault must not touch a move under way
            plate.block_at(blocked_rad)
        plate.fall_short_by(settings.short_by_deg * DEG)
        plate.slip_every_move_by(settings.slip_per_move_deg * DEG)
        further_deg = settings.slipped_deg - _deg(self._direction * plate.slipped_rad)
        if further_deg:
            now_s = asyncio.get_running_loop().time()
            plate.slip_by(self._direction * further_deg * DEG, now_s)


def _of_a_sensor(faults: SensorFaults) -> JsonObject:
    return {
        name: value if unit is None or value is None else _rounded(value / unit)
        for name, (there, unit) in _SENSOR.items()
        for value in [getattr(faults, there)]
    }


def _spoil(faults: SensorFaults, settings: SensorFaultSettings) -> None:
    for name, (there, unit) in _SENSOR.items():
        value = getattr(settings, name)
        setattr(faults, there, value if unit is None or value is None else value * unit)


def _deg(angle_rad: float) -> float:
    return _rounded(angle_rad / DEG)


def _rounded(value: float) -> float:
    """Return a value as it was given: the way there and back leaves some 1e-14 of it."""
    return round(value, 9)
