"""``northfinder bench``: what this machine does, against what is promised."""

import sys

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from northfinder.proof.can_load import can_load
from northfinder.proof.figure import Figure
from northfinder.proof.measurements import harmonic_fit, kvh_decoding, whole_seek
from northfinder.proof.serial_load import serial_load
from northfinder.proof.service_load import service_load
from northfinder.proof.statistics import coverage, cramer_rao, linear_drift, solver_agreement

MEASUREMENTS = {
    "solver-agreement": solver_agreement,
    "cramer-rao": cramer_rao,
    "coverage": coverage,
    "linear-drift": linear_drift,
    "kvh-decoding": kvh_decoding,
    "harmonic-fit": harmonic_fit,
    "whole-seek": whole_seek,
    "serial-load": serial_load,
    "can-load": can_load,
    "service-load": service_load,
}


@click.command()
@click.argument("name", required=False, type=click.Choice(list(MEASUREMENTS)))
@click.option("--require", is_flag=True, help="Exit with 1 where a figure is not met.")
def bench(name: str | None, *, require: bool) -> None:
    """Measure this machine: one of the measurements, or all of them (about six minutes)."""
    chosen = [MEASUREMENTS[name]] if name else list(MEASUREMENTS.values())
    figures = [figure for measure in chosen for figure in measure()]
    Console().print(_table(figures))
    if require and not all(figure.met for figure in figures):
        sys.exit(1)


def _table(figures: list[Figure]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("figure")
    table.add_column("measured", justify="right")
    table.add_column("required", justify="right")
    table.add_column("")
    for figure in figures:
        verdict = Text("met", style="green") if figure.met else Text("NOT MET", style="bold red")
        measured = f"{figure.value:,.4g}" if figure.value < 1e4 else f"{figure.value:,.0f}"
        table.add_row(figure.name, f"{measured} {figure.unit}".strip(), figure.required, verdict)
    return table
