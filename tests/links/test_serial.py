"""Serial ports by real pseudo-terminals and sockets: bytes, deadlines, sentences for failures."""

import asyncio
import contextlib
import os
import socket
import sys
import threading
import time
from collections.abc import Coroutine, Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.errors import LinkTimeoutError, TransportError
from drivers.links.serial import SerialLink

pty_only = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


class Pty:
    """A pseudo-terminal: the test plays the instrument at the far end."""

    far_fd: int
    path: str
    _near_fd: int

    def __init__(self) -> None:
        if sys.platform != "win32":
            self.far_fd, self._near_fd = os.openpty()  # noqa: TID251 - only where there are ptys
            self.path = os.ttyname(self._near_fd)
            os.set_blocking(self.far_fd, False)

    def send(self, data: bytes) -> None:
        os.write(self.far_fd, data)

    def received(self) -> bytes:
        return os.read(self.far_fd, 4096)

    def close(self) -> None:
        """Go away as a USB converter does that is pulled."""
        if self.far_fd >= 0:
            os.close(self.far_fd)
            os.close(self._near_fd)
            self.far_fd = -1


@pytest.fixture
def pty() -> Iterator[Pty]:
    with contextlib.closing(Pty()) as pty:
        yield pty


def run(session: Coroutine[Any, Any, None]) -> None:
    """Run to the end, after which no thread may be left."""
    asyncio.run(session)
    assert [thread for thread in threading.enumerate() if thread.name.startswith("reader")] == []


async def read_exactly(link: SerialLink, count: int) -> bytes:
    data = b""
    while len(data) < count:
        data += (await link.read(2.0)).data
    return data


@pty_only
def test_bytes_pass_both_ways_unchanged(pty: Pty) -> None:
    async def session() -> None:
        link = SerialLink(pty.path, 115_200)
        await link.open()
        every_byte = bytes(range(256))
        await link.write(every_byte)
        assert pty.received() == every_byte
        pty.send(every_byte)
        assert await read_exactly(link, 256) == every_byte
        await link.close()

    run(session())


@pty_only
def test_a_chunk_bears_the_loop_time_of_its_arrival(pty: Pty) -> None:
    async def session() -> None:
        link = SerialLink(pty.path, 115_200)
        await link.open()
        sent_s = asyncio.get_running_loop().time()
        pty.send(b"now")
        chunk = await link.read(2.0)
        assert sent_s <= chunk.arrival_s <= asyncio.get_running_loop().time()
        await link.close()

    run(session())


@pty_only
def test_a_silent_port_fails_the_read_at_its_deadline(pty: Pty) -> None:
    async def session() -> None:
        link = SerialLink(pty.path, 115_200)
        await link.open()
        began_s = time.monotonic()
        with pytest.raises(LinkTimeoutError, match=rf"{pty.path} was silent for 0\.05 s"):
            await link.read(0.05)
        assert 0.05 <= time.monotonic() - began_s < 1.0
        await link.close()

    run(session())


@pty_only
def test_bytes_from_before_opening_again_are_gone_and_the_line_speed_is_kept(pty: Pty) -> None:
    async def session() -> None:
        link = SerialLink(pty.path, 9600)
        link.set_baudrate(115_200)
        await link.open()
        link.set_baudrate(921_600)
        pty.send(b"stale")
        await link.open()
        pty.send(b"fresh")
        assert await read_exactly(link, 5) == b"fresh"
        await link.close()

    run(session())


@pty_only
def test_a_port_is_opened_by_one_program_alone(pty: Pty) -> None:
    async def session() -> None:
        holder, other = SerialLink(pty.path, 9600), SerialLink(pty.path, 9600)
        await holder.open()
        sentence = f"{pty.path}: another program holds the port; close that program"
        with pytest.raises(TransportError, match=sentence):
            await other.open()
        await holder.close()
        await other.open()
        await other.close()

    run(session())


@pty_only
def test_a_port_that_goes_away_fails_the_pending_read_and_every_later_call(pty: Pty) -> None:
    async def session() -> None:
        link = SerialLink(pty.path, 9600)
        await link.open()
        reading = asyncio.create_task(link.read(60.0))
        await asyncio.sleep(0.05)
        pty.close()
        sentence = rf"{pty.path}: the port failed \(.*\); check cable, power and address"
        with pytest.raises(TransportError, match=sentence):
            await reading
        with pytest.raises(TransportError, match=sentence):
            await link.read(1.0)
        with pytest.raises(TransportError, match=sentence):
            await link.write(b"?")
        with pytest.raises(TransportError, match=sentence):
            link.set_baudrate(115_200)
        with pytest.raises(TransportError, match=pty.path):
            await link.open()
        await link.close()

    run(session())


@pty_only
def test_a_port_that_came_back_is_opened_again_by_its_lasting_name(
    pty: Pty, tmp_path: Path
) -> None:
    by_id = tmp_path / "usb-gyro"  # as udev makes them in /dev/serial/by-id
    by_id.symlink_to(pty.path)
    link = SerialLink(str(by_id), 9600)

    async def session(successor: Pty) -> None:
        await link.open()
        pty.close()
        with pytest.raises(TransportError):
            await link.read(2.0)
        by_id.unlink()
        by_id.symlink_to(successor.path)
        await link.open()
        successor.send(b"back")
        assert await read_exactly(link, 4) == b"back"
        await link.close()

    with contextlib.closing(Pty()) as successor:
        run(session(successor))


def test_closing_twice_or_before_opening_is_harmless_and_a_closed_link_says_so() -> None:
    async def session() -> None:
        link = SerialLink("loop://", 9600)
        await link.close()
        await link.open()
        await link.close()
        await link.close()
        with pytest.raises(TransportError, match="loop:// is not open"):
            await link.read(1.0)
        with pytest.raises(TransportError, match="loop:// is not open"):
            await link.write(b"?")

    run(session())


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        pytest.param(
            "/dev/ttyAbsent", "there is no such port; check the cable. Ports present: ", id="absent"
        ),
        pytest.param(
            os.devnull,
            "that is not a serial port; check the link in the configuration",
            id="no port",
            marks=pty_only,
        ),
        pytest.param(
            "pigeon://post",
            "invalid URL, protocol 'pigeon' not known; check the link in the configuration",
            id="unknown scheme",
        ),
        pytest.param(
            "socket://127.0.0.1:1",
            "nothing listens there; start the server or check the address",
            id="refused",
        ),
        pytest.param("socket://127.0.0.1", "check cable, power and address", id="no TCP port"),
    ],
)
def test_a_port_that_cannot_be_opened_is_named_with_the_reason_and_the_way_out(
    url: str, sentence: str
) -> None:
    async def session() -> None:
        with pytest.raises(TransportError) as failure:
            await SerialLink(url, 9600).open()
        message = str(failure.value)
        assert message.startswith(f"{url}: ")
        assert sentence in message

    run(session())


def test_a_line_speed_that_no_port_has_is_refused_before_and_while_it_is_open() -> None:
    async def session() -> None:
        with pytest.raises(TransportError, match="baudrate: 0; check the link"):
            await SerialLink("loop://", 0).open()
        link = SerialLink("loop://", 9600)
        await link.open()
        with pytest.raises(TransportError, match="baudrate: 0; check the link"):
            link.set_baudrate(0)
        await link.close()

    run(session())


def test_pyserials_loopback_returns_what_was_written() -> None:
    async def session() -> None:
        link = SerialLink("loop://", 115_200)
        await link.open()
        await link.write(b"echo")
        assert await read_exactly(link, 4) == b"echo"
        await link.close()

    run(session())


def test_a_serial_server_is_reached_by_its_socket_and_its_end_is_told() -> None:
    async def session() -> None:
        with socket.create_server(("127.0.0.1", 0)) as server:
            port = server.getsockname()[1]
            link = SerialLink(f"socket://127.0.0.1:{port}", 9600)
            await link.open()
            client, _ = server.accept()
            with client:
                await link.write(b"hello")
                assert client.recv(16) == b"hello"
                client.sendall(b"world")
                assert await read_exactly(link, 5) == b"world"
            with pytest.raises(TransportError, match="socket disconnected"):
                await link.read(2.0)
        ticking = asyncio.create_task(asyncio.sleep(0.01))
        closing = asyncio.create_task(link.close())
        await ticking
        assert not closing.done()  # pyserial's 0.3 s must not hold the loop up
        await closing

    run(session())
