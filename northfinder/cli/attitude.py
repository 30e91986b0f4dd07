"""``northfinder align``, ``hold`` and ``noise``: what a rig does besides turning its table."""

from collections.abc import Mapping

import click
from pydantic import BaseModel

from northfinder.attitude.streaming import INCREMENT_METHODS
from northfinder.cli.carrying_out import carry_out
from northfinder.cli.options import database_option, json_option, rig_options
from northfinder.config import RigConfig
from northfinder.procedures import alignment, heading_hold, noise
from northfinder.validation import validated


@click.command(short_help="Find the heading of a base that may rock.")
@rig_options
@click.option(
    "--duration",
    "duration_s",
    type=float,
    default=alignment.Plan().duration_s,
    metavar="S",
    help="How long to align.",
)
@click.option(
    "--method",
    type=click.Choice(alignment.METHODS),
    default=alignment.Plan().method,
    help="quest is the paper's, low-passed; quest-taper needs no filter.",
)
@click.option(
    "--warm",
    "warm_s",
    type=float,
    default=0.0,
    metavar="S",
    help="Let the low-pass settle so long before.",
)
@database_option
@json_option
def align(
    config: RigConfig,
    database: str | None,
    *,
    as_json: bool,
    **given: object,
) -> None:
    """Find heading and level from the gyro's instrument alone: its rates and forces on three axes.

    The table stands still; its base may rock (--sim-base nominal). Without --config it is the
    simulated rig, in virtual time. The run is recorded: see `northfinder runs`.
    """
    carry_out(config, _plan(alignment.Plan, given), database, as_json=as_json)


@click.command(short_help="Keep the heading that a run has found.")
@rig_options
@click.option(
    "--from",
    "from_run",
    metavar="RUN",
    help="A completed north-seek or alignment; by default the rig's last.",
)
@click.option(
    "--duration",
    "duration_s",
    type=float,
    default=heading_hold.Plan().duration_s,
    metavar="S",
    help="How long to hold it.",
)
@click.option(
    "--rest",
    "rest_s",
    type=float,
    metavar="S",
    help="Measure the biases so long before, at rest.  [30 after a north-seek, else 0]",
)
@click.option(
    "--method",
    type=click.Choice(INCREMENT_METHODS),
    default=heading_hold.Plan().method,
    help="How angle increments are integrated.",
)
@database_option
@json_option
def hold(config: RigConfig, database: str | None, *, as_json: bool, **given: object) -> None:
    """Keep the heading from the gyro's stream, its uncertainty growing as it must.

    The run is recorded: see `northfinder runs`.
    """
    carry_out(config, _plan(heading_hold.Plan, given), database, as_json=as_json)


@click.command("noise", short_help="Find what noise the sensors have.")
@rig_options
@click.option(
    "--duration",
    "duration_s",
    type=float,
    default=noise.Plan().duration_s,
    metavar="S",
    help="How long to record; an hour or more shows the bias instability.",
)
@database_option
@json_option
def noise_command(
    config: RigConfig, database: str | None, *, as_json: bool, **given: object
) -> None:
    """Record while everything stands still: Allan deviation, angle random walk, bias instability.

    The run is recorded: see `northfinder runs`.
    """
    carry_out(config, _plan(noise.Plan, given), database, as_json=as_json)


def _plan(kind: type[BaseModel], given: Mapping[str, object]) -> BaseModel:
    chosen = {key: value for key, value in given.items() if value is not None}
    return validated(kind, chosen, "plan")
