"""What goes wrong on a wire: bytes or frames lost, changed, twice, late, or none at all."""

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
        duplicate_per_byte: Probability that a byte comes twice; of a frame with such a byte, the
            frame, as where its acknowledgement was seen too late and it is sent again.
        repeat_per_burst: Probability that all that left at one moment comes twice, intact.
        delay_s: Every byte comes this much later, in order.
        silent: Nothing comes at all, and nothing is heard: as if unpowered.
    """

    drop_per_byte: float = 0.0
    corrupt_per_byte: float = 0.0
    duplicate_per_byte: float = 0.0
    repeat_per_burst: float = 0.0
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
        self._late.deliver(self._repeated(self._damaged(data)), self.faults.delay_s)

    def unplug(self) -> None:
        """Pull the computer's end out: its port is gone until it is plugged in again."""
        self.link.unplug()

    def plug_in(self) -> None:
        """Push it back in; whoever used it has to open it again."""
        self.link.plug_in()

    def _damaged(self, data: bytes) -> bytes:
        faults = self.faults
        if not (faults.drop_per_byte or faults.corrupt_per_byte or faults.duplicate_per_byte):
            return data
        array = np.frombuffer(data, np.uint8).copy()
        corrupt = self._random.random(len(array)) < faults.corrupt_per_byte
        flips = self._random.integers(1, 256, len(array), dtype=np.uint8)
        array[corrupt] ^= flips[corrupt]
        kept = array[self._random.random(len(array)) >= faults.drop_per_byte]
        if not faults.duplicate_per_byte:
            return kept.tobytes()
        twice = self._random.random(len(kept)) < faults.duplicate_per_byte
        return np.repeat(kept, 1 + twice).tobytes()

    def _repeated(self, data: bytes) -> bytes:
        often = self.faults.repeat_per_burst
        return 2 * data if often and self._random.random() < often else data


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
        if self._hit(frame, 1.0 - (1.0 - faults.drop_per_byte) * (1.0 - faults.corrupt_per_byte)):
            self._bus.error_frames += 1
            return
        self._late.deliver(frame, faults.delay_s)
        if self._hit(frame, faults.duplicate_per_byte) or self._repeats():
            self._late.deliver(frame, faults.delay_s)

    def _put(self, frame: CanFrame) -> None:
        self._bus.put(frame, self._to_node)

    def _hit(self, frame: CanFrame, per_byte: float) -> bool:
        """Say whether any byte of a frame is hit, each with that probability."""
        if not per_byte:
            return False
        intact = (1.0 - per_byte) ** max(1, len(frame.data))
        return bool(self._random.random() >= intact)

    def _repeats(self) -> bool:
        often = self.faults.repeat_per_burst
        return bool(often and self._random.random() < often)
