"""A simulated world: a bench, the devices on it, and the wires to them."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from drivers.interfaces import CanLink, Link
from drivers.links.can_port import CanPort
from drivers.links.memory_can import MemoryBus
from sim.bench import Bench, BenchSensor, Mounting
from sim.faults import FaultyTap, FaultyWire, WireFaults
from sim.interfaces import Sensing, SimulatedDevice, SimulatedNode, TableMechanism
from sim.motion import Plate
from sim.noise import NoiseLevels
from sim.rocking_base import RockingSettings
from sim.truth import Truth

SensorFactory = Callable[[Sensing], SimulatedDevice | SimulatedNode]
TableFactory = Callable[[TableMechanism], SimulatedDevice | SimulatedNode]


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
        rocking: How the bench's base moves; None where it stands still.
        turns: Whether it has a table; without one the plate stands at its reference for ever.
    """

    truth: Truth
    gyro: NoiseLevels
    accelerometer: NoiseLevels
    table_sigma_rad: float
    clockwise: bool
    seed: int
    rocking: RockingSettings | None = None
    turns: bool = True


class World:
    """Devices that share one bench; each is reached by a link in memory, or served elsewhere.

    Attributes:
        plate: The table's.
        bench: What it stands on.
        sensors: By role.
        devices: Those with a serial line, by role.
        nodes: Those on the CAN bus, by role.
        can: The bus.
    """

    def __init__(self, settings: WorldSettings) -> None:
        self._settings = settings
        table_seed, *self._seeds = np.random.SeedSequence(settings.seed).spawn(16)
        random = np.random.default_rng(table_seed)
        # The reference is not where the table happens to stand: a run begins by homing.
        start_rad = float(random.uniform(0.0, np.pi)) if settings.turns else 0.0
        self.plate = Plate(start_rad, settings.table_sigma_rad, random)
        self.bench = Bench(
            settings.truth, self.plate, clockwise=settings.clockwise, rocking=settings.rocking
        )
        self.sensors: dict[str, BenchSensor] = {}
        self.devices: dict[str, SimulatedDevice] = {}
        self.nodes: dict[str, SimulatedNode] = {}
        self.can = MemoryBus("sim:can")
        self._wires: dict[str, FaultyWire] = {}
        self._taps: dict[str, FaultyTap] = {}
        self._unplugged: set[str] = set()
        self._tasks: list[asyncio.Task[None]] = []

    def add_table(self, name: str, factory: TableFactory) -> None:
        """Put a motor under the plate."""
        self._add(name, factory(self.plate))

    def add_sensor(self, name: str, factory: SensorFactory, mounting: Mounting) -> None:
        """Bolt a sensor to the plate; each has noise of its own."""
        random = np.random.default_rng(self._seeds.pop(0))
        settings = self._settings
        sensor = BenchSensor(self.bench, mounting, settings.gyro, settings.accelerometer, random)
        self.sensors[name] = sensor
        self._add(name, factory(sensor))

    def _add(self, name: str, device: SimulatedDevice | SimulatedNode) -> None:
        if device.transport == "can":
            self.nodes[name] = cast("SimulatedNode", device)
        else:
            self.devices[name] = cast("SimulatedDevice", device)

    @property
    def roles(self) -> list[str]:
        """Return the names of all devices."""
        return [*self.devices, *self.nodes]

    def link(self, name: str) -> Link:
        """Connect a device by a wire in memory, and return the client's end."""
        random = np.random.default_rng(self._seeds.pop(0))
        wire = FaultyWire(f"sim:{name}", self.devices[name], random)
        self._wires[name] = wire
        return wire.link

    def can_link(self, name: str) -> CanLink:
        """Put a node on the bus, and return a part of the bus for its driver."""
        self.put_on_bus(name)
        return CanPort(self.can)

    def put_on_bus(self, name: str) -> None:
        """Put a node on the bus, for whoever is there."""
        random = np.random.default_rng(self._seeds.pop(0))
        self._taps[name] = FaultyTap(self.can, self.nodes[name], random)

    def unplug(self, name: str) -> None:
        """Pull the computer's end of a device's cable out; on CAN the adapter, all devices'."""
        if name in self._wires:
            self._wires[name].unplug()
            self._unplugged.add(name)
        else:
            self.can.fail("is gone; check its adapter")
            self._unplugged |= self.nodes.keys()

    def plug_in(self, name: str) -> None:
        """Push it back in; whoever used it has to open it again."""
        if name in self._wires:
            self._wires[name].plug_in()
            self._unplugged.discard(name)
        else:
            self.can.mend()
            self._unplugged -= self.nodes.keys()

    def is_unplugged(self, name: str) -> bool:
        """Say whether a device's cable is out at the computer's end."""
        return name in self._unplugged

    def faults(self, name: str) -> WireFaults:
        """Return the faults of a device's wire; set them at any time."""
        wires: dict[str, FaultyWire | FaultyTap] = {**self._wires, **self._taps}
        return wires[name].faults

    def change(self, settings: WorldSettings) -> None:
        """Set the bench down elsewhere, or let its sensors err otherwise, while they run.

        How the table errs and which way it turns stay as they were made.
        """
        self.bench.set_down(settings.truth, settings.rocking)
        for sensor in self.sensors.values():
            sensor.gyro_noise.levels = settings.gyro
            sensor.accelerometer_noise.levels = settings.accelerometer

    async def start(self) -> None:
        """Power every device up."""
        self._tasks = [
            asyncio.create_task(device.run(), name=f"simulated {name}")
            for name, device in (self.devices | self.nodes).items()
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
