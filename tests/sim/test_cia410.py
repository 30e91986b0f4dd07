"""The third-party ``canopen`` library reads the simulated inclinometer, by SDO and by SYNC."""

import asyncio
import math
import threading
from collections.abc import Iterator
from typing import Any, TypeAlias

import canopen
import numpy as np
import pytest

from drivers.codecs.canopen import NmtCommand, encode_nmt
from drivers.interfaces import CanFrame, FloatArray
from sim.canopen.node import SimulatedNode
from sim.clock import run_virtual
from sim.devices.cia410 import DATA_SHEET, SimulatedCia410
from sim.interfaces import Felt
from tests.sim.can_serving import PATIENCE_S, serving

Network: TypeAlias = Any  # a canopen.Network: the library is typed in part

#: tests/can has these tests on a kernel's bus too.
CHANNELS = ["virtual:cia410", "slcan:pty"]
#: The body's x axis points 1.234 deg above the horizon, its y axis 2.5 deg below.
LONGITUDINAL_DEG, LATERAL_DEG = 1.234, -2.5


class Tilted:
    """Feels gravity along a body that stands still, and notes when it was asked."""

    def __init__(self, longitudinal_deg: float, lateral_deg: float) -> None:
        along, across = (math.sin(math.radians(d)) for d in (longitudinal_deg, lateral_deg))
        self.force_g = np.array([[along, across, math.sqrt(1 - along**2 - across**2)]])
        self.asked: list[tuple[float, float]] = []

    def sense(self, time_s: FloatArray, period_s: float) -> Felt:
        self.asked.append((float(time_s[-1]), period_s))
        return Felt(np.zeros((1, 3)), self.force_g, np.zeros(1))


@pytest.fixture(params=CHANNELS)
def bus(request: pytest.FixtureRequest) -> tuple[str, str]:
    interface, channel = request.param.split(":", 1)
    return interface, channel


@pytest.fixture
def network(bus: tuple[str, str]) -> Iterator[Network]:
    device = SimulatedCia410(Tilted(LONGITUDINAL_DEG, LATERAL_DEG), 6, 314_159)
    with serving(*bus, device) as served:
        network: Network = canopen.Network()
        network.connect(**served.client)
        node = network.add_node(canopen.RemoteNode(6, canopen.import_od(str(DATA_SHEET), 6)))
        node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
        try:
            yield network
        finally:
            network.disconnect()


def test_it_says_what_it_is_and_reads_slopes_by_sdo(network: Network) -> None:
    sdo = network[6].sdo
    assert sdo["Device type"].raw & 0xFFFF == 410
    assert sdo["Manufacturer device name"].raw == "Simulated CiA 410 inclinometer"
    assert sdo[0x1018][4].raw == 314_159
    assert (sdo[0x6110].raw, sdo[0x6120].raw) == (1234, -2500)
    assert (sdo[0x6010].raw, sdo[0x6020].raw) == (1234, -2500)
    sdo[0x6000].raw = 100
    assert (sdo[0x6110].raw, sdo[0x6020].raw) == (12, -25)


@pytest.mark.parametrize(
    ("index", "value", "code"), [(0x6000, 7, 0x0609_0030), (0x6000, 2000, 0x0609_0031)]
)
def test_a_resolution_that_the_profile_has_not_got_is_refused(
    network: Network, index: int, value: int, code: int
) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refused:
        network[6].sdo[index].raw = value
    assert refused.value.code == code


def test_after_each_sync_it_sends_both_slopes(network: Network) -> None:
    node = network[6]
    node.tpdo.read()
    assert node.tpdo[1].trans_type == 1
    node.nmt.state = "OPERATIONAL"
    received = threading.Event()
    node.tpdo[1].add_callback(lambda _: received.set())
    for _ in range(3):
        received.clear()
        network.sync.transmit()
        assert received.wait(PATIENCE_S)
        slopes = node.tpdo[1]
        assert slopes["Slope longitudinal, 32 bit"].raw == 1234
        assert slopes["Slope lateral, 32 bit"].raw == -2500


def test_its_heartbeat_tells_its_state(network: Network) -> None:
    node = network[6]
    node.sdo["Producer heartbeat time"].raw = 20
    assert node.nmt.wait_for_heartbeat(PATIENCE_S) == "PRE-OPERATIONAL"
    node.nmt.state = "OPERATIONAL"
    node.nmt.wait_for_heartbeat(PATIENCE_S)
    assert node.nmt.wait_for_heartbeat(PATIENCE_S) == "OPERATIONAL"


def frames_of(device: SimulatedCia410, *sent: tuple[float, CanFrame]) -> list[CanFrame]:
    """Return what the started node sends while it is sent frames, each after a pause."""

    async def run() -> list[CanFrame]:
        heard: list[CanFrame] = []
        device.connect(heard.append)
        running = asyncio.create_task(device.run())
        await asyncio.sleep(0.1)
        device.receive_frame(encode_nmt(NmtCommand.START, 0))
        heard.clear()
        for pause_s, frame in sent:
            await asyncio.sleep(pause_s)
            device.receive_frame(frame)
        running.cancel()
        return heard

    return run_virtual(run())


SYNC = CanFrame(0x080)


def test_the_bytes_of_its_process_data_are_those_of_the_profile() -> None:
    (frame,) = frames_of(SimulatedCia410(Tilted(90.0, 0.0)), (0.01, SYNC))
    # 90 000 and 0, each 32 bits, the lowest byte first.
    assert frame == CanFrame(0x186, bytes.fromhex("905F0100 00000000"))


def test_an_older_make_has_sixteen_bits_only_and_stays_at_their_limit() -> None:
    device = SimulatedCia410(Tilted(80.0, -1.0), 9, 1, sixteen_bit_only=True)
    read = CanFrame(0x609, bytes.fromhex("40 10 61 00 00000000"))  # 6110h
    slopes, refused = frames_of(device, (0.01, SYNC), (0.01, read))
    assert slopes == CanFrame(0x189, bytes.fromhex("FF7F 18FC"))  # 32 767 and -1000
    assert refused == CanFrame(0x589, bytes.fromhex("80 10 61 00 00000206"))  # no such object


def test_it_is_sensed_forward_in_time_over_the_period_since_the_last_sample() -> None:
    sensing = Tilted(0.0, 0.0)
    frames_of(SimulatedCia410(sensing), (0.1, SYNC), (0.02, SYNC), (0.0, SYNC), (30.0, SYNC))
    times_s, periods_s = zip(*sensing.asked, strict=True)
    assert times_s == pytest.approx((0.2, 0.22, 30.22))
    assert periods_s == pytest.approx((0.01, 0.02, 1.0))  # its filter forgets within a second


def test_it_can_be_made_to_send_by_a_timer_of_its_own() -> None:
    def write(index: int, sub_index: int, size: int, value: int) -> tuple[float, CanFrame]:
        head = bytes((0x23 | (4 - size) << 2,)) + index.to_bytes(2, "little")
        return 0.0, CanFrame(0x606, head + bytes((sub_index,)) + value.to_bytes(4, "little"))

    frames = frames_of(
        SimulatedCia410(Tilted(0.0, 0.0)),
        write(0x1800, 2, 1, 255),
        write(0x1800, 5, 2, 10),
        (0.1005, SYNC),
    )
    assert [frame.can_id for frame in frames] == [0x586, 0x586] + [0x186] * 10


def test_it_is_a_device_of_the_bus() -> None:
    assert isinstance(SimulatedCia410(Tilted(0.0, 0.0)), SimulatedNode)
    assert SimulatedCia410.transport == "can"
