"""``northfinder seek`` and ``northfinder plan``."""

import asyncio
import json
from typing import Any

import click
from rich.console import Console

from northfinder.cli.display import LiveProgress, print_prediction, print_result
from northfinder.cli.options import database_option, database_url, plan_options, rig_options
from northfinder.config import RigConfig
from northfinder.procedures.north_seek import Plan, predict
from northfinder.recording import record_north_seek
from northfinder.records import Records, Writer
from northfinder.wiring import build_rig, event_loop

AS_FAST_AS_IT_GOES = float("inf")


@click.command()
@rig_options
@plan_options
@database_option
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
def seek(config: RigConfig, plan: Plan, database: str | None, *, as_json: bool) -> None:
    """Find true north once; without --config on the simulated rig, in virtual time."""
    with asyncio.Runner(loop_factory=event_loop(config, AS_FAST_AS_IT_GOES)) as runner:
        result = runner.run(_seek(config, plan, database_url(database, config)))
    if as_json:
        click.echo(json.dumps(result))
    else:
        print_result(Console(), result)


async def _seek(config: RigConfig, plan: Plan, url: str) -> dict[str, Any]:
    with Records.open(url) as store:
        async with Writer(store) as writer, build_rig(config) as rig:
            with LiveProgress() as progress:
                return await record_north_seek(rig, plan, writer, progress.show)


@click.command("plan")
@rig_options
@plan_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
def plan_command(config: RigConfig, plan: Plan, *, as_json: bool) -> None:
    """Say what a north-seek would take: duration, uncertainty, budget. Moves nothing."""
    with asyncio.Runner(loop_factory=event_loop(config, AS_FAST_AS_IT_GOES)) as runner:
        prediction = runner.run(_predict(config, plan))
    if as_json:
        click.echo(json.dumps(prediction))
    else:
        print_prediction(Console(), prediction)


async def _predict(config: RigConfig, plan: Plan) -> dict[str, Any]:
    async with build_rig(config) as rig:
        return predict(plan, rig).to_json()
