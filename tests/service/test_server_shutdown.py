"""The end of the service: the table first, then the streams, and all of it soon."""

import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest

from northfinder.errors import ConfigError
from northfinder.service.server import listen

_PROMISED_S = 3.0


class Service:
    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        assert process.stderr is not None
        address = re.search(r"http://[^ ]+", process.stderr.readline())
        assert address is not None
        self.address = urlsplit(address[0])

    def open(self, path: str) -> socket.socket:
        """Send a request and leave its answer in the socket."""
        client = socket.create_connection((self.address.hostname, self.address.port))
        client.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        return client

    def end(self, by: signal.Signals) -> tuple[int, str, str]:
        """Send a signal; return the exit code and what the process still said."""
        self.process.send_signal(by)
        told_s = time.monotonic()
        said, logged = self.process.communicate(timeout=30.0)
        assert time.monotonic() - told_s < _PROMISED_S
        return self.process.returncode, said, logged


@contextmanager
def service(streams: str) -> Iterator[Service]:
    command = [sys.executable, "-m", "tests.service.shell_app", "0", streams]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield Service(process)
        finally:
            process.kill()


def read_until(client: socket.socket, what: bytes) -> None:
    client.settimeout(10.0)
    received = b""
    while what not in received:
        received += client.recv(4096)


@pytest.mark.parametrize(("by", "code"), [(signal.SIGTERM, 0), (signal.SIGINT, 130)])
def test_the_table_stops_before_the_streams_end(by: signal.Signals, code: int) -> None:
    with service("ends-streams") as served, served.open("/stream") as client:
        read_until(client, b'data: {"number": 3}')
        returncode, said, logged = served.end(by)
    assert returncode == code
    assert said.splitlines() == ["the table has stopped", "the streams are told to end"]
    assert "Traceback" not in logged


def test_neither_a_stubborn_stream_nor_a_slow_route_holds_up_the_end() -> None:
    with (
        service("keeps-streams") as served,
        served.open("/slow"),
        served.open("/stream") as stubborn,
    ):
        read_until(stubborn, b"data:")
        returncode, said, logged = served.end(signal.SIGTERM)
    assert returncode == 0
    assert said.startswith("the table has stopped")
    assert "Traceback" not in logged


def test_a_second_ctrl_c_waits_for_nobody() -> None:
    with service("keeps-streams") as served, served.open("/stream") as stubborn:
        read_until(stubborn, b"data:")
        served.process.send_signal(signal.SIGINT)
        assert served.process.stdout is not None
        served.process.stdout.readline()  # the table has stopped
        returncode, _, logged = served.end(signal.SIGINT)
    assert returncode == 130
    assert "timeout graceful shutdown exceeded" not in logged
    assert "Traceback" not in logged


def test_a_port_in_use_is_a_sentence() -> None:
    (taken,) = listen("127.0.0.1", 0)
    port = taken.getsockname()[1]
    with taken, pytest.raises(ConfigError, match=f"port {port} .* is in use.*--port"):
        listen("127.0.0.1", port)


def test_an_address_of_another_computer_is_a_sentence() -> None:
    with pytest.raises(ConfigError, match=r"192\.0\.2\.1 is no address of this computer"):
        listen("192.0.2.1", 0)  # RFC 5737: nobody's
