"""``northfinder bench``: measurements of this machine."""

import click


@click.command()
def bench() -> None:
    """Measure."""
