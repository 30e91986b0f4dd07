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
def sim(config: RigConfig, transport: str) -> None:
    """Serve the simulated instruments to any client, until interrupted.

    Prints where each listens, one JSON object a line; connect a rig.toml to those links.
    """
    with asyncio.Runner(loop_factory=serving_loop(config)) as runner:
        runner.run(_serve(config, transport))


async def _serve(config: RigConfig, transport: str) -> None:
    async with serve_simulation(config, transport) as listening:
        for instrument in listening:
            click.echo(json.dumps(instrument))
        await asyncio.Event().wait()
