"""Simulated nodes on a CAN interface in wall time, for clients that know nothing of asyncio."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from functools import partial
from typing import NamedTuple

from drivers.links.can import CanBus
from drivers.links.can_port import CanPort
from drivers.links.memory_can import MemoryBus
from sim.can_bridge import bridged
from sim.canopen.node import SimulatedNode
from sim.pty import serve_on_pty
from sim.slcan import SlcanAdapter

#: How long a client of other make waits: its own 0.2 to 0.8 s are a quiet computer's.
PATIENCE_S = 10.0


class Served(NamedTuple):
    """Nodes that live.

    Attributes:
        client: What python-can, and so ``canopen``, is given to get to them.
        in_their_thread: Carries a function out in the nodes' thread, and waits for it.
    """

    client: dict[str, object]
    in_their_thread: Callable[..., None]


@contextmanager
def serving(interface: str, channel: str, *nodes: SimulatedNode) -> Iterator[Served]:
    """Run nodes on a bus, in a thread of its own, until the block ends.

    Args:
        interface: One of python-can's: ``virtual``, ``socketcan``; ``slcan`` is an adapter on a
            pseudo-terminal.
        channel: Which one: a name of its own, ``vcan0``, ``pty``.
        nodes: They must not have been started.
    """
    loop = asyncio.new_event_loop()
    ready, stop = threading.Event(), asyncio.Event()
    clients: list[dict[str, object]] = []
    ends: list[BaseException] = []

    async def live() -> None:
        bus = MemoryBus("nodes")
        async with AsyncExitStack() as stack:
            clients.append(await stack.enter_async_context(_outside(bus, interface, channel)))
            await stack.enter_async_context(_living(bus, nodes))
            ready.set()
            await stop.wait()

    def run() -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(live())
        except BaseException as error:  # noqa: BLE001 -- raised again in the test's thread
            ends.append(error)
            ready.set()

    def carry_out(function: Callable[..., object], *arguments: object) -> None:
        async def call() -> None:
            function(*arguments)

        asyncio.run_coroutine_threadsafe(call(), loop).result(5.0)

    thread = threading.Thread(target=run, name="simulated nodes")
    thread.start()
    ready.wait()
    try:
        if not ends:
            yield Served(clients[0], carry_out)
    finally:
        if thread.is_alive():
            loop.call_soon_threadsafe(stop.set)
        thread.join()
    if ends:
        raise ends[0]


@asynccontextmanager
async def _outside(
    bus: MemoryBus, interface: str, channel: str
) -> AsyncIterator[dict[str, object]]:
    """Join the nodes' bus to the interface; yields what a client opens."""
    if interface == "slcan":
        async with serve_on_pty(SlcanAdapter(bus)) as terminal:
            options = {"bitrate": 500_000, "sleep_after_open": 0}
            yield {"interface": "slcan", "channel": terminal, **options}
    else:
        async with bridged(bus, CanPort(CanBus(interface, channel, {}))):
            yield {"interface": interface, "channel": channel}


@asynccontextmanager
async def _living(bus: MemoryBus, nodes: Sequence[SimulatedNode]) -> AsyncIterator[None]:
    async with asyncio.TaskGroup() as group:
        for node in nodes:
            bus.attach(node.receive_frame, node.wants)
            node.connect(partial(bus.put, sender=node.receive_frame))
        tasks = [group.create_task(node.run()) for node in nodes]
        yield
        for task in tasks:
            task.cancel()
