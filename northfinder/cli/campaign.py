"""``northfinder campaign``."""

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from northfinder.campaign.campaign_json import campaign_json, write_summary
from northfinder.campaign.carrying_out import carry_out
from northfinder.campaign.folder import CampaignFolder
from northfinder.campaign.planning import plan_campaign
from northfinder.campaign.settings import Campaign
from northfinder.cli.display import STATUS, plain_table, table_console
from northfinder.cli.options import json_option, plan_options, rig_options
from northfinder.cli.progress import progress_bar
from northfinder.config import RigConfig
from northfinder.formatting import decimals_of, duration
from northfinder.procedures.north_seek import Plan


@click.command(short_help="Say whether the stated uncertainty is true: seeks by the thousand.")
@rig_options
@plan_options
@click.option("--seeks", type=int, default=20_000, metavar="N", help="How many north-seeks.")
@click.option(
    "--tilt",
    "tilt_deg",
    type=float,
    metavar="DEG",
    help="Draw tilts up to this, in any direction, instead of --sim-pitch and --sim-roll.",
)
@click.option("--outliers", type=int, default=0, metavar="K", help="Spoiled visits of each seek.")
@click.option(
    "--outlier-size",
    "outlier_size_deg_h",
    type=float,
    default=0.0,
    metavar="DEG/H",
    help="By how much a visit is spoiled, up or down.",
)
@click.option("--dask", metavar="ADDRESS", help="Compute on the Dask cluster of this scheduler.")
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Keep every seek (Parquet), a figure and the summary; begun again, it goes on there.",
)
@json_option
def campaign(
    config: RigConfig,
    plan: Plan,
    dask: str | None,
    output: Path | None,
    *,
    as_json: bool,
    **settings: Any,  # noqa: ANN401 - checked by the campaign's own model
) -> None:
    """Simulate a north-seek thousands of times, and say whether its stated uncertainty is true.

    The azimuth is any, unless --sim-azimuth gives one. What the sensors do, the --sim options say;
    what the program is told of it, the configuration: noise, bias instability, sigmas of the rest.
    """
    azimuth_deg = _fixed_azimuth_deg(config)
    settings |= {"seed": config.simulation.seed, "azimuth_deg": azimuth_deg}
    planned, prediction = plan_campaign(config, plan, **settings)
    with _SeeksProgress(planned, output) as progress:
        tally = carry_out(planned, output, dask, progress.show)
    result = campaign_json(planned, prediction, tally)
    result["files"] = [] if output is None else write_summary(output, result, tally)
    if as_json:
        click.echo(json.dumps(result))
    else:
        print_campaign(table_console(), result)


def _fixed_azimuth_deg(config: RigConfig) -> float | str:
    """Return the azimuth that was asked for; no one asked: any."""
    given = "azimuth_deg" in config.simulation.model_fields_set
    return config.simulation.azimuth_deg if given else "uniform"


class _SeeksProgress:
    """One line on stderr; nothing where stderr is no terminal.

    Args:
        planned: What is carried out.
        output: Where finished chunks are kept, if anywhere.
    """

    def __init__(self, planned: Campaign, output: Path | None) -> None:
        console = Console(stderr=True, highlight=False)
        self._folder = None if output is None else CampaignFolder(output, planned)
        self._seeks, self._begun_s = planned.seeks, time.monotonic()
        self._is_ours = False  # the folder: another campaign may be there
        self._bar = progress_bar(console, transient=True, disable=not console.is_terminal)
        self._task = self._bar.add_task("beginning", total=planned.seeks, left="")

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._bar.stop()
        if kind is None or self._folder is None or not self._is_ours:
            return
        # Counted there: whoever interrupts may do so after a chunk is kept and before it is shown.
        if kept := self._folder.kept_seeks:
            said = f"{kept:,} of {self._seeks:,} seeks are kept in {self._folder.path}"
            click.echo(f"northfinder: {said}; the same command goes on from there", err=True)

    def show(self, done: int) -> None:
        """Take how many seeks are done, those of an earlier beginning too."""
        self._is_ours = True
        elapsed_s = time.monotonic() - self._begun_s
        left = f"{duration(elapsed_s * (self._seeks - done) / done)} left" if done else ""
        said = f"{done:,} of {self._seeks:,} seeks"
        self._bar.update(self._task, completed=done, description=said, left=left)


def print_campaign(console: Console, result: Mapping[str, Any]) -> None:
    """Print a campaign's outcome from its JSON form."""
    low, high = result["coverage_band_percent"]
    console.print(
        Text(
            f"The stated 95 % interval holds the truth in {result['coverage_percent']:.2f} % of "
            f"{result['seeks']:,} seeks",
            style="bold",
        )
    )
    console.print(_verdict(low, high))
    console.print(_of_what(result))
    if result["chosen"]:
        console.print(result["chosen"])
    for warning in result["warnings"]:
        console.print(Text(f"warning: {warning}", style=STATUS["warn"]))
    console.print()
    console.print(_coverage(result))
    console.print(Text(f"\n{_explained(result)}", style="dim"))
    for file in result["files"]:
        console.print(f"wrote {file}", soft_wrap=True)


def _verdict(low: float, high: float) -> Text:
    band = f"99 % band {low:.2f} to {high:.2f} %"
    if low <= 95.0 <= high:
        return Text(f"{band}: the stated uncertainty is true", style=STATUS["pass"])
    if high < 95.0:
        return Text(f"{band}: the stated uncertainty is too small", style=STATUS["fail"])
    return Text(f"{band}: the stated uncertainty is too large", style=STATUS["warn"])


def _of_what(result: Mapping[str, Any]) -> str:
    plan, simulated = result["plan"], result["simulation"]
    return (
        f"{plan['positions']} angles, {plan['dwell_s']:.4g} s at each in all, order "
        f"{plan['order']}; gyro {simulated['gyro_noise_deg_sqrt_h']:g} deg/sqrt(h), bias "
        f"instability {simulated['gyro_bias_instability_deg_h']:g} deg/h"
    )


def _coverage(result: Mapping[str, Any]) -> Table:
    table = plain_table("deg")
    for column in ("seeks", "held, %", "99 % band", "scatter", "/sigma", "/bound", "wrong"):
        table.add_column(column, justify="right", no_wrap=True)
    for share in (result, *result["classes"]):
        low, high = share["coverage_band_percent"]
        table.add_row(
            share["name"].removesuffix(" deg"),
            f"{share['seeks']:,}",
            f"{share['coverage_percent']:.2f}",
            f"{low:.2f}-{high:.2f}",
            f"{share['scatter_deg']:.{decimals_of(share['scatter_deg'])}f}",
            f"{share['scatter_over_sigma']:.3f}",
            f"{share['scatter_over_bound']:.3f}",
            str(share["wrong"]),
        )
    return table


def _explained(result: Mapping[str, Any]) -> str:
    predicted_deg = result["predicted_sigma_deg"]
    return (
        "scatter: root mean square error, over the stated sigma and over the Cramer-Rao bound of "
        f"the noise; wrong: beyond 4 stated sigma, {result['wrong_by_chance']:.2g} by chance. "
        "The plan promises a sigma of "
        f"{predicted_deg:.{decimals_of(predicted_deg)}f} deg at its least favourable azimuth."
    )
