"""A faulty wire does what its faults say, as often as they say, and nothing else."""

import asyncio
from collections.abc import Awaitable, Callable
from itertools import groupby
from typing import ClassVar

import numpy as np
import pytest

from drivers.errors import LinkTimeoutError, TransportError
from drivers.interfaces import CanFrame, Transport
from drivers.links.memory_can import MemoryBus
from sim.clock import run_virtual
from sim.faults import FaultyTap, FaultyWire


class Far:
    """A device that sends what a test tells it, and remembers what it hears."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        self.send: Callable[[bytes], None]

    def connect(self, send: Callable[[bytes], None]) -> None:
        self.send = send

    def receive_data(self, data: bytes) -> None:
        self.heard.append(data)

    async def run(self) -> None:
        """It lives by what the test does."""


def on_a_wire(scenario: Callable[[FaultyWire, Far], Awaitable[None]], seed: int = 1) -> None:
    async def session() -> None:
        far = Far()
        wire = FaultyWire("sim:gyro", far, np.random.default_rng(seed))
        await wire.link.open()
        await scenario(wire, far)

    run_virtual(session())


def count_of(probability: float, trials: int) -> object:
    """The mean of a binomial count, within five of its sigma."""
    sigma = np.sqrt(trials * probability * (1 - probability))
    return pytest.approx(trials * probability, abs=5 * sigma)


TRIALS = 200_000
RAMP = bytes(range(250)) * (TRIALS // 250)


def test_a_sound_wire_changes_nothing_either_way() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        far.send(RAMP)
        assert await wire.link.read(0.1) == (RAMP, 0.0)
        await wire.link.write(b"?IS\r")
        assert far.heard == [b"?IS\r"]

    on_a_wire(scenario)


def test_bytes_are_dropped_with_the_stated_probability_and_the_rest_keep_their_order() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.drop_per_byte = 0.01
        far.send(RAMP)
        arrived = np.frombuffer((await wire.link.read(0.1)).data, np.uint8).astype(np.int64)
        assert TRIALS - len(arrived) == count_of(0.01, TRIALS)
        skipped = np.diff(arrived) % 250 - 1
        assert skipped.sum() == pytest.approx(TRIALS - len(arrived), abs=10)

    on_a_wire(scenario)


def test_bytes_are_corrupted_with_the_stated_probability_and_always_changed() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.corrupt_per_byte = 0.02
        far.send(RAMP)
        arrived = (await wire.link.read(0.1)).data
        changed = [now for was, now in zip(RAMP, arrived, strict=True) if was != now]
        assert len(changed) == count_of(0.02, TRIALS)
        assert len(set(changed)) == 256

    on_a_wire(scenario)


def test_commands_reach_the_device_whole_whatever_happens_to_its_answers() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.drop_per_byte = wire.faults.corrupt_per_byte = 1.0
        await wire.link.write(RAMP)
        assert far.heard == [RAMP]
        far.send(RAMP)
        with pytest.raises(LinkTimeoutError):
            await wire.link.read(1.0)

    on_a_wire(scenario)


def test_equal_seeds_damage_the_same_bytes() -> None:
    outcomes: list[bytes] = []

    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.drop_per_byte = wire.faults.corrupt_per_byte = 0.1
        far.send(RAMP)
        outcomes.append((await wire.link.read(0.1)).data)

    for seed in (1, 1, 2):
        on_a_wire(scenario, seed)
    assert outcomes[0] == outcomes[1] != outcomes[2]


def test_delayed_bytes_come_that_much_later() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.delay_s = 0.3
        far.send(b"late")
        with pytest.raises(LinkTimeoutError):
            await wire.link.read(0.2)
        data, arrival_s = await wire.link.read(0.2)
        assert data == b"late"
        assert arrival_s == pytest.approx(0.3)

    on_a_wire(scenario)


async def everything(wire: FaultyWire) -> bytes:
    data = b""
    try:
        while True:
            data += (await wire.link.read(1.0)).data
    except LinkTimeoutError:
        return data


def test_delayed_bytes_keep_their_order_even_if_sent_at_one_moment() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.delay_s = 0.3
        for byte in range(20):
            far.send(bytes([byte]))
        assert await everything(wire) == bytes(range(20))

    on_a_wire(scenario)


def test_a_delay_that_shrinks_lets_no_byte_overtake_another() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        for byte, delay_s in enumerate((0.3, 0.1, 0.0, 0.2, 0.0)):
            wire.faults.delay_s = delay_s
            far.send(bytes([byte]))
            await asyncio.sleep(0.01)
        data, arrival_s = await wire.link.read(1.0)
        assert arrival_s == pytest.approx(0.3)
        assert data + await everything(wire) == bytes(range(5))
        far.send(b"prompt")
        assert (await wire.link.read(0.0)).data == b"prompt"

    on_a_wire(scenario)


def test_a_silent_wire_carries_nothing_either_way_until_it_is_mended() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.silent = True
        far.send(b"data")
        await wire.link.write(b"command")
        assert far.heard == []
        with pytest.raises(LinkTimeoutError, match="sim:gyro was silent for 1 s"):
            await wire.link.read(1.0)
        wire.faults.silent = False
        far.send(b"data")
        assert (await wire.link.read(1.0)).data == b"data"

    on_a_wire(scenario)


def test_bytes_are_doubled_with_the_stated_probability_beside_themselves() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.duplicate_per_byte = 0.01
        far.send(RAMP)
        arrived = np.frombuffer((await wire.link.read(0.1)).data, np.uint8).astype(np.int64)
        steps = np.diff(arrived) % 250
        assert len(arrived) - TRIALS == count_of(0.01, TRIALS) == np.count_nonzero(steps == 0)
        assert set(steps.tolist()) == {0, 1}

    on_a_wire(scenario)


def test_a_burst_that_is_repeated_comes_twice_whole() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        wire.faults.repeat_per_burst = 0.5
        for _ in range(1000):
            far.send(b"ab")
        arrived = await everything(wire)
        assert arrived == b"ab" * (len(arrived) // 2)
        assert len(arrived) // 2 - 1000 == count_of(0.5, 1000)

    on_a_wire(scenario)


def test_a_cable_that_is_pulled_out_fails_the_link_until_it_is_opened_again() -> None:
    async def scenario(wire: FaultyWire, far: Far) -> None:
        reading = asyncio.create_task(wire.link.read(1.0))
        await asyncio.sleep(0.1)
        wire.unplug()
        with pytest.raises(TransportError, match="sim:gyro is gone; check its cable"):
            await reading
        with pytest.raises(TransportError, match="is gone"):
            await wire.link.open()
        wire.plug_in()
        with pytest.raises(TransportError, match="is gone"):
            await wire.link.write(b"command")
        await wire.link.open()
        far.send(b"data")
        assert (await wire.link.read(1.0)).data == b"data"

    on_a_wire(scenario)


class Node:
    """A node on a bus that sends what a test tells it."""

    transport: ClassVar[Transport] = "can"

    def connect(self, send: Callable[[CanFrame], None]) -> None:
        self.send = send

    def wants(self, frame: CanFrame) -> bool:
        return frame.remote

    def receive_frame(self, frame: CanFrame) -> None:
        raise AssertionError(frame)

    async def run(self) -> None:
        """It lives by what the test does."""


@pytest.mark.parametrize(
    ("faults", "per_frame"),
    [({"duplicate_per_byte": 0.01}, 1 - 0.99**8), ({"repeat_per_burst": 0.1}, 0.1)],
)
def test_a_frame_that_is_sent_again_comes_twice_whole(
    faults: dict[str, float], per_frame: float
) -> None:
    async def session() -> None:
        bus, node, heard = MemoryBus("sim:can"), Node(), list[CanFrame]()
        bus.attach(heard.append)
        tap = FaultyTap(bus, node, np.random.default_rng(1))
        for name, value in faults.items():
            setattr(tap.faults, name, value)
        sent = [CanFrame(0x120, count.to_bytes(8, "little")) for count in range(2000)]
        for frame in sent:
            node.send(frame)
        assert len(heard) - len(sent) == count_of(per_frame, len(sent))
        assert [frame for frame, _ in groupby(heard)] == sent
        assert bus.error_frames == 0

    run_virtual(session())
