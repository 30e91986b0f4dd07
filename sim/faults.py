"""What goes wrong on a wire: bytes or frames lost, changed, late, or none at all."""

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.random import Generator

from drivers.interfaces import CanFrame
from drivers.links.memory import MemoryLink
from drivers.links.memory_can import MemoryBus
from sim.interfaces import SimulatedNode, Terminal

T = TypeVar("T")


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


class _Late(Generic[T]):
    """Delivers at once, or later in the same order: the delay may shrink meanwhile."""

    def __init__(self, deliver: Callable[[T], None]) -> None:
        self._deliver = deliver
        self._waiting: deque[T] = deque()
        self._due_s = 0.0

    def deliver(self, item: T, delay_s: float) -> None:
        """Deliver after a delay, and never before what was given earlier."""
        if not (delay_s or self._waiting):
            self._deliver(item)
            return
        loop = asyncio.get_running_loop()
        self._due_s = max(self._due_s, loop.time() + delay_s)
        self._waiting.append(item)
        loop.call_at(self._due_s, self._deliver_oldest)  # timers of one moment fire in any order

    def _deliver_oldest(self) -> None:
        self._deliver(self._waiting.popleft())


class FaultyWire:
    """Connects a device to a link in memory, and does what the faults say.

    Args:
        name: What messages call the link.
        device: The device's end.
        random: Seeded; decides which bytes are hit.
    """

    def __init__(self, name: str, device: Terminal, random: Generator) -> None:
        self.faults = WireFaults()
        self.link = MemoryLink(name, self._to_device)
        self._device = device
        self._random = random
        self._late = _Late(self.link.deliver)
        device.connect(self._to_client)

    def _to_device(self, data: bytes) -> None:
        if not self.faults.silent:
            self._device.receive_data(data)

    def _to_client(self, data: bytes) -> None:
        if self.faults.silent:
            return
        self._late.deliver(self._damaged(data), self.faults.delay_s)

    def _damaged(self, data: bytes) -> bytes:
        if not (self.faults.drop_per_byte or self.faults.corrupt_per_byte):
            return data
        array = np.frombuffer(data, np.uint8).copy()
        corrupt = self._random.random(len(array)) < self.faults.corrupt_per_byte
        flips = self._random.integers(1, 256, len(array), dtype=np.uint8)
        array[corrupt] ^= flips[corrupt]
        kept = self._random.random(len(array)) >= self.faults.drop_per_byte
        return array[kept].tobytes()


class FaultyTap:
    """Connects a node to a bus, and does what the faults say.

    A frame of which any byte is hit is lost: its checksum fails, and that counts as an error.

    Args:
        bus: The bus.
        node: The device.
        random: Seeded; decides which frames are hit.
    """

    def __init__(self, bus: MemoryBus, node: SimulatedNode, random: Generator) -> None:
        self.faults = WireFaults()
        self._bus = bus
        self._node = node
        self._random = random
        self._late = _Late(self._put)
        bus.attach(self._to_node, node.wants)
        node.connect(self._to_bus)

    def _to_node(self, frame: CanFrame) -> None:
        if not self.faults.silent:
            self._node.receive_frame(frame)

    def _to_bus(self, frame: CanFrame) -> None:
        faults = self.faults
        if faults.silent:
            return
        if (faults.drop_per_byte or faults.corrupt_per_byte) and self._is_hit(frame):
            self._bus.error_frames += 1
            return
        self._late.deliver(frame, faults.delay_s)

    def _put(self, frame: CanFrame) -> None:
        self._bus.put(frame, self._to_node)

    def _is_hit(self, frame: CanFrame) -> bool:
        intact_byte = (1.0 - self.faults.drop_per_byte) * (1.0 - self.faults.corrupt_per_byte)
        intact = intact_byte ** max(1, len(frame.data))
        return bool(self._random.random() >= intact)
