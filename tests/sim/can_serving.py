"""Simulated nodes on a CAN interface in wall time, for clients that know nothing of asyncio."""

import asyncio
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from drivers.errors import LinkTimeoutError
from drivers.links.can import CanBus
from drivers.links.can_port import CanPort
from sim.canopen.node import SimulatedNode


@contextmanager
def serving(interface: str, channel: str, *nodes: SimulatedNode) -> Iterator[Callable[..., None]]:
    """Run nodes on a bus, in a thread of its own, until the block ends.

    Args:
        interface: One of python-can's: ``virtual``, ``socketcan``, ``slcan``.
        channel: Which one: a name of its own, ``vcan0``, a pseudo-terminal.
        nodes: They must not have been started.

    Yields:
        What carries a function out in the nodes' thread, and waits for it.
    """
    loop = asyncio.new_event_loop()
    ready, stop = threading.Event(), asyncio.Event()
    ends: list[BaseException] = []

    def live() -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(_live(CanBus(interface, channel, {}), nodes, ready, stop))
        except BaseException as error:  # noqa: BLE001 -- raised again in the test's thread
            ends.append(error)
            ready.set()

    thread = threading.Thread(target=live, name="simulated nodes")
    thread.start()
    ready.wait()

    def carry_out(function: Callable[..., object], *arguments: object) -> None:
        async def call() -> None:
            function(*arguments)

        asyncio.run_coroutine_threadsafe(call(), loop).result(5.0)

    try:
        if not ends:
            yield carry_out
    finally:
        if thread.is_alive():
            loop.call_soon_threadsafe(stop.set)
        thread.join()
    if ends:
        raise ends[0]


async def _live(
    bus: CanBus, nodes: Sequence[SimulatedNode], ready: threading.Event, stop: asyncio.Event
) -> None:
    async with asyncio.TaskGroup() as group:
        tasks = []
        for node in nodes:
            port = CanPort(bus)
            await port.open()
            node.connect(lambda frame, port=port: bus.send(frame, port))  # type: ignore[misc]
            tasks += [group.create_task(_receive(port, node)), group.create_task(node.run())]
        ready.set()
        await stop.wait()
        for task in tasks:
            task.cancel()


async def _receive(port: CanPort, node: SimulatedNode) -> None:
    try:
        while True:
            try:
                arrivals = await port.read(1.0)
            except LinkTimeoutError:
                continue
            for frame in arrivals.frames:
                node.receive_frame(frame)
    finally:
        await port.close()
