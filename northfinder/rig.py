"""A rig: a turntable and the two sensing axes on it. Procedures see nothing else of the bench."""

from collections.abc import Mapping
from contextlib import AsyncExitStack
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, Protocol, Self

import numpy as np

from drivers.interfaces import (
    BoolArray,
    FloatArray,
    InertialSensor,
    Instrument,
    MotionLimits,
    SampleBlock,
    TableState,
    Turntable,
)
from northfinder.config import RigConfig

JsonObject = dict[str, Any]


class Simulation(Protocol):
    """What only a simulated rig has: a world that must be started, its truth and its faults.

    Truth and faults may be changed while it runs, on the rig's loop. Keys are those of the
    configuration's ``[simulation]`` and of the service, angles in degrees.
    """

    async def start(self) -> None:
        """Power the simulated devices up."""

    async def stop(self) -> None:
        """Power them down."""

    def truth(self) -> JsonObject:
        """Return the world's settings as they are now, for the record; all but the speed."""

    def change(self, settings: Mapping[str, Any]) -> JsonObject:
        """Change some settings at once, and return all of them.

        Raises:
            ConfigError: An unknown or fixed one, or out of its limits; nothing has changed then.
        """

    def faults(self) -> dict[str, JsonObject]:
        """Return the faults of each simulated device by its role."""

    def set_faults(self, device: str, given: Mapping[str, Any]) -> dict[str, JsonObject]:
        """Set some faults of a device at once, and return all faults of all devices.

        Raises:
            ConfigError: No such device or fault, or out of its limits; nothing has changed then.
        """

    def clear_faults(self) -> dict[str, JsonObject]:
        """Mend everything."""


@dataclass(frozen=True, slots=True)
class SensingAxis:
    """The body axis of a sensor that lies in the table's plane.

    Attributes:
        sensor: The instrument that it belongs to.
        quantity: ``rate`` (rad/s) or ``force`` (standard gravities).
        column: 0, 1 or 2 for x, y or z.
        sign: -1 where the axis points backwards.
        expected_noise_sqrt_s: What a prediction assumes: the mean over T seconds has sigma this
            over sqrt(T), in the quantity's unit.
    """

    sensor: InertialSensor
    quantity: Literal["rate", "force"]
    column: int
    sign: float
    expected_noise_sqrt_s: float

    def values(self, block: SampleBlock) -> FloatArray:
        """Return the axis's readings, rad/s or g, shape ``(k,)``."""
        all_axes = block.rate_rad_s if self.quantity == "rate" else block.specific_force_g
        return self.sign * all_axes[:, self.column]

    def valid(self, block: SampleBlock) -> BoolArray:
        """Return which readings the device vouches for, shape ``(k,)``."""
        bits = block.rate_valid if self.quantity == "rate" else block.force_valid
        valid: BoolArray = bits[:, self.column] & np.isfinite(self.values(block))
        return valid


class Rig:
    """An open bench: ``async with rig`` opens every instrument and leaves each as it was found.

    Args:
        config: What it was made from, the latitude filled in.
        turntable: The table.
        gyro: The axis that feels the Earth's rate.
        accelerometer: The axis that feels the tilt; its sensor may be the gyro's.
        simulation: Present where a link is simulated.

    Attributes:
        config: As given; follows what is changed of the simulation.
        gyro: As given, with the noise that the simulation has now.
        accelerometer: The same.
        target_rad: Where the table is turning to, counter-clockwise seen from above; None while
            no move is under way.
    """

    def __init__(
        self,
        config: RigConfig,
        turntable: Turntable,
        gyro: SensingAxis,
        accelerometer: SensingAxis,
        simulation: Simulation | None,
    ) -> None:
        self.target_rad: float | None = None
        self.config = config
        self.gyro = gyro
        self.accelerometer = accelerometer
        self.simulation = simulation
        self._turntable = turntable
        clockwise = config.turntable.positive_direction == "clockwise"
        self._direction = -1.0 if clockwise else 1.0
        self._open = AsyncExitStack()

    async def __aenter__(self) -> Self:
        async with AsyncExitStack() as stack:
            if self.simulation is not None:
                stack.push_async_callback(self.simulation.stop)
                await self.simulation.start()
            for instrument in self._instruments():
                stack.push_async_callback(instrument.close)
                await instrument.open()
            self._open = stack.pop_all()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._open.aclose()

    @property
    def name(self) -> str:
        """Return the name of its site."""
        return self.config.site.name

    @property
    def turns(self) -> bool:
        """Return whether there is a table at all."""
        return self.config.turntable.turns

    @property
    def motion_limits(self) -> MotionLimits:
        """Return how fast the table turns."""
        return self._turntable.limits

    async def table_state(self) -> TableState:
        """Ask where the table is, counter-clockwise seen from above."""
        return self._seen_from_above(await self._turntable.state())

    async def observe_table(self) -> TableState:
        """Look where the table is while whatever it does goes on; a fault is only reported."""
        return self._seen_from_above(await self._turntable.observe())

    async def home(self) -> TableState:
        """Find the table's reference."""
        return self._seen_from_above(await self._turntable.home())

    async def move_to(self, angle_rad: float, speed_rad_s: float | None = None) -> TableState:
        """Turn the table to an angle counter-clockwise seen from above and wait for it.

        Args:
            angle_rad: No wrap.
            speed_rad_s: Of this move alone; by default the table's own.
        """
        self.target_rad = angle_rad
        towards_rad = self._direction * angle_rad
        try:
            return self._seen_from_above(await self._turntable.move_to(towards_rad, speed_rad_s))
        finally:
            self.target_rad = None

    async def stop(self) -> None:
        """Stop the table now."""
        await self._turntable.stop()

    def devices(self) -> list[JsonObject]:
        """Describe each instrument for the record: role, driver, link, identity, counters."""
        roles: list[tuple[str, str, Instrument]] = [
            ("turntable", self.config.turntable.driver, self._turntable),
            ("gyro", self.config.gyro.driver, self.gyro.sensor),
            ("accelerometer", self.config.accelerometer.driver, self.accelerometer.sensor),
        ]
        return [
            {
                "role": role,
                "driver": driver,
                "link": instrument.link_name,
                "identity": asdict(instrument.identity),
                "counters": asdict(instrument.counters),
            }
            for role, driver, instrument in roles
        ]

    def _instruments(self) -> list[Instrument]:
        sensors: list[Instrument] = [self.gyro.sensor]
        if self.accelerometer.sensor is not self.gyro.sensor:
            sensors.append(self.accelerometer.sensor)
        return [self._turntable, *sensors]

    def _seen_from_above(self, state: TableState) -> TableState:
        return replace(state, angle_rad=self._direction * state.angle_rad)
