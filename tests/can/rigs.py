"""Rigs on the kernel's bus: instruments and client as processes that share nothing but the bus."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from northfinder.records import Records
from northfinder.records.states import ENDED
from tests.can.onlookers import CHANNEL, cansend, wait_until

_ROOT = Path(__file__).parents[2]
_PROGRAM = (sys.executable, "-m", "northfinder")
#: The gyro's noise, in the simulation and in the client's predictions alike.
NOISE_DEG_SQRT_H = 1e-4
_START_S, _RUN_S = 20.0, 60.0
_PAUSE_S = 0.1  # looking into the records is work, and a guest kernel has one processor for all
_HOMING = {(0x6099, 1): 180, (0x6099, 2): 180, (0x609A, 0): 720}  # deg/s, deg/s^2
_MOVES = {(0x6081, 0): 360, (0x6083, 0): 720}
_UNITS_PER_DEG = 10_000


@dataclass(frozen=True)
class Rig:
    """A configuration for both ends, with a folder for the records."""

    config: Path
    table_node: int

    @property
    def database(self) -> str:
        """Return the records' URL."""
        return f"sqlite:///{self.config.with_suffix('.db').as_posix()}"

    def run(self) -> tuple[str, str, int]:
        """Return state, error and number of visits of the only run; "" before there is one."""
        with Records.open(self.database) as store:
            for run in store.page(2).runs:
                found = store.run(run.id)
                return run.state, found.error or "", len(store.visits(run.id))
        return "", "", 0

    def wait_for_visits(self, count: int, client: "subprocess.Popen[str]") -> None:
        """Wait until so many visits are in the records; the client must not end before."""

        def come() -> bool:
            if self.run()[2] >= count:
                return True
            assert client.poll() is None, client.communicate(timeout=_START_S)[1]
            return False

        wait_until(come, _RUN_S, _PAUSE_S)

    def wait_for_end(self, within_s: float) -> None:
        """Wait until the run has ended."""
        wait_until(lambda: self.run()[0] in ENDED, within_s, _PAUSE_S)


def rig(folder: Path, nodes: tuple[int, int] = (5, 6), gyro_address: int | None = None) -> Rig:
    """Write the configuration that the documentation shows, with other nodes.

    With an address the gyro is one of NMEA 2000, whose identifier carries it.
    """
    text = (_ROOT / "docs" / "rig-can.toml").read_text(encoding="utf-8")
    text = text.replace("can:socketcan:can0", f"can:socketcan:{CHANNEL}")
    for role, node in zip((5, 6), nodes, strict=True):
        text = text.replace(f"{CHANNEL}:node={role}", f"{CHANNEL}:node={node}")
    text = text.replace('axis = "x"', f'axis = "x"\nnoise_deg_sqrt_h = {NOISE_DEG_SQRT_H}')
    if gyro_address is not None:
        text = text.replace(f'{CHANNEL}"\n', f'{CHANNEL}:node={gyro_address}"\n', 1)
        text = text.replace("northfinder-fog.dbc", "nmea2000-rate-of-turn.dbc")
        text = text.replace("FOG_RATE", "RATE_OF_TURN")
        text = re.sub(r"^(counter|status|checksum) = .*\n", "", text, flags=re.MULTILINE)
    config = folder / f"rig{nodes[0]}.toml"
    config.write_text(text, encoding="utf-8")
    return Rig(config, nodes[0])


@contextmanager
def simulating(rig: Rig, *options: str, fast_moves: bool = True) -> Iterator[subprocess.Popen[str]]:
    """Serve the rig's instruments; its drive is set to home and to move faster than shipped."""
    noise = ("--sim-gyro-noise", str(NOISE_DEG_SQRT_H))
    arguments = ("sim", "--config", str(rig.config), "--can", f"socketcan:{CHANNEL}")
    with _started(*arguments, *noise, *options) as process:
        assert process.stdout is not None
        served = [json.loads(process.stdout.readline())["role"] for _ in range(3)]
        assert sorted(served) == ["accelerometer", "gyro", "turntable"]
        for (index, sub_index), value in {**_HOMING, **(_MOVES if fast_moves else {})}.items():
            write(rig.table_node, index, sub_index, value * _UNITS_PER_DEG, 4)
        yield process


def write(node: int, index: int, sub_index: int, value: int, size: int) -> None:
    """Write an object of a node by an SDO of another program's."""
    head = bytes((0x23 | (4 - size) << 2,)) + index.to_bytes(2, "little") + bytes((sub_index,))
    cansend(f"{0x600 + node:03X}#{(head + value.to_bytes(4, 'little')).hex()}")


@contextmanager
def seeking(rig: Rig, *options: str) -> Iterator[subprocess.Popen[str]]:
    """Begin a north-seek."""
    where = ("--config", str(rig.config), "--database", rig.database)
    with _started("seek", *where, "--settle", "0.1", *options) as process:
        yield process


def result_of(process: "subprocess.Popen[str]") -> dict[str, Any]:
    """Return what a north-seek with --json found."""
    out, errors = process.communicate(timeout=_RUN_S)
    assert (process.returncode, errors) == (0, ""), errors
    found: dict[str, Any] = json.loads(out)
    return found


def error_of(process: "subprocess.Popen[str]") -> str:
    """Return the sentence that a north-seek ended with."""
    out, errors = process.communicate(timeout=_START_S)
    assert (process.returncode, out) == (1, "")
    assert errors.count("\n") == 1
    return errors


@contextmanager
def _started(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [*_PROGRAM, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()
