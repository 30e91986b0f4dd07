"""``northfinder study``: a paper's claims, the printed figure beside ours."""

import json
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from northfinder.cli.display import plain_table, table_console
from northfinder.cli.options import json_option
from northfinder.studies.registry import NAMES, run_study
from northfinder.studies.study import Study, Table

_STYLES = {
    "reproduced": "green",
    "not reproduced": "bold red",
    "misprint": "yellow",
    "beyond the paper": "cyan",
}


@click.command(
    short_help="Work a paper through: its figures beside ours.",
    epilog=f"NAME is one of {', '.join(NAMES)}.",
)
@click.argument("name", metavar="NAME", type=click.Choice(list(NAMES)))
@json_option
@click.option(
    "--figures",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Write the figures as SVG and all of it as one HTML page.",
)
def study(name: str, figures: Path | None, *, as_json: bool) -> None:
    """Work a paper through: every claim measured, the printed figure beside ours, a verdict each.

    Everything is computed anew, in a few seconds.
    """
    found = run_study(name)
    files = [] if figures is None else _write(found, figures)
    if as_json:
        from northfinder.studies.study_json import study_json  # noqa: PLC0415 (see below)

        click.echo(json.dumps(study_json(found)))
        return
    _print(table_console(), found)
    for file in files:
        click.echo(f"wrote {file}")


def _write(study: Study, folder: Path) -> list[Path]:
    """Write figures and page; drawing is imported for this alone."""
    from northfinder.studies.drawing import draw  # noqa: PLC0415 (the other commands start sooner)
    from northfinder.studies.page import study_page  # noqa: PLC0415 (the same)

    folder.mkdir(parents=True, exist_ok=True)
    texts = {folder / f"{study.name}-{chart.name}.svg": draw(chart) for chart in study.charts}
    texts[folder / f"{study.name}.html"] = study_page(study)
    for file, text in texts.items():
        file.write_text(text, encoding="utf-8")
    return list(texts)


def _print(console: Console, study: Study) -> None:
    console.print(Text(study.title, style="bold"))
    console.print(Text(study.paper, style="dim"))
    console.print(f"\n{study.summary}\n")
    console.print(_claims(study))
    console.print(f"\nMeasured with {study.conditions}.\n")
    console.print(_reasons(study))
    for table in study.tables:
        console.print(Text(f"\n{table.title}", style="bold"))
        console.print(_rows(table))


def _claims(study: Study) -> RichTable:
    table = plain_table("")
    table.add_column("where", max_width=12)
    table.add_column("claim", ratio=1)
    table.add_column("printed", justify="right", no_wrap=True)
    table.add_column("ours", justify="right", no_wrap=True)
    table.add_column("verdict", width=10)
    for number, claim in enumerate(study.claims, 1):
        verdict = Text(claim.verdict.value, style=_STYLES[claim.verdict.value])
        printed = "" if claim.printed is None else str(claim.printed)
        table.add_row(str(number), claim.where, claim.says, printed, str(claim.ours), verdict)
    return table


def _reasons(study: Study) -> RichTable:
    """What stands behind each number: too long for a column of the table above."""
    grid = RichTable.grid(padding=(0, 1))
    for number, claim in enumerate(study.claims, 1):
        under = f"({claim.conditions}) " if claim.conditions else ""
        grid.add_row(str(number), Text.assemble((under, "dim"), claim.reason))
    return grid


def _rows(table: Table) -> RichTable:
    drawn = plain_table(table.columns[0])
    for column in table.columns[1:]:
        drawn.add_column(column, justify="right")
    for row in table.rows:
        drawn.add_row(*("" if cell is None else str(cell) for cell in row))
    return drawn
