"""The command line. Exit codes: 0 done, 1 the run failed, 2 bad usage, 130 interrupted."""

import sys

import click

from drivers.errors import DriverError
from northfinder.cli.bench import bench
from northfinder.cli.runs import runs
from northfinder.cli.seek import plan_command, seek
from northfinder.cli.simulate import sim
from northfinder.errors import ConfigError, NorthfinderError
from northfinder.software import version


@click.group(context_settings={"help_option_names": ["-h", "--help"], "show_default": True})
@click.version_option(version(), prog_name="northfinder")
def cli() -> None:
    """Find true north with a gyro and an accelerometer on an indexing turntable."""


for command in (seek, plan_command, sim, runs, bench):
    cli.add_command(command)


def main() -> None:
    """Run a command; every expected error is one line on stderr."""
    try:
        cli(standalone_mode=False)
    except click.exceptions.Exit as leave:
        sys.exit(leave.exit_code)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        _say("interrupted; the table is stopped")
        sys.exit(130)
    except ConfigError as error:
        _say(str(error))
        sys.exit(2)
    except (NorthfinderError, DriverError) as error:
        _say(" ".join([str(error), *getattr(error, "__notes__", [])]))
        sys.exit(1)


def _say(sentence: str) -> None:
    click.echo(f"northfinder: {sentence}", err=True)
