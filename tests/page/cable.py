"""A network cable between a page and its service, to be pulled."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from urllib.parse import urlsplit

_CHUNK_BYTES = 65_536


class Cable:
    """Passes bytes on to a service while it is whole; ``address`` is its near end."""

    def __init__(self, service_address: str) -> None:
        self._far = urlsplit(service_address)
        self._loop = asyncio.new_event_loop()
        self._server = self._loop.run_until_complete(self._listen())
        self._ends: set[asyncio.StreamWriter] = set()
        self._whole = asyncio.Event()
        self._whole.set()
        self._refuses = False
        host, port = self._server.sockets[0].getsockname()
        self.address = f"http://{host}:{port}"

    @property
    def loop(self) -> asyncio.AbstractEventLoop:
        """Return the loop that passes the bytes, to be run in a thread of its own."""
        return self._loop

    def cut(self) -> None:
        """Break every connection, and refuse new ones: the network's switch was turned off."""
        self._loop.call_soon_threadsafe(self._break)

    def hold(self) -> None:
        """Let no byte through and tell nobody: the wireless network is out of reach."""
        self._loop.call_soon_threadsafe(self._whole.clear)

    def mend(self) -> None:
        """Let bytes pass again, those held back first."""
        self._loop.call_soon_threadsafe(self._join)

    def _break(self) -> None:
        self._refuses = True
        for end in self._ends:
            end.transport.abort()

    def _join(self) -> None:
        self._refuses = False
        self._whole.set()

    async def _listen(self) -> asyncio.Server:
        return await asyncio.start_server(self._connect, "127.0.0.1", 0)

    async def _connect(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._refuses:
            writer.transport.abort()
            return
        far_reader, far_writer = await asyncio.open_connection(self._far.hostname, self._far.port)
        ends = {writer, far_writer}
        self._ends |= ends
        await asyncio.gather(self._pass(reader, far_writer), self._pass(far_reader, writer))
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
    thread = threading.Thread(target=cable.loop.run_forever, name="cable")
    thread.start()
    try:
        yield cable
    finally:
        cable.cut()
        cable.loop.call_soon_threadsafe(cable.loop.stop)
        thread.join()
        cable.loop.close()
