"""A simulated device on a pseudo-terminal, for clients that open a serial port (POSIX only).

As on any port, a client that flushes its side just after connecting (``tcflush``) may discard a
command it has just sent, or an answer; it has to ask again.
"""

import asyncio
import contextlib
import os
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from functools import partial
from typing import NamedTuple

from sim.interfaces import Terminal

if sys.platform != "win32":
    import termios  # noqa: TID251 (this module is where ptys live)
    import tty  # noqa: TID251 (this module is where ptys live)

_READ_BYTES = 4096
_BACKLOG_BYTES = 1 << 14  # beyond the kernel's own tens of kilobytes


@contextlib.asynccontextmanager
async def serve_on_pty(device: Terminal) -> AsyncIterator[str]:
    """Put a device at the far end of a pseudo-terminal; whoever made it runs it.

    Yields:
        The path that a client opens as a serial port: ``/dev/pts/3``.

    Raises:
        OSError: This system has no pseudo-terminals, or none left.
    """
    with _open_raw() as pair, contextlib.closing(_PtyPort(pair, device)) as port:
        device.connect(port.send)
        try:
            yield pair.path
        finally:
            device.connect(_discard)


class _PtyPair(NamedTuple):
    """The device's end, the path of the client's, and what empties the queue between them."""

    far_fd: int
    path: str
    flush: Callable[[], None]


@contextlib.contextmanager
def _open_raw() -> Iterator[_PtyPair]:
    """Open both ends in raw mode; the near end is kept open, or reading the far one would fail."""
    if sys.platform == "win32":
        msg = "Windows has no pseudo-terminals; serve the simulated instruments over TCP instead"
        raise OSError(msg)
    else:  # mypy passes over a branch, but not over what follows a raise
        far_fd, near_fd = os.openpty()  # noqa: TID251 (this module is where ptys live)
        try:
            tty.setraw(far_fd)
            tty.setraw(near_fd)
            os.set_blocking(far_fd, False)
            flush = partial(termios.tcflush, near_fd, termios.TCIFLUSH)
            yield _PtyPair(far_fd, os.ttyname(near_fd), flush)
        finally:
            os.close(near_fd)
            os.close(far_fd)


class _PtyPort:
    """The device's end: bytes to and from it, on the running loop."""

    def __init__(self, pair: _PtyPair, device: Terminal) -> None:
        self._pair = pair
        self._device = device
        self._backlog = bytearray()
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(pair.far_fd, self._receive)

    def close(self) -> None:
        """Stop listening to the client, and waiting for it to read."""
        self._loop.remove_reader(self._pair.far_fd)
        self._loop.remove_writer(self._pair.far_fd)

    def send(self, data: bytes) -> None:
        """Write at once what the kernel takes, and the rest when it takes more."""
        waiting = bool(self._backlog)
        self._backlog += data
        if not waiting:
            self._write()
            if self._backlog:
                self._loop.add_writer(self._pair.far_fd, self._drain)
        elif len(self._backlog) > _BACKLOG_BYTES:
            self._overrun()

    def _receive(self) -> None:
        self._device.receive_data(os.read(self._pair.far_fd, _READ_BYTES))

    def _drain(self) -> None:
        self._write()
        if not self._backlog:
            self._loop.remove_writer(self._pair.far_fd)

    def _write(self) -> None:
        with contextlib.suppress(BlockingIOError):  # full: the loop says when it is not
            del self._backlog[: os.write(self._pair.far_fd, self._backlog)]

    def _overrun(self) -> None:
        """Nobody reads: throw all away as a port does, so that whoever comes finds fresh bytes."""
        self._backlog.clear()
        self._pair.flush()


def _discard(_: bytes) -> None:
    """Take the bytes of a device that is no longer served."""
