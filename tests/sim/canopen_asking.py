"""A master of a simulated drive's bus that knows nothing but frames: it asks and hears."""

import asyncio
import math
from collections.abc import Awaitable, Callable

import numpy as np

from drivers.interfaces import CanFrame
from sim.clock import run_virtual
from sim.devices.cia402 import SimulatedCia402
from sim.motion import Plate

_READ = 0x40
_WRITE = {1: 0x2F, 2: 0x2B, 4: 0x23}  # CiA 301, 7.2.4.3.3: expedited, with the size


class Bus:
    """Speaks to a drive of node number 5."""

    def __init__(self) -> None:
        self.plate = Plate(math.radians(10), 0.0, np.random.default_rng(5))
        self.device = SimulatedCia402(self.plate)
        self.device.connect(self._hear)
        self.heard: list[tuple[float, CanFrame]] = []

    def _hear(self, frame: CanFrame) -> None:
        self.heard.append((asyncio.get_running_loop().time(), frame))

    def send(self, can_id: int, data: bytes = b"") -> list[CanFrame]:
        """Return what the node sends at once."""
        before = len(self.heard)
        self.device.receive_frame(CanFrame(can_id, data))
        return [frame for _, frame in self.heard[before:]]

    def nmt(self, command: int, node: int = 5) -> None:
        self.send(0x000, bytes((command, node)))

    def _ask(self, head: int, index: int, sub_index: int, value: int) -> bytes:
        multiplexer = index.to_bytes(2, "little") + bytes((sub_index,))
        answers = self.send(0x605, bytes((head,)) + multiplexer + value.to_bytes(4, "little"))
        (answer,) = [frame.data for frame in answers if frame.can_id == 0x585]
        assert answer[1:4] == multiplexer
        return answer

    def read(self, index: int, sub_index: int = 0) -> int:
        answer = self._ask(_READ, index, sub_index, 0)
        number = int.from_bytes(answer[4:], "little")
        return -number if answer[0] == 0x80 else number

    def write(self, index: int, sub_index: int, size: int, value: int) -> int:
        """Return 0, or the abort code."""
        answer = self._ask(_WRITE[size], index, sub_index, value % (1 << 8 * size))
        return int.from_bytes(answer[4:], "little") if answer[0] == 0x80 else 0

    def frames(self, can_id: int) -> list[tuple[float, bytes]]:
        return [(time_s, frame.data) for time_s, frame in self.heard if frame.can_id == can_id]

    def control(self, *words: int) -> int:
        for word in words:
            assert self.write(0x6040, 0, 2, word) == 0
        return self.status()

    def status(self) -> int:
        return self.read(0x6041)


def on_bus(use: Callable[[Bus], Awaitable[None]]) -> None:
    async def run() -> None:
        bus = Bus()
        running = asyncio.create_task(bus.device.run())
        await asyncio.sleep(0)
        await use(bus)
        running.cancel()

    run_virtual(run())
