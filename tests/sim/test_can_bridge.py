"""What passes between simulated nodes and the bus that they are served on."""

import asyncio

import can

from drivers.interfaces import CanFrame
from drivers.links.can import CanBus
from drivers.links.can_port import CanPort
from drivers.links.memory_can import MemoryBus
from sim.can_bridge import bridged

CHANNEL = "northfinder-test-bridge"


def test_frames_of_29_bits_do_not_reach_the_nodes() -> None:
    """None takes them, and taking them off a full bus costs the nodes their time."""
    seen: list[CanFrame] = []

    async def session() -> None:
        bus = MemoryBus("inside")
        bus.attach(seen.append)
        async with bridged(bus, CanPort(CanBus("virtual", CHANNEL, {}))):
            with can.Bus(interface="virtual", channel=CHANNEL) as other:
                for extended in (True, False):
                    other.send(can.Message(arbitration_id=0x605, is_extended_id=extended))
                async with asyncio.timeout(10.0):
                    while not seen:  # noqa: ASYNC110 -- the last of both is what is waited for
                        await asyncio.sleep(0.005)

    asyncio.run(session())
    assert seen == [CanFrame(0x605)]
