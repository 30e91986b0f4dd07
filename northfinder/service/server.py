"""The HTTP server: it says where it listens, and at its end the table stops first."""

import asyncio
import errno
import logging
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Awaitable, Callable
from typing import NoReturn

import uvicorn
from starlette.types import ASGIApp

from northfinder.errors import ConfigError, NorthfinderError
from northfinder.service.patience import ImpatientProtocol

_LOG = logging.getLogger(__name__)

#: Together below the 3 s after which a service that was told to end is expected to be gone.
_BENCH_STOPS_S = 1.5
_STREAMS_END_S = 1
_THREADS_END_S = 0.2
_INTERRUPTED = 130


class Server(uvicorn.Server):
    """Uvicorn, but for its end: the table stops first, then the streams, then the rest.

    An application's own shutdown comes too late for that: after every open stream has ended.

    Args:
        config: Uvicorn's.
        stop_bench: Stops the table and what runs on it.
        end_streams: Ends the endless answers.
    """

    def __init__(
        self,
        config: uvicorn.Config,
        stop_bench: Callable[[], Awaitable[None]],
        end_streams: Callable[[], None],
    ) -> None:
        super().__init__(config)
        self._stop_bench = stop_bench
        self._end_streams = end_streams

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, then say where."""
        await super().startup(sockets)
        for listening in sockets or []:
            _LOG.info("the page is at %s (Ctrl-C ends the service)", url_of(listening))

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop the table, end the streams, then do what uvicorn does; everything in bounded time.

        A second Ctrl-C leaves out everything after the streams: the process ends there.
        """
        try:
            async with asyncio.timeout(_BENCH_STOPS_S):
                await self._stop_bench()
        except TimeoutError:
            _LOG.error(
                "the table has not confirmed within %s s that it stopped: look at it, and switch "
                "it off if it turns",
                _BENCH_STOPS_S,
            )
        except Exception:  # noqa: BLE001 - the rest has to end all the same
            _LOG.exception("the table could not be stopped: look at it, and switch it off")
        self._end_streams()
        await super().shutdown(sockets)
        if self.force_exit:
            _end_now(_INTERRUPTED)


def run(
    app: ASGIApp,
    sockets: list[socket.socket],
    stop_bench: Callable[[], Awaitable[None]],
    end_streams: Callable[[], None],
) -> None:
    """Serve until SIGTERM or Ctrl-C.

    Args:
        app: The application.
        sockets: Where to listen (`listen`).
        stop_bench: Stops the table and what runs on it; awaited first when the end has come.
        end_streams: Ends the endless answers, second.

    Raises:
        KeyboardInterrupt: It was Ctrl-C; everything is stopped.
        NorthfinderError: The application could not be started; the log says why.
    """
    config = uvicorn.Config(
        app,
        http=ImpatientProtocol,
        ws="none",
        lifespan="on",
        log_config=None,  # `logs` has set it up
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=_STREAMS_END_S,
    )
    server = Server(config, stop_bench, end_streams)
    # Uvicorn raises the signal again when all is done, for whoever handled it before: nobody, but
    # the default would then kill the process, and an orderly end is no failure.
    before = signal.signal(signal.SIGTERM, server.handle_exit)
    try:
        server.run(sockets)
    except SystemExit:  # uvicorn's way to say that the lifespan's beginning failed
        msg = "the service could not be started; the log says why"
        raise NorthfinderError(msg) from None
    finally:
        signal.signal(signal.SIGTERM, before)


def leave(code: int) -> NoReturn:
    """End the process, without waiting for threads that still work on answers nobody gets.

    A route that waits for a database does so in a thread that nothing can cancel, and Python
    would wait for it. Called last, when the records are closed and the table is stopped.

    Args:
        code: The exit code.
    """
    deadline_s = time.monotonic() + _THREADS_END_S
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join(max(0.0, deadline_s - time.monotonic()))
            if thread.is_alive():
                _end_now(code)
    sys.exit(code)


def _end_now(code: int) -> NoReturn:
    logging.shutdown()
    sys.stdout.flush()
    os._exit(code)


def listen(host: str, port: int) -> list[socket.socket]:
    """Open the sockets to listen at, before anything is moved: one for each address of the host.

    Args:
        host: An address of this computer, or a name of one.
        port: The port; 0 takes any that is free.

    Raises:
        ConfigError: The port is in use or not allowed, or the address is not this computer's.
    """
    sockets: list[socket.socket] = []
    try:
        for family, address in _addresses(host, port):
            taken = sockets[0].getsockname()[1] if sockets else port
            opened = socket.create_server((address, taken), family=family, backlog=2048)
            # Inherited by every connection: asyncio does so for sockets of its own making only,
            # and without it each answer would wait 40 ms for the acknowledgement of the last.
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sockets.append(opened)
    except OSError as error:
        for listening in sockets:
            listening.close()
        raise ConfigError(_why_not(error, host, port)) from error
    return sockets


def _addresses(host: str, port: int) -> list[tuple[socket.AddressFamily, str]]:
    name = host.strip("[]")
    found = socket.getaddrinfo(name, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    return list(dict.fromkeys((family, str(address[0])) for family, *_, address in found))


def _why_not(error: OSError, host: str, port: int) -> str:
    if isinstance(error, socket.gaierror):
        return f"--host {host} is no address of this computer: {error.strerror}"
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} of {host} is in use, perhaps by another northfinder: end that one, or "
            "choose another port with --port"
        )
    if error.errno == errno.EACCES:
        return f"port {port} needs more rights than this user has: choose one above 1023 (--port)"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"--host {host} is no address of this computer: name one of its own, or 127.0.0.1"
    return f"nothing can listen at port {port} of {host}: {error.strerror}"


def url_of(listening: socket.socket) -> str:
    """Return the address for a browser."""
    host, port = listening.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
