"""The third-party ``canopen`` library takes the simulated drive for a CiA 402 drive."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeAlias

import canopen
import numpy as np
import pytest
from canopen.profiles.p402 import BaseNode402

from sim.devices.cia402 import DATA_SHEET, SimulatedCia402
from sim.motion import Plate
from tests.sim.can_serving import PATIENCE_S, serving

Drive: TypeAlias = Any  # a BaseNode402: the library is typed in part

UNITS_PER_DEG = 10_000
#: tests/can has these tests on a kernel's bus too.
CHANNELS = ["virtual:cia402", "slcan:pty"]


@dataclass
class Bench:
    plate: Plate
    device: SimulatedCia402
    drive: Drive
    in_its_thread: Callable[..., None]


@pytest.fixture(params=CHANNELS)
def bus(request: pytest.FixtureRequest) -> tuple[str, str]:
    interface, channel = request.param.split(":", 1)
    return interface, channel


@pytest.fixture
def bench(bus: tuple[str, str]) -> Iterator[Bench]:
    with a_bench(bus, start_deg=4.0) as on:
        set_up(on.drive)
        yield on


@contextmanager
def a_bench(bus: tuple[str, str], start_deg: float) -> Iterator[Bench]:
    interface, channel = bus
    plate = Plate(math.radians(start_deg), 1e-5, np.random.default_rng(7))
    device = SimulatedCia402(plate)
    with serving(interface, channel, device) as served:
        network = canopen.Network()
        network.connect(**served.client)
        data_sheet = canopen.import_od(str(DATA_SHEET), 5)
        drive: Drive = BaseNode402(5, data_sheet)  # type: ignore[no-untyped-call]
        network.add_node(drive)
        be_patient(drive)
        try:
            yield Bench(plate, device, drive, served.in_their_thread)
        finally:
            network.disconnect()


def set_up(drive: Drive) -> None:
    """Do what the profile expects: heartbeat first, then cyclic PDOs, then OPERATIONAL."""
    drive.sdo[0x1017].raw = 50
    drive.nmt.wait_for_heartbeat(PATIENCE_S)
    drive.setup_402_state_machine()
    for pdo in (drive.tpdo[1], drive.tpdo[2]):
        pdo.event_timer = 20
        pdo.save()
    drive.nmt.state = "OPERATIONAL"
    wait_until(lambda: drive.nmt.state == "OPERATIONAL")
    # Two receptions tell the library that they are cyclic.
    for _ in range(2):
        drive.tpdo[1].wait_for_reception(PATIENCE_S)


def be_patient(drive: Drive) -> None:
    """Let the library wait as long as the tests do."""
    drive.sdo.RESPONSE_TIMEOUT = PATIENCE_S
    drive.TIMEOUT_CHECK_TPDO = drive.TIMEOUT_SWITCH_OP_MODE = PATIENCE_S
    drive.TIMEOUT_SWITCH_STATE_FINAL = drive.TIMEOUT_SWITCH_STATE_SINGLE = PATIENCE_S


def wait_until(holds: Callable[[], bool], timeout_s: float = PATIENCE_S) -> None:
    deadline_s = time.monotonic() + timeout_s
    while not holds():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


def move(on: Bench, position: int) -> None:
    """Turn to a position by the handshake of profile position (CiA 402-2, 9.2.2)."""
    drive = on.drive
    drive.rpdo[2]["Controlword"].raw = 0x0F
    drive.rpdo[2]["Target position"].raw = position
    drive.rpdo[2].transmit()
    drive.rpdo[2]["Controlword"].raw = 0x1F
    drive.rpdo[2].transmit()
    wait_until(lambda: bool(drive.statusword & 0x1000))
    drive.rpdo[2]["Controlword"].raw = 0x0F
    drive.rpdo[2].transmit()
    wait_until(lambda: not drive.statusword & 0x1000)
    wait_until(lambda: bool(drive.statusword & 0x0408))


def home(drive: Drive) -> None:
    """Home by the handshake of homing mode, to its success or its error (CiA 402-2, 9.4).

    ``BaseNode402.homing`` judges by the second status that it receives after its request: on a
    busy computer that may be older than the request, and reads as a homing that did not start.
    """
    drive.op_mode = "HOMING"
    drive.state = "OPERATION ENABLED"
    drive.controlword = 0x1F
    wait_until(lambda: bool(drive.statusword & 0x3000))


def test_names_and_serial_number_are_read_in_segments(bench: Bench) -> None:
    assert bench.drive.sdo["Manufacturer device name"].raw == "Simulated CiA 402 drive"
    assert bench.drive.sdo["Identity object"]["Serial number"].raw == 4_020_017
    assert bench.drive.sdo["Device type"].raw & 0xFFFF == 402


def test_it_enables_homes_and_moves_in_profile_position(bench: Bench) -> None:
    drive = bench.drive
    assert drive.state == "SWITCH ON DISABLED"
    home(drive)
    assert drive.state == "OPERATION ENABLED"
    assert drive.sdo[0x6064].raw == 0
    assert drive.is_homed()

    drive.op_mode = "PROFILED POSITION"
    assert drive.op_mode == "PROFILED POSITION"
    move(bench, 10 * UNITS_PER_DEG)
    assert drive.sdo[0x6064].raw == 10 * UNITS_PER_DEG
    assert bench.plate.angle_at(1e9) == pytest.approx(math.radians(10), abs=1e-4)
    move(bench, -5 * UNITS_PER_DEG)
    # The state's PDO comes before the last of the position's.
    wait_until(lambda: drive.tpdo[2]["Position actual value"].raw == -5 * UNITS_PER_DEG)


def test_it_recovers_from_the_fault_of_a_stall(bench: Bench) -> None:
    drive = bench.drive
    home(drive)
    drive.op_mode = "PROFILED POSITION"
    bench.in_its_thread(bench.plate.block_at, math.radians(5))
    move(bench, 10 * UNITS_PER_DEG)
    wait_until(lambda: drive.state == "FAULT")
    assert drive.sdo[0x603F].raw == 0x8611
    assert [error.code for error in drive.emcy.active] == [0x8611]
    assert drive.sdo[0x1003][1].raw == 0x8611

    bench.in_its_thread(bench.plate.block_at, None)
    drive.reset_from_fault()
    assert drive.state == "OPERATION ENABLED"
    wait_until(lambda: not drive.emcy.active)
    move(bench, 10 * UNITS_PER_DEG)
    assert drive.sdo[0x6064].raw == 10 * UNITS_PER_DEG


def test_a_stall_during_homing_is_an_error_of_homing(bench: Bench) -> None:
    bench.in_its_thread(bench.plate.block_at, math.radians(2))
    home(bench.drive)
    assert not bench.drive.is_homed()
    wait_until(lambda: bench.drive.state == "FAULT")
    assert bench.drive.statusword & 0x3400 == 0x2400  # an error, and it stands


def test_a_quick_stop_in_mid_move_ends_in_switch_on_disabled(bench: Bench) -> None:
    drive = bench.drive
    drive.op_mode = "PROFILED POSITION"
    drive.state = "OPERATION ENABLED"
    drive.rpdo[2]["Target position"].raw = 360 * UNITS_PER_DEG
    drive.rpdo[2]["Controlword"].raw = 0x1F
    drive.rpdo[2].transmit()
    wait_until(lambda: drive.sdo[0x6064].raw > UNITS_PER_DEG)
    drive.controlword = 0x02
    wait_until(lambda: drive.state == "SWITCH ON DISABLED")
    assert drive.sdo[0x606C].raw == 0
    assert drive.sdo[0x6064].raw < 90 * UNITS_PER_DEG
