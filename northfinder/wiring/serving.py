"""The simulated instruments for any client: on pseudo-terminals, TCP ports, or a CAN bus."""

import sys
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from functools import partial
from typing import cast

from drivers.interfaces import Role
from drivers.links.can_port import CanPort
from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.ports import SIMULATED, CanAddress, is_can
from northfinder.wiring.can import can_settings, check_dbc, tells_its_node
from northfinder.wiring.defaults import with_latitude
from northfinder.wiring.world import build_world
from sim.can_bridge import bridged
from sim.interfaces import Terminal
from sim.slcan import SlcanAdapter
from sim.tcp import serve_on_tcp
from sim.world import World

_ADAPTER = "slcan"

Listening = list[dict[str, str]]


@asynccontextmanager
async def serve_simulation(
    config: RigConfig, serial: str, can: str | None = None
) -> AsyncIterator[Listening]:
    """Serve the configuration's simulated instruments to other programs.

    Args:
        config: The rig; every instrument whose link is ``sim:`` is served, and every node whose
            link is on the bus that is served.
        serial: ``pty`` or ``tcp``: where those with a serial line listen.
        can: ``INTERFACE:CHANNEL``, the bus that those of CAN are on; ``slcan:pty`` or
            ``slcan:tcp`` makes an adapter.

    Yields:
        Role, driver and link of each.

    Raises:
        ConfigError: There is nothing to serve, no bus for the CAN instruments, or no such bus.
    """
    config = with_latitude(config)
    check_dbc(config)
    world = build_world(config, partial(_is_served, can))
    if not world.roles:
        where = '"sim:"' if can is None else f'"sim:" or on the bus {can}'
        msg = f"no link of this configuration is {where}: there is nothing to serve"
        raise ConfigError(msg)
    if world.nodes and can is None:
        names = " and ".join(world.nodes)
        msg = f"the {names} is on a CAN bus: say which, with --can socketcan:vcan0 or slcan:pty"
        raise ConfigError(msg)
    async with AsyncExitStack() as stack:
        listening = [
            _entry(config, role, await stack.enter_async_context(_server(serial)(device)))
            for role, device in world.devices.items()
        ]
        if can is not None and world.nodes:
            listening += await _serve_nodes(stack, config, world, can)
        await world.start()
        stack.push_async_callback(world.stop)
        yield listening


def _is_served(can: str | None, link: str) -> bool:
    if link == SIMULATED:
        return True
    if can is None or not is_can(link):
        return False
    return CanAddress.parse(link, "sim").bus == CanAddress.parse(f"can:{can}", "sim").bus


async def _serve_nodes(
    stack: AsyncExitStack, config: RigConfig, world: World, can: str
) -> Listening:
    """Put the nodes on the bus, and return where a client finds each."""
    for role in world.nodes:
        world.put_on_bus(role)
    interface, _, channel = can.partition(":")
    if interface == _ADAPTER and channel in {"pty", "tcp"}:
        line = await stack.enter_async_context(_server(channel)(SlcanAdapter(world.can)))
        bus = f"can:{_ADAPTER}:{line}"
    else:
        from drivers.links.can import CanBus  # noqa: PLC0415 - python-can takes 0.2 s

        address = CanAddress.parse(f"can:{can}", "sim")
        outside = CanPort(CanBus(*address.bus, address.options))
        await stack.enter_async_context(bridged(world.can, outside))
        bus = f"can:{can}"
    return [_entry(config, role, f"{bus}{_node(config, role)}") for role in world.nodes]


def _node(config: RigConfig, role: str) -> str:
    settings = can_settings(cast("Role", role), getattr(config, role), config)
    return f":node={settings.node}" if tells_its_node(settings) else ""


def _entry(config: RigConfig, role: str, link: str) -> dict[str, str]:
    return {"role": role, "driver": getattr(config, role).driver, "link": link}


def _server(transport: str) -> Callable[[Terminal], AbstractAsyncContextManager[str]]:
    if transport == "tcp":
        return serve_on_tcp
    if sys.platform == "win32":
        msg = "--serial pty needs pseudo-terminals, which this platform lacks: use --serial tcp"
        raise ConfigError(msg)
    from sim.pty import serve_on_pty  # noqa: PLC0415 - absent on Windows

    return serve_on_pty
