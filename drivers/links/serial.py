"""Serial ports, and whatever else pyserial opens by URL: ``socket://``, ``rfc2217://``, ``spy://``.

One reader thread per port hands bytes to the event loop in bursts of about ten milliseconds, as
USB converters do anyway: at 1 kHz a hand-over per sample would cost a fifth of a core.
"""

import asyncio
import errno
import sys
import threading
from contextlib import suppress

import serial
from serial.tools import list_ports

from drivers.errors import TransportError
from drivers.interfaces import Chunk
from drivers.links.inbox import Inbox

if sys.platform == "win32":
    _PORT_ERRORS: tuple[type[Exception], ...] = (OSError,)
else:
    import termios  # noqa: TID251 - its error is no OSError, and pyserial lets it through

    _PORT_ERRORS = (OSError, termios.error)
_SETTING_ERRORS: tuple[type[Exception], ...] = (*_PORT_ERRORS, ValueError)

_BURST_S = 0.01
_BURST_BYTES = 1 << 16  # a read without waiting returns what is there, at the most this
_WRITE_TIMEOUT_S = 1.0

_BUSY = "another program holds the port; close that program"
_REMEDIES = {
    errno.EACCES: "no permission, or another program holds it (on Linux: join the group dialout)",
    errno.EAGAIN: _BUSY,
    errno.EBUSY: _BUSY,
    errno.ENOTTY: "that is not a serial port; check the link in the configuration",
    errno.ECONNREFUSED: "nothing listens there; start the server or check the address",
}
#: On Windows pyserial keeps the system's error as text only.
_WINDOWS_ERRORS = {"FileNotFoundError": errno.ENOENT, "PermissionError": errno.EACCES}


class SerialLink:
    """A byte stream over a serial port, 8N1, no flow control, opened for this process alone.

    Args:
        url: A port (``/dev/ttyUSB0``, ``COM3``) or a pyserial URL (``socket://host:port``).
        baudrate: Line speed; ignored where there is no line.
    """

    def __init__(self, url: str, baudrate: int) -> None:
        self._url = url
        self._baudrate = baudrate
        self._port: serial.SerialBase | None = None
        self._inbox = Inbox(url)
        self._reader: threading.Thread | None = None
        self._closing = threading.Event()

    @property
    def name(self) -> str:
        """Return the port or URL."""
        return self._url

    async def open(self) -> None:
        """Open the port, or open it again; bytes of before are gone."""
        await self.close()
        loop = asyncio.get_running_loop()
        self._inbox = Inbox(self._url)
        self._closing = threading.Event()
        self._port = await loop.run_in_executor(None, self._open_port)
        self._reader = threading.Thread(
            target=self._read_for_ever,
            args=(self._port, self._inbox, self._closing, loop),
            name=f"reader of {self._url}",
            daemon=True,
        )
        self._reader.start()

    async def close(self) -> None:
        """Close the port and join its reader."""
        port, reader = self._port, self._reader
        self._port = self._reader = None
        self._closing.set()
        if port is not None and reader is not None:
            await asyncio.get_running_loop().run_in_executor(None, _release, port, reader)

    async def write(self, data: bytes) -> None:
        """Send bytes; commands are far smaller than the kernel's buffer, so this does not wait."""
        try:
            self._opened().write(data)
        except _PORT_ERRORS as error:
            raise self._failure(error) from error

    async def read(self, timeout_s: float) -> Chunk:
        """Return everything that the reader thread has handed over."""
        self._opened()
        return await self._inbox.get(timeout_s)

    def set_baudrate(self, baudrate: int) -> None:
        """Change the line speed, now and for every later open.

        Raises:
            TransportError: The port is gone or cannot be that fast.
        """
        self._baudrate = baudrate
        if self._port is not None:
            try:
                self._port.baudrate = baudrate
            except _SETTING_ERRORS as error:
                raise self._failure(error) from error

    def _opened(self) -> serial.SerialBase:
        if self._port is None:
            msg = f"{self._url} is not open"
            raise TransportError(msg)
        return self._port

    def _open_port(self) -> serial.SerialBase:
        try:
            port = serial.serial_for_url(
                self._url,
                baudrate=self._baudrate,
                timeout=0,
                write_timeout=_WRITE_TIMEOUT_S,
                exclusive=True,
            )
        except _SETTING_ERRORS as error:
            raise self._failure(error) from error
        return port

    def _read_for_ever(
        self,
        port: serial.SerialBase,
        inbox: Inbox,
        closing: threading.Event,
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        while not closing.wait(_BURST_S):
            try:
                data = port.read(_BURST_BYTES)
            except _PORT_ERRORS as error:
                loop.call_soon_threadsafe(inbox.fail, self._failure(error))
                return
            if data:
                loop.call_soon_threadsafe(inbox.put, data, loop.time())

    def _failure(self, error: Exception) -> TransportError:
        return TransportError(f"{self._url}: {_reason(error)}")


def _release(port: serial.SerialBase, reader: threading.Thread) -> None:
    """Join the reader and close its port; pyserial takes 0.3 s to close a socket."""
    reader.join()
    with suppress(*_PORT_ERRORS):  # a port that is gone cannot be closed either
        port.close()


def _reason(error: Exception) -> str:
    """Say what is wrong with the port and what to do, for what the operating system said."""
    number = _error_number(error)
    if number == errno.ENOENT:
        present = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
        return f"there is no such port; check the cable. Ports present: {present}"
    if number in _REMEDIES:
        return _REMEDIES[number]
    if isinstance(error, ValueError):
        return f"{error}; check the link in the configuration"
    return f"the port failed ({error}); check cable, power and address"


def _error_number(error: Exception) -> int | None:
    """Find the system's error number: pyserial's own, of what it was raised for, or named."""
    for candidate in (error, error.__context__):
        if isinstance(candidate, _PORT_ERRORS):
            number = next(iter(candidate.args), None)
            if isinstance(number, int):
                return number
    named = (number for name, number in _WINDOWS_ERRORS.items() if name in str(error))
    return next(named, None)
