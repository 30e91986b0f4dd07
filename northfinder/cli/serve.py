"""``northfinder serve``: the service and its page."""

import os

import click

from northfinder.cli.options import database_option, database_url, rig_options
from northfinder.config import RigConfig
from northfinder.service.settings import service_settings


@click.command(short_help="Serve the rig: page and REST.")
@rig_options
@click.option("--host", default="127.0.0.1", help="Address to listen at.")
@click.option("--port", type=click.IntRange(0, 65535), default=8000, help="0 takes a free one.")
@click.option(
    "--allowed-host",
    "allowed_hosts",
    multiple=True,
    metavar="NAME",
    help="A name by which the service is called, besides localhost; repeatable.",
)
@database_option
def serve(
    config: RigConfig, host: str, port: int, allowed_hosts: tuple[str, ...], database: str | None
) -> None:
    """Serve the rig: a page for people at /, REST for programs at /api/v1, /docs tells more.

    Without --config it is the simulated rig, at 20 times real time. Anything but loopback needs
    a token in NORTHFINDER_TOKEN and its name in --allowed-host.
    """
    from northfinder.cli.serving import serve_until_told  # noqa: PLC0415 -- fastapi: 0.5 s

    token = os.environ.get("NORTHFINDER_TOKEN")
    url = database_url(database, config)
    settings = service_settings(host, port, token, allowed_hosts, url)
    serve_until_told(config, settings)
