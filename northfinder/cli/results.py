"""What a person sees of a result on a terminal, whichever kind of run it came from."""

import json
from collections.abc import Mapping
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from northfinder.cli.display import (
    add_value,
    budget_table,
    checks_table,
    plain_table,
    print_north,
    print_north_seek,
    table_console,
    verdict,
)
from northfinder.formatting import duration

Result = Mapping[str, Any]


def show_result(result: Result, *, as_json: bool) -> None:
    """Write a result to stdout, as JSON and nothing else or for a person."""
    if as_json:
        click.echo(json.dumps(result))
    else:
        print_result(table_console(), result)


def print_result(console: Console, result: Result) -> None:
    """Print a result from its JSON form."""
    _PRINTERS[result["kind"]](console, result)
    console.print(f"\nrun {result['run_id']}")


def _print_alignment(console: Console, result: Result) -> None:
    print_north(console, result)
    console.print(f"By {result['method']} over {duration(result['duration_s'])}")
    console.print(verdict(result["checks"]))
    for table in (_attitude(result), budget_table(result), checks_table(result)):
        console.print()
        console.print(table)


def _print_heading_hold(console: Console, result: Result) -> None:
    print_north(console, result)
    start = result["start"]
    held_deg = (result["azimuth_deg"] - start["azimuth_deg"] + 180.0) % 360.0 - 180.0
    console.print(
        f"Held for {duration(result['time_s'])} from run {start['run_id']} by {result['method']}: "
        f"turned by {held_deg:+.4f} deg"
    )
    console.print(verdict(result["checks"]))
    for table in (_attitude(result), budget_table(result), checks_table(result)):
        console.print()
        console.print(table)


def _print_noise(console: Console, result: Result) -> None:
    console.print(Text(_noise_headline(result["gyro"]), style="bold"))
    console.print(verdict(result["checks"]))
    for name in ("gyro", "accelerometer"):
        console.print()
        console.print(_noise_table(name, result[name]))
    suggestion = result["suggestion"]
    if suggestion is not None:
        dwell = f"Suggested dwell for the next north-seek {suggestion['dwell_s']:.3g} s"
        console.print(Text(f"\n{dwell}", style="bold"))
        console.print(suggestion["reason"])
    console.print()
    console.print(checks_table(result))


def _attitude(result: Result) -> Table:
    table = plain_table("table")
    table.add_column("value", justify="right")
    table.add_column("2 sigma")
    table.add_column("")
    sigma_deg = result.get("level_sigma_deg")
    for name in ("pitch", "roll"):
        value_deg = result[f"{name}_deg"]
        if sigma_deg:
            add_value(table, name, value_deg, sigma_deg, "deg")
        else:
            table.add_row(name, f"{value_deg:.4f}", "", "deg")
    return table


def _noise_headline(gyro: Result) -> str:
    figure = gyro["angle_random_walk_deg_sqrt_h"]
    if figure["value"] is None:
        return "Angle random walk not seen"
    return f"Angle random walk {figure['value']:.3g} deg/sqrt(h)"


def _noise_table(name: str, sensor: Result) -> Table:
    table = plain_table(f"{name}, axis {sensor['axis']}")
    table.add_column("value", justify="right")
    table.add_column("95 % interval")
    table.add_column("")
    for figure in sensor["figures"]:
        seen = figure["value"] is not None
        value = f"{figure['value']:.3g}" if seen else "not seen"
        between = f"{figure['lower']:.3g} to {figure['upper']:.3g}"
        below = f"below {figure['upper']:.2g}"
        table.add_row(figure["name"], value, between if seen else below, figure["unit"])
    drift = sensor["drift"]
    if drift["seen"]:
        add_value(table, "drift", drift["value"], drift["sigma"], drift["unit"])
    return table


_PRINTERS = {
    "north-seek": print_north_seek,
    "alignment": _print_alignment,
    "heading-hold": _print_heading_hold,
    "noise": _print_noise,
}
