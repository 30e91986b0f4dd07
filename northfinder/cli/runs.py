"""``northfinder runs``: the records."""

import asyncio
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

from northfinder.cli.display import plain_table, table_console
from northfinder.cli.options import (
    AS_FAST_AS_IT_GOES,
    database_option,
    database_url,
    json_option,
    records_options,
    rig_options,
)
from northfinder.cli.progress import LiveProgress
from northfinder.cli.results import print_result, show_result
from northfinder.config import RigConfig
from northfinder.errors import NorthfinderError
from northfinder.formatting import azimuth_with_uncertainty
from northfinder.recording import resume as resume_run
from northfinder.records import Records, Run, RunSummary, Writer
from northfinder.records.export import file_name, samples_csv, samples_parquet, visits_csv
from northfinder.replay import estimates_of
from northfinder.replay import recompute as recompute_run
from northfinder.report.certificate import certificate
from northfinder.wiring import build_rig, event_loop

_output_option = click.option(
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="By default named after the run, here; - is stdout.",
)


@click.group()
def runs() -> None:
    """List, show, export, certify, recompute and resume recorded runs."""


@runs.command("list", short_help="List the newest runs.")
@records_options
@click.option("--limit", type=click.IntRange(1, 10_000), default=20, help="How many, newest first.")
@json_option
def list_runs(url: str, limit: int, *, as_json: bool) -> None:
    """List the newest runs, of every rig that shares the records."""
    with Records.open(url) as store:
        found = store.page(limit).runs
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
    show_result(result, as_json=as_json)
    if run.result is None:
        _say(f"the run is {run.state} and has no result to compare with", as_json=as_json)
    elif run.result == result:
        _say("identical to the recorded result", as_json=as_json)
    else:
        recorder = run.software.get("version", "another version")
        msg = f"the result differs from the one that northfinder {recorder} recorded for {run.id}"
        raise NorthfinderError(msg)


#: What can be exported, by suffix of the file: the part's name and how it is written.
_EXPORTS: dict[str, tuple[str, Callable[[Records, str], Iterable[bytes]]]] = {
    "csv": ("samples", samples_csv),
    "parquet": ("samples", samples_parquet),
    "visits": ("visits", visits_csv),
    "json": ("result", lambda store, run_id: iter([_result_json(store.run(run_id))])),
}


@runs.command(short_help="Write samples, visits or result to a file.")
@click.argument("run_id")
@click.option(
    "--format",
    "kind",
    type=click.Choice(list(_EXPORTS)),
    default="csv",
    help="Raw samples as csv or parquet, visits as csv, the result as json.",
)
@_output_option
@records_options
def export(run_id: str, kind: str, output: Path | None, url: str) -> None:
    """Write a run's raw samples, visits or result to a file."""
    part, write = _EXPORTS[kind]
    with Records.open(url) as store:
        run = store.run(run_id)
        suffix = "csv" if kind == "visits" else kind
        _write(output or Path(file_name(run, part, suffix)), write(store, run.id))


@runs.command(short_help="Write a run's certificate.")
@click.argument("run_id")
@_output_option
@records_options
def report(run_id: str, output: Path | None, url: str) -> None:
    """Write a run's certificate: one HTML file, complete in itself, to print or to keep."""
    with Records.open(url) as store:
        run = store.run(run_id)
        estimates = estimates_of(store, run.id)
        page = certificate(run, store.visits(run.id), estimates, store.samples_sha256(run.id))
    _write(output or Path(file_name(run, "certificate", "html")), iter([page.encode()]))


@runs.command(short_help="Carry a stopped run on.")
@click.argument("run_id")
@rig_options
@database_option
@json_option
def resume(run_id: str, config: RigConfig, database: str | None, *, as_json: bool) -> None:
    """Carry a failed or interrupted run on, in a new segment, once nothing proves to have moved."""
    with asyncio.Runner(loop_factory=event_loop(config, AS_FAST_AS_IT_GOES)) as runner:
        result = runner.run(_resume(run_id, config, database_url(database, config)))
    show_result(result, as_json=as_json)


async def _resume(run_id: str, config: RigConfig, url: str) -> dict[str, Any]:
    with Records.open(url) as store, LiveProgress() as progress:
        run = store.run(run_id)
        async with Writer(store) as writer, build_rig(config) as rig:
            await writer.interrupt_abandoned(rig.name)
            revived = await resume_run(rig, store, run, writer, progress.show)
            return await revived.carry_out()


def _result_json(run: Run) -> bytes:
    if run.result is None:
        msg = f"run {run.id} is {run.state} and has no result; export its samples or its visits"
        raise NorthfinderError(msg)
    return json.dumps(run.result, indent=2).encode() + b"\n"


def _write(path: Path, pieces: Iterable[bytes]) -> None:
    to_stdout = str(path) == "-"
    with click.open_file(str(path), "wb") as file:
        file.writelines(pieces)
    if not to_stdout:
        click.echo(f"written to {path}")


def _say(sentence: str, *, as_json: bool) -> None:
    if not as_json:
        click.echo(sentence)


def _summary(run: RunSummary) -> dict[str, object]:
    headline = run.headline or {}
    return {
        "run_id": run.id,
        "kind": run.kind,
        "rig_name": run.rig_name,
        "state": run.state,
        "created": run.created_utc.isoformat(),
        "azimuth_deg": headline.get("azimuth_deg"),
        "azimuth_sigma_deg": headline.get("azimuth_sigma_deg"),
        "error": run.error,
    }


def _azimuth(run: RunSummary) -> str:
    headline = run.headline
    if headline is None or headline["azimuth_deg"] is None:
        return headline.get("figure") or "-" if headline else "-"
    return azimuth_with_uncertainty(headline["azimuth_deg"], 2 * headline["azimuth_sigma_deg"])
