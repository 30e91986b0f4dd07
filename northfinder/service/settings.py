"""Where the service listens, for whom, and where its records are."""

import ipaddress
import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from northfinder.errors import ConfigError

LOOPBACK_NAMES = ("localhost", "127.0.0.1", "[::1]")
_TOKEN_CHARACTERS = 16
_NAME = re.compile(r"[a-z0-9]([a-z0-9.-]*[a-z0-9])?|\[[0-9a-f:.]+\]")


@dataclass(frozen=True, slots=True)
class ServiceSettings:
    """What the service is started with.

    Attributes:
        host: The address to listen at.
        port: The port to listen at; 0 takes any that is free.
        token: What a client must know, or None on a computer whose users are all trusted.
        allowed_hosts: The names by which the service may be called, in lower case.
        database_url: Where the records are.
    """

    host: str
    port: int
    token: str | None = field(repr=False)
    allowed_hosts: tuple[str, ...]
    database_url: str


def service_settings(
    host: str, port: int, token: str | None, allowed_hosts: Iterable[str], database_url: str
) -> ServiceSettings:
    """Check what the command line and the environment say of the service.

    Args:
        host: The address to listen at.
        port: The port to listen at.
        token: The environment's NORTHFINDER_TOKEN; an empty one counts as none.
        allowed_hosts: The names of --allowed-host.
        database_url: Where the records are.

    Raises:
        ConfigError: The service would be open to the network, or a name or the token is unusable.
    """
    names = tuple(_checked_name(name) for name in allowed_hosts)
    _check_token(token or None)
    if not is_loopback(host):
        _refuse_an_open_door(host, token or None, names)
    return ServiceSettings(
        host=host,
        port=port,
        token=token or None,
        allowed_hosts=tuple(dict.fromkeys((*LOOPBACK_NAMES, *names))),
        database_url=database_url,
    )


def is_loopback(host: str) -> bool:
    """Say whether an address to listen at is reached from this computer only."""
    try:
        return host == "localhost" or ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def _refuse_an_open_door(host: str, token: str | None, names: tuple[str, ...]) -> None:
    if token is None:
        msg = (
            f"--host {host} opens the service to the network: set NORTHFINDER_TOKEN to a secret "
            f"of at least {_TOKEN_CHARACTERS} characters, or leave out --host"
        )
        raise ConfigError(msg)
    if not names:
        msg = (
            f"--host {host} opens the service to the network: name it with --allowed-host, as it "
            "will be called in a browser's address line (such as bench-3.lab or 192.168.1.20)"
        )
        raise ConfigError(msg)


def _check_token(token: str | None) -> None:
    if token is None:
        return
    if len(token) < _TOKEN_CHARACTERS:
        msg = (
            f"NORTHFINDER_TOKEN has {len(token)} characters, at least {_TOKEN_CHARACTERS} are "
            "needed: take what `python -c 'import secrets; print(secrets.token_urlsafe())'` prints"
        )
        raise ConfigError(msg)
    if not (token.isascii() and token.isprintable() and " " not in token):
        msg = "NORTHFINDER_TOKEN has a space or a character that a header cannot carry: use ASCII"
        raise ConfigError(msg)


def _checked_name(name: str) -> str:
    lowered = name.lower()
    if not _NAME.fullmatch(lowered):
        msg = (
            f"--allowed-host {name!r} is no host's name: give the name or address alone, without "
            "scheme, port or wildcard, an IPv6 address in brackets"
        )
        raise ConfigError(msg)
    return lowered
