"""``northfinder runs``: the records."""

import json

import click

from northfinder.cli.display import plain_table, print_result, table_console
from northfinder.cli.options import json_option, records_options
from northfinder.errors import NorthfinderError
from northfinder.formatting import azimuth_with_uncertainty
from northfinder.recording import recompute as recompute_run
from northfinder.records import Records, Run


@click.group()
def runs() -> None:
    """List, show and recompute recorded runs."""


@runs.command("list", short_help="List the newest runs.")
@records_options
@click.option("--limit", type=click.IntRange(1, 10_000), default=20, help="How many, newest first.")
@json_option
def list_runs(url: str, limit: int, *, as_json: bool) -> None:
    """List the newest runs."""
    with Records.open(url) as store:
        found = store.runs(limit=limit)
    if as_json:
        click.echo(json.dumps([_summary(run) for run in found]))
        return
    if not found:
        click.echo("nothing has been recorded yet")
        return
    table = plain_table("run", "kind", "rig", "state", "azimuth deg (2 sigma)")
    for run in found:
        table.add_row(run.id, run.kind, run.rig_name, run.state, _azimuth(run))
    table_console().print(table)


@runs.command(short_help="Show one run.")
@click.argument("run_id")
@records_options
@json_option
def show(run_id: str, url: str, *, as_json: bool) -> None:
    """Show one run; the beginning of its id is enough."""
    with Records.open(url) as store:
        run = store.run(run_id)
        visits = len(store.visits(run.id))
    if as_json:
        click.echo(json.dumps(run.result or {**_summary(run), "visits_completed": visits}))
    elif run.result is None:
        click.echo(f"run {run.id} is {run.state}, {visits} visits completed")
        if run.error:
            click.echo(run.error)
    else:
        print_result(table_console(), run.result)


@runs.command(short_help="Compute a result again from the stored samples.")
@click.argument("run_id")
@records_options
@json_option
def recompute(run_id: str, url: str, *, as_json: bool) -> None:
    """Compute a run's result again from its stored samples, and compare.

    Exits with 1 where the new result differs from the recorded one.
    """
    with Records.open(url) as store:
        run = store.run(run_id)
        result = recompute_run(store, run.id)
    if as_json:
        click.echo(json.dumps(result))
    else:
        print_result(table_console(), result)
    if run.result is None:
        _say(f"the run is {run.state} and has no result to compare with", as_json=as_json)
    elif run.result == result:
        _say("identical to the recorded result", as_json=as_json)
    else:
        recorder = run.software.get("version", "another version")
        msg = f"the result differs from the one that northfinder {recorder} recorded for {run.id}"
        raise NorthfinderError(msg)


def _say(sentence: str, *, as_json: bool) -> None:
    if not as_json:
        click.echo(sentence)


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
    return azimuth_with_uncertainty(run.result["azimuth_deg"], 2 * run.result["azimuth_sigma_deg"])
