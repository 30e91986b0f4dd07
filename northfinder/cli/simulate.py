"""``northfinder sim``: the simulated instruments for any client."""

import asyncio
import json

import click

from northfinder.cli.options import rig_options
from northfinder.config import RigConfig
from northfinder.wiring import serve_simulation, serving_loop


@click.command(short_help="Serve the simulated instruments to any client.")
@rig_options
@click.option(
    "--serial",
    "transport",
    type=click.Choice(["pty", "tcp"]),
    default="pty",
    help="A pseudo-terminal each (Linux, macOS), or a TCP port each (anywhere).",
)
@click.option(
    "--can",
    metavar="INTERFACE:CHANNEL",
    help="The bus of CAN instruments: socketcan:vcan0, or slcan:pty for an adapter on a terminal.",
)
def sim(config: RigConfig, transport: str, can: str | None) -> None:
    """Serve the simulated instruments to any client, until interrupted.

    Prints where each listens, one JSON object a line; connect a rig.toml to those links. With
    --can, instruments whose link is a node of that bus are served too: the same rig.toml plays
    both ends.
    """
    with asyncio.Runner(loop_factory=serving_loop(config)) as runner:
        runner.run(_serve(config, transport, can))


async def _serve(config: RigConfig, transport: str, can: str | None) -> None:
    async with serve_simulation(config, transport, can) as listening:
        for instrument in listening:
            click.echo(json.dumps(instrument))
        await asyncio.Event().wait()
