"""A simulated device behind a TCP port: the same bytes for any client, on any platform."""

import asyncio
from asyncio import BaseTransport, Protocol, Transport
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import cast

from sim.interfaces import Terminal

_BACKLOG_BYTES = 1 << 20  # of a client that stopped reading; the rest is overrun, as on a port


@asynccontextmanager
async def serve_on_tcp(device: Terminal) -> AsyncIterator[str]:
    """Serve a device on a free port of the loopback interface; yields its pyserial URL.

    One client at a time has the device, the last that came, as a serial port has one wire.
    """
    socket = _Socket()
    device.connect(socket.send)
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: _Connection(device, socket), "127.0.0.1", 0)
    host, port = server.sockets[0].getsockname()
    try:
        yield f"socket://{host}:{port}"
    finally:
        server.close()
        socket.hang_up()
        await server.wait_closed()


class _Socket:
    """What the wire is plugged into: the device's bytes go to the client of the moment."""

    def __init__(self) -> None:
        self._client: Transport | None = None

    def plug_in(self, client: Transport) -> None:
        self.hang_up()
        self._client = client

    def hang_up(self) -> None:
        if self._client is not None:
            self._client.abort()  # closing would wait for a client that reads nothing
            self._client = None

    def send(self, data: bytes) -> None:
        client = self._client
        if client is None or client.is_closing():
            return
        if client.get_write_buffer_size() < _BACKLOG_BYTES:
            client.write(data)


class _Connection(Protocol):
    def __init__(self, device: Terminal, socket: _Socket) -> None:
        self._device = device
        self._socket = socket

    def connection_made(self, transport: BaseTransport) -> None:
        self._socket.plug_in(cast("Transport", transport))

    def data_received(self, data: bytes) -> None:
        self._device.receive_data(data)
