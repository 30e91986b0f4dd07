"""A pseudo-terminal carries a device's bytes unchanged, and forgets what nobody reads."""

import asyncio
import sys
from collections.abc import Callable

import pytest
from serial import Serial

from sim.pty import serve_on_pty

EVERY_BYTE = bytes(range(256))
posix = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")


class Echo:
    """Sends back what it hears."""

    send: Callable[[bytes], None]

    def connect(self, send: Callable[[bytes], None]) -> None:
        self.send = send

    def receive_data(self, data: bytes) -> None:
        self.send(data)

    async def run(self) -> None:
        """Do nothing of its own accord."""


async def everything(port: Serial) -> bytes:
    """Read until nothing has come for a while."""
    received, silence = b"", 0
    while silence < 10:
        await asyncio.sleep(0.005)
        piece = port.read(1 << 16)
        received += piece
        silence = 0 if piece else silence + 1
    return received


@posix
def test_every_byte_passes_both_ways_unchanged() -> None:
    async def run() -> bytes:
        async with serve_on_pty(Echo()) as path:
            with Serial(path, timeout=0) as port:
                port.write(EVERY_BYTE)
                return await everything(port)

    assert asyncio.run(run()) == EVERY_BYTE


@posix
def test_a_burst_larger_than_the_kernels_queue_arrives_whole_once_it_is_read() -> None:
    burst = EVERY_BYTE * 4 * 70  # 70 kB at once

    async def run() -> bytes:
        device = Echo()
        async with serve_on_pty(device) as path:
            with Serial(path, timeout=0) as port:
                device.send(burst)
                return await everything(port)

    assert asyncio.run(run()) == burst


@posix
def test_a_stream_that_nobody_reads_is_bounded_and_whoever_comes_finds_it_going_on() -> None:
    async def run() -> bytes:
        device = Echo()
        async with serve_on_pty(device) as path:
            for count in range(60_000):
                device.send(b"%08d" % count)
            with Serial(path, timeout=0) as port:
                device.send(b"here and now")
                return await everything(port)

    received = asyncio.run(run())
    assert len(received) < 120_000
    assert received.endswith(b"here and now")


def test_where_there_are_no_pseudo_terminals_it_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def run() -> None:
        async with serve_on_pty(Echo()):
            pass

    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(OSError, match="over TCP instead"):
        asyncio.run(run())
