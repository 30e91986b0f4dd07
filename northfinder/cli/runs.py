"""``northfinder runs``: the records."""

import json

import click
from rich.console import Console
from rich.table import Table

from northfinder.cli.display import print_result
from northfinder.cli.options import database_option, database_url
from northfinder.config import RigConfig
from northfinder.formatting import with_uncertainty
from northfinder.recording import recompute as recompute_run
from northfinder.records import Records, Run

json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else.")


@click.group()
def runs() -> None:
    """List, show and recompute recorded runs."""


@runs.command("list")
@database_option
@click.option("--limit", type=click.IntRange(1, 10_000), default=20, help="How many, newest first.")
@json_option
def list_runs(database: str | None, limit: int, *, as_json: bool) -> None:
    """List the newest runs."""
    with Records.open(database_url(database, RigConfig())) as store:
        found = store.runs(limit=limit)
    if as_json:
        click.echo(json.dumps([_summary(run) for run in found]))
        return
    table = Table(box=None, pad_edge=False, header_style="dim")
    for column in ("run", "kind", "rig", "state", "azimuth deg (2 sigma)"):
        table.add_column(column)
    for run in found:
        table.add_row(run.id, run.kind, run.rig_name, run.state, _azimuth(run))
    Console().print(table)


@runs.command()
@click.argument("run_id")
@database_option
@json_option
def show(run_id: str, database: str | None, *, as_json: bool) -> None:
    """Show one run; the beginning of its id is enough."""
    with Records.open(database_url(database, RigConfig())) as store:
        run = store.run(run_id)
        visits = len(store.visits(run.id))
    if as_json:
        click.echo(json.dumps(run.result or {**_summary(run), "visits_completed": visits}))
    elif run.result is None:
        click.echo(f"run {run.id} is {run.state}, {visits} visits completed")
        if run.error:
            click.echo(run.error)
    else:
        print_result(Console(), run.result)


@runs.command()
@click.argument("run_id")
@database_option
@json_option
def recompute(run_id: str, database: str | None, *, as_json: bool) -> None:
    """Compute a run's result again from its stored samples, and compare."""
    with Records.open(database_url(database, RigConfig())) as store:
        run = store.run(run_id)
        result = recompute_run(store, run.id)
    if as_json:
        click.echo(json.dumps(result))
        return
    print_result(Console(), result)
    if run.result is None:
        click.echo(f"the run is {run.state} and has no result to compare with")
    else:
        same = run.result == result
        click.echo("identical to the recorded result" if same else "DIFFERS from the record")


def _summary(run: Run) -> dict[str, object]:
    return {
        "run_id": run.id,
        "kind": run.kind,
        "rig": run.rig_name,
        "state": run.state,
        "created": run.created_utc.isoformat(),
        "azimuth_deg": run.result and run.result["azimuth_deg"],
        "azimuth_sigma_deg": run.result and run.result["azimuth_sigma_deg"],
        "error": run.error,
    }


def _azimuth(run: Run) -> str:
    if run.result is None:
        return "-"
    return with_uncertainty(run.result["azimuth_deg"], 2 * run.result["azimuth_sigma_deg"])
