"""A Dask cluster as a pool of workers; the package is an extra, imported when one is asked for."""

from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from importlib import import_module
from typing import Any
from urllib.parse import urlsplit

from northfinder.campaign.errors import CampaignError
from northfinder.errors import ConfigError
from northfinder.formatting import sentence_of

_ANSWER_S = 10.0
_SCHEMES = {"tcp", "tls", "ws", "wss"}


@contextmanager
def dask_cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """Connect to a scheduler; yields its workers as a pool, and how many threads they have.

    Args:
        address: Such as ``tcp://10.0.0.5:8786``.

    Raises:
        ConfigError: Dask is not installed, or the address is none.
        CampaignError: Nobody answers, no worker is there, or the cluster gave up on the way.
    """
    distributed = _distributed(address)
    with _connected(distributed, address) as client:
        threads = sum(client.nthreads().values())
        if threads == 0:
            msg = f"the Dask scheduler at {address} has no workers: start some with 'dask worker'"
            raise CampaignError(msg)
        try:
            yield client.get_executor(), threads
        except (distributed.KilledWorker, distributed.CancelledError, CancelledError) as error:
            msg = f"the Dask cluster at {address} gave up: {sentence_of(error)}"
            raise CampaignError(msg) from error
        except ImportError as error:
            msg = (
                f"the Dask workers at {address} cannot import what they need "
                f"({sentence_of(error)}): install this northfinder there too"
            )
            raise CampaignError(msg) from error


def _distributed(address: str) -> Any:  # noqa: ANN401 (most of it is not typed)
    try:
        return import_module("distributed")
    except ImportError as error:
        msg = f"--dask {address}: Dask is not installed; pip install 'northfinder[campaign]'"
        raise ConfigError(msg) from error


def _connected(distributed: Any, address: str) -> Any:  # noqa: ANN401 (the same)
    _check_address(address)
    try:
        return distributed.Client(address, timeout=_ANSWER_S, set_as_default=False)
    except OSError as error:  # a TimeoutError is one
        msg = f"no Dask scheduler answers at {address} within {_ANSWER_S:g} s"
        raise CampaignError(msg) from error


def _check_address(address: str) -> None:
    """Refuse what is no address: the client would only say so half a minute later."""
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        understood = parts.scheme in _SCHEMES and parts.hostname and parts.port
    except ValueError:  # a port that is no number, or beyond 65535
        understood = False
    if not understood:
        msg = f"--dask {address}: this is no scheduler's address; write it as tcp://HOST:8786"
        raise ConfigError(msg)
