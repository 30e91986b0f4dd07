"""What goes wrong on the kernel's bus ends a run in words; what was measured is kept."""

import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.can.onlookers import BUS_OFF, cansend, ip_link
from tests.can.rigs import Rig, error_of, rig, seeking, simulating, write

PLAN = ("--positions", "4", "--dwell", "2")
#: Twice what is promised, for a guest kernel has one processor for all that runs here; the
#: promise itself is held to in virtual time, by tests/procedures/test_can_rig.py.
NOTICED_S = 4.0


def light_rig(folder: Path, nodes: tuple[int, int] = (5, 6)) -> Rig:
    """Write a rig whose gyro is one of NMEA 2000: it sends ten messages a second.

    The thousand of the other are most of what a guest can do, and what a stall of its computer
    holds up is made good too slowly.
    """
    return rig(folder, nodes, gyro_address=35)


@pytest.fixture(scope="module")
def instruments(tmp_path_factory: pytest.TempPathFactory) -> Iterator["subprocess.Popen[str]"]:
    """Instruments that outlive the failures of the bus; the last test takes their power away."""
    folder = tmp_path_factory.mktemp("instruments")
    with simulating(light_rig(folder), fast_moves=False) as process:
        yield process


def ended_by(spoil: Callable[[], object], bench: Rig) -> str:
    """Begin a run, spoil it amid the move after its first visit, and return its last sentence."""
    with seeking(bench, *PLAN) as client:
        bench.wait_for_visits(1, client)
        spoil()
        spoiled_s = time.monotonic()
        bench.wait_for_end(NOTICED_S)
        assert time.monotonic() - spoiled_s < NOTICED_S
        sentence = error_of(client)
    state, error, visits = bench.run()
    assert (state, visits) == ("failed", 1)
    assert error.rstrip(".") in sentence
    return sentence


@pytest.mark.usefixtures("instruments")
def test_a_controller_that_goes_bus_off(tmp_path: Path) -> None:
    assert "socketcan vcan0 is bus-off" in ended_by(lambda: cansend(BUS_OFF), light_rig(tmp_path))


@pytest.mark.usefixtures("instruments")
def test_an_interface_that_is_switched_off(tmp_path: Path) -> None:
    try:
        sentence = ended_by(lambda: ip_link("down"), light_rig(tmp_path))
    finally:
        ip_link("up")
    assert "vcan0" in sentence
    assert "has failed" in sentence or "takes no frame" in sentence


@pytest.mark.usefixtures("instruments")
def test_a_wrong_node_number_is_told_with_the_nodes_that_are_heard(tmp_path: Path) -> None:
    for node in (5, 6):
        write(node, 0x1017, 0, 100, 2)  # heartbeat, ms
    bench = light_rig(tmp_path, (7, 6))
    with seeking(bench, *PLAN) as client:
        sentence = error_of(client)
    assert "node 7 on socketcan vcan0 did not answer" in sentence
    assert "Others heard on this bus: nodes 5, 6." in sentence
    assert bench.run() == ("", "", 0)


def test_nodes_that_lose_their_power_amid_a_move(
    tmp_path: Path, instruments: "subprocess.Popen[str]"
) -> None:
    sentence = ended_by(instruments.kill, light_rig(tmp_path))
    assert "node 5 on socketcan vcan0" in sentence
    assert "did not answer" in sentence or "has been silent" in sentence
