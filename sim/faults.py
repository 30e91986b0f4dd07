"""What goes wrong on a wire: bytes lost, changed, late, or none at all."""

import asyncio
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from drivers.links.memory import MemoryLink
from sim.interfaces import SimulatedDevice


@dataclass(slots=True)
class WireFaults:
    """The faults of one wire, settable while it runs; those of bytes go from device to client.

    Attributes:
        drop_per_byte: Probability that a byte is lost.
        corrupt_per_byte: Probability that a byte changes.
        delay_s: Every byte comes this much later, in order.
        silent: Nothing comes at all, and nothing is heard: as if unpowered.
    """

    drop_per_byte: float = 0.0
    corrupt_per_byte: float = 0.0
    delay_s: float = 0.0
    silent: bool = False


class FaultyWire:
    """Connects a device to a link in memory, and does what the faults say.

    Args:
        name: What messages call the link.
        device: The device's end.
        random: Seeded; decides which bytes are hit.
    """

    def __init__(self, name: str, device: SimulatedDevice, random: Generator) -> None:
        self.faults = WireFaults()
        self.link = MemoryLink(name, self._to_device)
        self._device = device
        self._random = random
        self._late: deque[bytes] = deque()
        self._due_s = 0.0
        device.connect(self._to_client)

    def _to_device(self, data: bytes) -> None:
        if not self.faults.silent:
            self._device.receive_data(data)

    def _to_client(self, data: bytes) -> None:
        if self.faults.silent:
            return
        arrived = self._damaged(data)
        if self.faults.delay_s or self._late:
            self._deliver_late(arrived)
        else:
            self.link.deliver(arrived)

    def _deliver_late(self, arrived: bytes) -> None:
        """Keep the order: timers due at one moment fire in any, and the delay may shrink."""
        loop = asyncio.get_running_loop()
        self._due_s = max(self._due_s, loop.time() + self.faults.delay_s)
        self._late.append(arrived)
        loop.call_at(self._due_s, self._deliver_oldest)

    def _deliver_oldest(self) -> None:
        self.link.deliver(self._late.popleft())

    def _damaged(self, data: bytes) -> bytes:
        if not (self.faults.drop_per_byte or self.faults.corrupt_per_byte):
            return data
        array = np.frombuffer(data, np.uint8).copy()
        corrupt = self._random.random(len(array)) < self.faults.corrupt_per_byte
        flips = self._random.integers(1, 256, len(array), dtype=np.uint8)
        array[corrupt] ^= flips[corrupt]
        kept = self._random.random(len(array)) >= self.faults.drop_per_byte
        return array[kept].tobytes()
