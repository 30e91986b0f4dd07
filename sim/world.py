"""A simulated world: a bench, the devices on it, and the wires to them."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drivers.links.memory import MemoryLink
from sim.bench import Bench, BenchSensor, Mounting
from sim.faults import FaultyWire, WireFaults
from sim.interfaces import Sensing, SimulatedDevice, TableMechanism
from sim.motion import Plate
from sim.noise import NoiseLevels
from sim.truth import Truth

SensorFactory = Callable[[Sensing], SimulatedDevice]
TableFactory = Callable[[TableMechanism], SimulatedDevice]


@dataclass(frozen=True, slots=True)
class WorldSettings:
    """What the world is made from.

    Attributes:
        truth: Where the bench stands.
        gyro: Noise of every gyro, rad/s.
        accelerometer: Noise of every accelerometer, standard gravities.
        table_sigma_rad: Positioning error of each move of the table, 1 sigma.
        clockwise: Whether the table's positive direction is clockwise seen from above.
        seed: Equal seeds give equal worlds, bit for bit.
    """

    truth: Truth
    gyro: NoiseLevels
    accelerometer: NoiseLevels
    table_sigma_rad: float
    clockwise: bool
    seed: int


class World:
    """Devices that share one bench; each is reached by a link in memory, or served elsewhere."""

    def __init__(self, settings: WorldSettings) -> None:
        self._settings = settings
        table_seed, *self._seeds = np.random.SeedSequence(settings.seed).spawn(16)
        random = np.random.default_rng(table_seed)
        # The reference is not where the table happens to stand: a run begins by homing.
        start_rad = float(random.uniform(0.0, np.pi))
        self.plate = Plate(start_rad, settings.table_sigma_rad, random)
        self.bench = Bench(settings.truth, self.plate, clockwise=settings.clockwise)
        self.sensors: dict[str, BenchSensor] = {}
        self.devices: dict[str, SimulatedDevice] = {}
        self._wires: dict[str, FaultyWire] = {}
        self._tasks: list[asyncio.Task[None]] = []

    def add_table(self, name: str, factory: TableFactory) -> None:
        """Put a motor under the plate."""
        self.devices[name] = factory(self.plate)

    def add_sensor(self, name: str, factory: SensorFactory, mounting: Mounting) -> None:
        """Bolt a sensor to the plate; each has noise of its own."""
        random = np.random.default_rng(self._seeds.pop(0))
        settings = self._settings
        sensor = BenchSensor(self.bench, mounting, settings.gyro, settings.accelerometer, random)
        self.sensors[name] = sensor
        self.devices[name] = factory(sensor)

    def link(self, name: str) -> MemoryLink:
        """Connect a device by a wire in memory, and return the client's end."""
        wire = FaultyWire(
            f"sim:{name}", self.devices[name], np.random.default_rng(self._seeds.pop(0))
        )
        self._wires[name] = wire
        return wire.link

    def faults(self, name: str) -> WireFaults:
        """Return the faults of a device's wire; set them at any time."""
        return self._wires[name].faults

    def change(self, truth: Truth, gyro: NoiseLevels, accelerometer: NoiseLevels) -> None:
        """Set the bench down elsewhere, or let its sensors err otherwise, while they run."""
        self.bench.truth = truth
        for sensor in self.sensors.values():
            sensor.gyro_noise.levels = gyro
            sensor.accelerometer_noise.levels = accelerometer

    async def start(self) -> None:
        """Power every device up."""
        self._tasks = [
            asyncio.create_task(device.run(), name=f"simulated {name}")
            for name, device in self.devices.items()
        ]

    async def stop(self) -> None:
        """Power every device down; a device that crashed says so here."""
        for task in self._tasks:
            task.cancel()
        ends = await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tasks = []
        for end in ends:
            if isinstance(end, Exception):
                raise end
