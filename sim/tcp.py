"""A simulated device behind a TCP port: the same bytes for any client, on any platform."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from sim.interfaces import SimulatedDevice

_BACKLOG_BYTES = 1 << 20  # of a client that stopped reading; the rest is overrun, as on a port
_READ_BYTES = 1 << 16


@asynccontextmanager
async def serve_on_tcp(device: SimulatedDevice) -> AsyncIterator[str]:
    """Serve a device on a free port of the loopback interface; yields its pyserial URL.

    One client at a time has the device, the last that came, as a serial port has one wire.
    """
    socket = _Socket(device)
    server = await asyncio.start_server(socket.serve, "127.0.0.1", 0)
    device.connect(socket.send)
    host, port = server.sockets[0].getsockname()
    try:
        yield f"socket://{host}:{port}"
    finally:
        server.close()
        socket.hang_up()
        await server.wait_closed()


class _Socket:
    """The wire: whatever the device sends goes to the client of the moment, or nowhere."""

    def __init__(self, device: SimulatedDevice) -> None:
        self._device = device
        self._writer: asyncio.StreamWriter | None = None

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.hang_up()
        self._writer = writer
        try:
            while data := await reader.read(_READ_BYTES):
                self._device.receive_data(data)
        except OSError:
            pass  # a client that was killed says no good-bye
        finally:
            writer.close()
            if self._writer is writer:
                self._writer = None

    def send(self, data: bytes) -> None:
        writer = self._writer
        if writer is not None and writer.transport.get_write_buffer_size() < _BACKLOG_BYTES:
            writer.write(data)

    def hang_up(self) -> None:
        if self._writer is not None:
            self._writer.transport.abort()  # closing would wait for a client that reads nothing
            self._writer = None
