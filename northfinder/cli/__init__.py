"""The command line. Exit codes: 0 done, 1 the run failed, 2 bad usage, 130 interrupted."""

import sys

import click
from click.exceptions import NoArgsIsHelpError

from drivers.errors import DriverError
from northfinder.cli.attitude import align, hold, noise_command
from northfinder.cli.bench import bench
from northfinder.cli.campaign import campaign
from northfinder.cli.runs import runs
from northfinder.cli.seek import plan_command, seek
from northfinder.cli.serve import serve
from northfinder.cli.simulate import sim
from northfinder.cli.study import study
from northfinder.errors import ConfigError, NorthfinderError
from northfinder.formatting import sentence_of
from northfinder.software import version


@click.group(
    context_settings={
        "help_option_names": ["-h", "--help"],
        "show_default": True,
        "max_content_width": 100,
    }
)
@click.version_option(version(), prog_name="northfinder")
def cli() -> None:
    """Find true north with a gyro and an accelerometer on an indexing turntable."""


_COMMANDS = (
    seek,
    plan_command,
    align,
    hold,
    noise_command,
    serve,
    sim,
    study,
    runs,
    bench,
    campaign,
)
for command in _COMMANDS:
    cli.add_command(command)


def main() -> None:
    """Run a command; every error is one line on stderr, and never a traceback."""
    try:
        cli(prog_name="northfinder", standalone_mode=False)
    except NoArgsIsHelpError as asked:
        asked.show()
        sys.exit(2)
    except click.UsageError as error:
        command_path = error.ctx.command_path if error.ctx else "northfinder"
        said = " ".join(error.format_message().split())
        _leave(2, f"{said} See {command_path} --help.")
    except (click.Abort, KeyboardInterrupt):
        _leave(130, "interrupted; a table that was turning is stopped")
    except ConfigError as error:
        _leave(2, sentence_of(error))
    except (NorthfinderError, DriverError) as error:
        _leave(1, sentence_of(error))
    except OSError as error:  # a full disk, a pipe whose reader has gone
        _leave(1, f"the operating system refused to go on: {error.strerror}")
    except Exception as error:  # the last resort: technicians are owed a sentence
        if sys.flags.dev_mode:
            raise
        what = f"{type(error).__name__}: {sentence_of(error)}"
        _leave(1, f"a defect of northfinder, please report it: {what} (python -X dev shows where)")


def _leave(code: int, sentence: str) -> None:
    click.echo(f"northfinder: {sentence}", err=True)
    sys.exit(code)
