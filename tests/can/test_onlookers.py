"""can-utils and cantools look on, and take part, while our instruments are on the bus."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import drivers
from drivers.codecs.dbc import DbcDecoder, SignalChoice
from drivers.interfaces import CanFrame
from tests.can.onlookers import candump, cansend
from tests.can.rigs import Rig, rig, seeking, simulating

FOG = Path(drivers.__file__).parent / "dbc_files" / "northfinder-fog.dbc"
CHOICE = SignalChoice("FOG_RATE", "rate", counter="counter", checksum="crc")
FRAMES = 1000


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    bench = rig(tmp_path_factory.mktemp("bench"))
    with simulating(bench):
        yield bench


def test_cantools_reads_the_gyro_as_we_do(bench: Rig) -> None:
    """A thousand frames that candump saw, decoded by cantools' own program."""
    assert bench.table_node == 5
    with candump("-n", str(FRAMES), "vcan0,120:7FF") as seen:
        log = seen.read()
    command = [sys.executable, "-m", "cantools", "decode", "--single-line", str(FOG)]
    decoded = subprocess.run(command, input=log, text=True, capture_output=True, check=True).stdout
    theirs = [float(rate) for rate in re.findall(r"rate: (\S+) deg/s", decoded)]
    counted = [int(count) for count in re.findall(r"counter: (\d+)", decoded)]
    lines = [line.split() for line in log.splitlines()]
    frames = [CanFrame(0x120, bytes.fromhex(line[2].partition("#")[2])) for line in lines]
    readings = DbcDecoder(FOG.read_text(), CHOICE).decode(frames)
    assert readings.counter is not None
    assert len(theirs) == len(readings.value) == FRAMES
    np.testing.assert_allclose(np.degrees(readings.value), theirs, rtol=0, atol=1e-9)
    assert readings.counter.tolist() == counted
    took_s = float(lines[-1][0].strip("()")) - float(lines[0][0].strip("()"))
    assert took_s * 1000 / FRAMES == pytest.approx(1.0, abs=0.1)  # 1 kHz


def test_candump_sees_what_a_client_and_its_nodes_say(bench: Rig) -> None:
    """Of both nodes heartbeats and SDO answers, and the inclinometer's slopes after each SYNC."""
    wanted = ["vcan0,580:780", "vcan0,700:780", "vcan0,080:7FF", "vcan0,186:7FF"]
    kinds: dict[str, list[str]] = {}
    with candump(*wanted) as seen, seeking(bench, "--positions", "3", "--dwell", "1"):
        for line in seen:
            can_id, data = line.split()[2].split("#")
            kinds.setdefault(can_id, []).append(data)
            if all(len(kinds.get(name, ())) >= 5 for name in ("705", "706", "186", "585", "586")):
                break
    assert set(kinds["705"]) <= {"7F", "05"}  # pre-operational, operational
    assert set(kinds["706"]) <= {"7F", "05"}
    assert set(kinds["080"]) == {""}
    assert all(re.fullmatch("[0-9A-F]{16}", data) for data in kinds["186"] + kinds["585"])


def test_a_node_that_cansend_resets_boots_up(bench: Rig) -> None:
    reset = f"000#81{bench.table_node:02X}"
    with candump("vcan0,705:7FF") as seen:
        cansend(reset)
        assert any(line.split()[2] == "705#00" for line in seen)  # between its heartbeats


def test_a_node_answers_an_sdo_of_cansend(bench: Rig) -> None:
    """1000h of a CiA 402 servo drive, and the abort for an object that no node has."""
    assert bench.table_node == 5
    with candump("-n", "2", "vcan0,585:7FF") as seen:
        cansend("605#4000100000000000")
        answer = seen.readline().split()[2]
        cansend("605#4000500000000000")
        refused = seen.readline().split()[2]
    assert answer == "585#4300100092010200"  # 0192h is 402
    assert refused == "585#8000500000000206"
