"""The process of the service, from its sockets to its exit code."""

from typing import NoReturn

import click

from northfinder.config import RigConfig
from northfinder.records import Records
from northfinder.service.app import create_app, end_streams, stop_bench
from northfinder.service.logs import set_up_logs
from northfinder.service.memory import set_the_start_apart
from northfinder.service.server import leave, listen, run, url_of
from northfinder.service.settings import ServiceSettings


def serve_until_told(config: RigConfig, settings: ServiceSettings) -> NoReturn:
    """Serve until SIGTERM (exit code 0) or Ctrl-C (130).

    Raises:
        ConfigError: The rig, the address or the records' URL cannot be used.
        RecordsError: The records cannot be opened.
    """
    set_up_logs()
    sockets = listen(settings.host, settings.port)
    try:
        with Records.open(settings.database_url) as records:
            app = create_app(config, settings, records)
            set_the_start_apart()
            for listening in sockets:
                click.echo(f"northfinder is at {url_of(listening)}")
            run(app, sockets, lambda: stop_bench(app), lambda: end_streams(app))
    except KeyboardInterrupt:
        leave(130)
    leave(0)
