"""The kernel's bus as others see it: can-utils, `ip`, and what the kernel lists."""

import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

CHANNEL = "vcan0"
SOON_S = 2.0
#: linux/can/error.h: an error frame, class bus-off.
BUS_OFF = "20000040#0000000000000000"
#: The same, a controller that has had a hundred errors: no reason to give up.
ERROR_WARNING = "20000004#0004000000000000"

RECEIVED = Path(f"/sys/class/net/{CHANNEL}/statistics/rx_packets")


def ip_link(state: str) -> None:
    """Switch the interface on or off."""
    ip = shutil.which("ip") or "/usr/sbin/ip"
    subprocess.run([ip, "link", "set", CHANNEL, state], check=True)


def cansend(frame: str) -> None:
    """Send one frame as another program."""
    subprocess.run(["cansend", CHANNEL, frame], check=True)  # noqa: S607 -- wherever it is


def wait_until(
    holds: Callable[[], object], timeout_s: float = SOON_S, pause_s: float = 0.005
) -> None:
    """Wait for what no event tells."""
    deadline_s = time.monotonic() + timeout_s
    while not holds():
        assert time.monotonic() < deadline_s
        time.sleep(pause_s)


@contextmanager
def candump(*options: str) -> Iterator[IO[str]]:
    """Look on as candump does, at all or (``vcan0,120:7FF``) at some; yields its log's lines."""
    shown = () if any(one.startswith(CHANNEL) for one in options) else (CHANNEL,)
    before = _receivers()
    command = ["candump", "-L", *options, *shown]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as looking:
        try:
            wait_until(lambda: _receivers() > before)  # it has subscribed
            assert looking.stdout is not None
            yield looking.stdout
        finally:
            looking.kill()


def received() -> int:
    """Return how many frames the kernel has counted on the bus."""
    return int(RECEIVED.read_text())


def kernel_filters() -> dict[tuple[str, str], int]:
    """Return how many frames each (identifier, mask) has let through, as the kernel lists them."""
    rows = [row.split() for row in _lists("fil")]
    return {(row[1], row[2]): int(row[-2]) for row in rows}


def _receivers() -> int:
    """Return how many filters are in place, those that let everything through included."""
    return len(_lists("*"))


def _lists(kind: str) -> list[str]:
    lists = Path("/proc/net/can").glob(f"rcvlist_{kind}")
    rows = [row for one in lists for row in one.read_text().splitlines()]
    return [row for row in rows if row.split()[:1] == [CHANNEL]]
