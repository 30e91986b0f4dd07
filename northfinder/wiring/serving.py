"""The simulated instruments for any client: behind pseudo-terminals or TCP ports."""

import sys
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager

from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.ports import SIMULATED, links
from northfinder.wiring.world import build_world
from sim.interfaces import SimulatedDevice
from sim.tcp import serve_on_tcp


@asynccontextmanager
async def serve_simulation(
    config: RigConfig, transport: str
) -> AsyncIterator[list[dict[str, str]]]:
    """Serve the configuration's simulated devices on pseudo-terminals or TCP ports.

    Args:
        config: The rig; every instrument whose link is ``sim:`` is served.
        transport: ``pty`` or ``tcp``.

    Yields:
        Role, driver and link of each.

    Raises:
        ConfigError: No link is simulated, or this platform has no pseudo-terminals.
    """
    if SIMULATED not in links(config):
        msg = 'no link of this configuration is "sim:": there is nothing to serve'
        raise ConfigError(msg)
    world = build_world(config)
    serve = serve_on_tcp if transport == "tcp" else _pty_server()
    async with AsyncExitStack() as stack:
        listening = [
            {
                "role": role,
                "driver": getattr(config, role).driver,
                "link": await stack.enter_async_context(serve(device)),
            }
            for role, device in world.devices.items()
        ]
        await world.start()
        stack.push_async_callback(world.stop)
        yield listening


def _pty_server() -> Callable[[SimulatedDevice], AbstractAsyncContextManager[str]]:
    if sys.platform == "win32":
        msg = "--serial pty needs pseudo-terminals, which this platform lacks: use --serial tcp"
        raise ConfigError(msg)
    from sim.pty import serve_on_pty  # noqa: PLC0415 - absent on Windows

    return serve_on_pty
