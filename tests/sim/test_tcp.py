"""A simulated device behind a TCP port serves whoever came last, and outlives every client."""

import asyncio
import contextlib
import socket
import struct
from collections.abc import Awaitable, Callable
from typing import NamedTuple
from urllib.parse import urlsplit

import pytest

from sim.tcp import serve_on_tcp

MEGABYTE = 1 << 20


class Echo:
    """Answers every byte with itself in upper case."""

    def __init__(self) -> None:
        self.send: Callable[[bytes], None]

    def connect(self, send: Callable[[bytes], None]) -> None:
        self.send = send

    def receive_data(self, data: bytes) -> None:
        self.send(data.upper())

    async def run(self) -> None:
        """It lives by what it hears."""


class Client(NamedTuple):
    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter

    async def ask(self, question: bytes) -> bytes:
        self.writer.write(question)
        async with asyncio.timeout(5.0):
            return await self.reader.readexactly(len(question))

    async def hung_up(self) -> bool:
        """Wait for the end of the connection."""
        try:
            async with asyncio.timeout(5.0):
                await self.reader.read()
        except ConnectionError:
            pass
        self.writer.close()
        return True

    def kill(self) -> None:
        """Vanish without a good-bye: the connection is reset."""
        raw = self.writer.get_extra_info("socket")
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.writer.transport.abort()


async def connect(url: str) -> Client:
    parts = urlsplit(url)
    assert (parts.scheme, parts.hostname) == ("socket", "127.0.0.1")
    return Client(*await asyncio.open_connection(parts.hostname, parts.port))


def serving(scenario: Callable[[str, Echo], Awaitable[None]]) -> None:
    """Serve an echo and fail on whatever the loop would merely log."""
    complaints: list[dict[str, object]] = []

    async def session() -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: complaints.append(context))
        echo = Echo()
        async with asyncio.timeout(20.0), serve_on_tcp(echo) as url:
            await scenario(url, echo)

    asyncio.run(session())
    assert complaints == []


def test_a_client_talks_to_the_device_and_may_come_again() -> None:
    async def scenario(url: str, _: Echo) -> None:
        for _visit in range(2):
            client = await connect(url)
            assert await client.ask(b"hello") == b"HELLO"
            client.writer.close()
            await client.writer.wait_closed()

    serving(scenario)


def test_what_the_device_sends_without_a_client_is_lost() -> None:
    async def scenario(url: str, echo: Echo) -> None:
        echo.send(b"nobody hears")
        client = await connect(url)
        assert await client.ask(b"now") == b"NOW"
        client.writer.close()

    serving(scenario)


def test_a_second_client_takes_the_device_over() -> None:
    async def scenario(url: str, _: Echo) -> None:
        first = await connect(url)
        assert await first.ask(b"first") == b"FIRST"
        second = await connect(url)
        assert await second.ask(b"second") == b"SECOND"
        assert await first.hung_up()
        assert await second.ask(b"still") == b"STILL"
        second.writer.close()

    serving(scenario)


def test_a_killed_client_is_harmless() -> None:
    async def scenario(url: str, echo: Echo) -> None:
        killed = await connect(url)
        assert await killed.ask(b"alive") == b"ALIVE"
        killed.kill()
        for _ in range(20):
            echo.send(b"to whom?")
            await asyncio.sleep(0)
        heir = await connect(url)
        assert await heir.ask(b"heir") == b"HEIR"
        heir.writer.close()

    serving(scenario)


def test_what_a_client_does_not_read_is_overrun_and_does_not_hold_the_end_up() -> None:
    async def flood(echo: Echo) -> None:
        for _ in range(64):
            echo.send(bytes(MEGABYTE))
            await asyncio.sleep(0)

    def drain(client: socket.socket) -> int:
        """Read until nothing comes any more."""
        total = 0
        with contextlib.suppress(TimeoutError):
            while data := client.recv(MEGABYTE):
                total += len(data)
        return total

    async def scenario(url: str, echo: Echo) -> None:
        client, address = stack.enter_context(socket.socket()), urlsplit(url)
        client.settimeout(0.3)
        client.connect((address.hostname, address.port))
        client.sendall(b"here")
        assert await asyncio.to_thread(client.recv, 4) == b"HERE"
        await flood(echo)
        assert await asyncio.to_thread(drain, client) < 32 * MEGABYTE
        await flood(echo)

    with contextlib.ExitStack() as stack:
        serving(scenario)


def test_the_port_is_closed_with_the_device() -> None:
    async def scenario(url: str, _: Echo) -> None:
        urls.append(url)
        client = await connect(url)
        assert await client.ask(b"hello") == b"HELLO"
        client.writer.close()

    urls: list[str] = []
    serving(scenario)
    with pytest.raises(ConnectionRefusedError):
        asyncio.run(connect(urls[0]))
