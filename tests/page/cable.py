"""A network cable between a page and its service, to be pulled."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from urllib.parse import urlsplit

_CHUNK_BYTES = 65_536


class Cable:
    """Passes bytes on to a service while it is whole; lives in a loop of its own.

    Attributes:
        address: Its near end.
    """

    def __init__(self, service_address: str) -> None:
        self.address = ""
        self._far = urlsplit(service_address)
        self._ends: set[asyncio.StreamWriter] = set()
        self._passing: set[asyncio.Task[None]] = set()
        self._refuses = False

    async def lie(self, is_laid: threading.Event) -> None:
        """Listen and pass bytes until :meth:`remove`."""
        self._loop = asyncio.get_running_loop()
        self._whole = asyncio.Event()
        self._whole.set()
        self._removed = asyncio.Event()
        server = await asyncio.start_server(self._connect, "127.0.0.1", 0)
        host, port = server.sockets[0].getsockname()
        self.address = f"http://{host}:{port}"
        is_laid.set()
        async with server:
            await self._removed.wait()
            self._whole.set()
            self._break()
            await asyncio.gather(*self._passing)

    def cut(self) -> None:
        """Break every connection, and refuse new ones: the network's switch was turned off."""
        self._loop.call_soon_threadsafe(self._break)

    def hold(self) -> None:
        """Let no byte through and tell nobody: the wireless network is out of reach."""
        self._loop.call_soon_threadsafe(self._whole.clear)

    def mend(self) -> None:
        """Let bytes pass again, those held back first."""
        self._loop.call_soon_threadsafe(self._join)

    def remove(self) -> None:
        """End."""
        self._loop.call_soon_threadsafe(self._removed.set)

    def _break(self) -> None:
        self._refuses = True
        for end in self._ends:
            end.transport.abort()

    def _join(self) -> None:
        self._refuses = False
        self._whole.set()

    async def _connect(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._refuses:
            writer.transport.abort()
            return
        far_reader, far_writer = await asyncio.open_connection(self._far.hostname, self._far.port)
        ends = {writer, far_writer}
        self._ends |= ends
        ways = {
            asyncio.create_task(self._pass(reader, far_writer)),
            asyncio.create_task(self._pass(far_reader, writer)),
        }
        self._passing |= ways
        await asyncio.wait(ways)
        self._passing -= ways
        self._ends -= ends

    async def _pass(self, source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
        with suppress(ConnectionError):
            while data := await source.read(_CHUNK_BYTES):
                await self._whole.wait()
                sink.write(data)
                await sink.drain()
        sink.close()


@contextmanager
def cable_to(service_address: str) -> Iterator[Cable]:
    """Lay a cable to a service until the context ends."""
    cable = Cable(service_address)
    is_laid = threading.Event()
    # A thread of its own: the browser's loop runs in this one.
    thread = threading.Thread(target=lambda: asyncio.run(cable.lie(is_laid)), name="cable")
    thread.start()
    assert is_laid.wait(10.0)
    try:
        yield cable
    finally:
        cable.remove()
        thread.join()
