"""``northfinder bench``: what this machine does, against what is promised."""

import sys
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from northfinder.formatting import sentence_of
from northfinder.proof.campaigns import (
    campaign_dask,
    campaign_speed,
    coverage_by_noise,
    order_sigmas,
)
from northfinder.proof.can_load import can_load
from northfinder.proof.coloured_noise import coloured_noise
from northfinder.proof.document_evidence import write_figures
from northfinder.proof.fault_report import faults
from northfinder.proof.figure import Figure, readable
from northfinder.proof.fuzz import fuzz
from northfinder.proof.measurements import harmonic_fit, kvh_decoding, whole_seek
from northfinder.proof.peers import peers
from northfinder.proof.serial_load import serial_load
from northfinder.proof.service_load import service_load
from northfinder.proof.slow_faults import slow_faults
from northfinder.proof.statistics import coverage, cramer_rao, linear_drift, solver_agreement
from northfinder.proof.target_stop import target_stop
from northfinder.proof.utilisation import utilisation

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
    "peers": peers,
    "fuzz": fuzz,
    "faults": faults,
    "slow-faults": slow_faults,
    "coverage-by-noise": coverage_by_noise,
    "coloured-noise": coloured_noise,
    "order-sigmas": order_sigmas,
    "campaign-speed": campaign_speed,
    "campaign-dask": campaign_dask,
    "target-stop": target_stop,
    "utilisation": utilisation,
}


@click.command()
@click.argument("name", required=False, type=click.Choice(list(MEASUREMENTS)))
@click.option("--require", is_flag=True, help="Exit with 1 where a figure is not met.")
@click.option(
    "--json",
    "file",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write the figures there too.",
)
def bench(name: str | None, file: Path | None, *, require: bool) -> None:
    """Measure this machine: one of the measurements, or all of them (about half an hour)."""
    measured: dict[str, list[Figure]] = {}
    failed = False
    for each in [name] if name else MEASUREMENTS:
        try:
            measured[each] = list(MEASUREMENTS[each]())
        except Exception as error:  # the other measurements are worth having all the same
            if name or sys.flags.dev_mode:
                raise
            click.echo(f"northfinder: {each} came to no figure: {sentence_of(error)}", err=True)
            failed = True
        if file:
            write_figures(file, measured)  # after each: what comes next may take many minutes
    figures = [figure for some in measured.values() for figure in some]
    Console().print(_table(figures))
    if failed or (require and not all(figure.met for figure in figures)):
        sys.exit(1)


def _table(figures: list[Figure]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("figure")
    table.add_column("measured", justify="right")
    table.add_column("required", justify="right")
    table.add_column("")
    if any(figure.limit for figure in figures):
        table.add_column("limit")
    for figure in figures:
        verdict = Text("met", style="green") if figure.met else Text("NOT MET", style="bold red")
        measured = f"{readable(figure.value)} {figure.unit}".strip()
        cells = (figure.name, measured, figure.required, verdict)
        table.add_row(*cells, *([figure.limit] if figure.limit else []))
    return table
