"""``northfinder seek`` and ``northfinder plan``."""

import asyncio
import json
from typing import Any

import click

from northfinder.cli.carrying_out import carry_out
from northfinder.cli.display import print_prediction, table_console
from northfinder.cli.options import (
    AS_FAST_AS_IT_GOES,
    database_option,
    json_option,
    plan_options,
    rig_options,
)
from northfinder.config import RigConfig
from northfinder.procedures.north_seek import Plan, predict
from northfinder.wiring import build_rig, event_loop


@click.command(short_help="Find true north once.")
@rig_options
@plan_options
@database_option
@json_option
def seek(config: RigConfig, plan: Plan, database: str | None, *, as_json: bool) -> None:
    """Find true north once; without --config on the simulated rig, in virtual time.

    The run is recorded, whatever ends it: see `northfinder runs`.
    """
    carry_out(config, plan, database, as_json=as_json)


@click.command("plan", short_help="Say what a north-seek would take; move nothing.")
@rig_options
@plan_options
@json_option
def plan_command(config: RigConfig, plan: Plan, *, as_json: bool) -> None:
    """Say what a north-seek would take: duration, uncertainty, budget. Moves nothing."""
    with asyncio.Runner(loop_factory=event_loop(config, AS_FAST_AS_IT_GOES)) as runner:
        prediction = runner.run(_predict(config, plan))
    if as_json:
        click.echo(json.dumps(prediction))
    else:
        print_prediction(table_console(), prediction)


async def _predict(config: RigConfig, plan: Plan) -> dict[str, Any]:
    async with build_rig(config) as rig:
        return predict(plan, rig).to_json()
