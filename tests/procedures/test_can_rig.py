"""North-seeks with instruments on a CAN bus in memory: the same drivers, the same frames."""

import asyncio
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivers.codecs.canopen import NmtState, encode_heartbeat
from northfinder.config import load_config
from northfinder.errors import ConfigError
from northfinder.procedures.events import Event, VisitCompleted
from northfinder.procedures.north_seek import Plan
from northfinder.wiring import build_rig
from sim.devices.cia402 import SimulatedCia402
from sim.world import World
from tests.evidence import Record
from tests.procedures.rigs import Outcome, config_of, seek, sigmas_off

TABLE = {"driver": "cia402"}
INCLINOMETER = {"driver": "cia410"}
FOG = {
    "driver": "dbc",
    "file": "northfinder-fog.dbc",
    "message": "FOG_RATE",
    "signal": "rate",
    "counter": "counter",
    "status": "status",
    "checksum": "crc",
    "noise_deg_sqrt_h": 0.001,
}
CAN: dict[str, Any] = {"turntable": TABLE, "gyro": FOG, "accelerometer": INCLINOMETER}
#: After a visit: amid the next move, and amid the dwell after it.
_MOVING_S, _DWELLING_S = 1.0, 4.0
DWELLING = Plan(positions=4, dwell_s=8, settle_s=0.1)


def _find_north(seed: int) -> None:
    result = seek(Plan(), **CAN, simulation={"seed": seed}).completed
    assert sigmas_off(result, 48.0) < 4.0
    assert sum(visit["lost"] for visit in result["visits"]) == 0
    assert [check["name"] for check in result["checks"] if check["status"] == "fail"] == []
    assert result["tilt"]["pitch_deg"] == pytest.approx(0.8, abs=0.001)
    assert result["tilt"]["roll_deg"] == pytest.approx(-0.5, abs=0.001)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_can_rig_finds_north(seed: int) -> None:
    _find_north(seed)


@pytest.mark.alone
@pytest.mark.proof
@pytest.mark.timeout(400)
def test_twenty_can_rigs_find_north_in_six_seconds_each(record_property: Record) -> None:
    durations_s = []
    for seed in range(20):
        begun_s = time.perf_counter()
        _find_north(seed)
        durations_s.append(time.perf_counter() - begun_s)
    record_property("measured", f"20 of 20, {max(durations_s):.1f} s at most")
    assert max(durations_s) < 6.0


@pytest.mark.parametrize(
    "sections",
    [
        {"turntable": TABLE},
        {"gyro": FOG},
        {"accelerometer": INCLINOMETER},
        {"turntable": TABLE, "gyro": FOG, "accelerometer": {"driver": "stim300"}},
    ],
)
def test_serial_and_can_instruments_mix(sections: dict[str, Any]) -> None:
    noise = {"noise_deg_sqrt_h": 0.001}
    gyro = {**noise, **sections.get("gyro", {})}
    result = seek(Plan(positions=8, dwell_s=2), **{**sections, "gyro": gyro}).completed
    assert sigmas_off(result, 48.0) < 4.0


def test_equal_seeds_give_equal_runs() -> None:
    first, again = (seek(**CAN).completed for _ in range(2))
    assert first["azimuth_deg"] == again["azimuth_deg"]


def test_a_nmea_2000_gyro_and_a_multiplexed_accelerometer_find_north() -> None:
    """The rate of turn counts clockwise: an axis that points down, or with a minus sign."""
    vectors = Path(__file__).parents[1] / "vectors" / "dbc" / "bench.dbc"
    gyro = {
        "driver": "dbc",
        "file": "nmea2000-rate-of-turn.dbc",
        "message": "RATE_OF_TURN",
        "signal": "rate",
        "noise_deg_sqrt_h": 0.001,
    }
    accelerometer = {
        "driver": "dbc",
        "file": str(vectors),
        "message": "IMU",
        "signal": "pull_y",
        "counter": "number",
    }
    result = seek(Plan(positions=8, dwell_s=4), gyro=gyro, accelerometer=accelerometer).completed
    assert sigmas_off(result, 48.0) < 4.0


def _spoiled(spoil: Callable[[World], None], later_s: float) -> tuple[Outcome, float]:
    """Spoil the world after two visits; return the outcome, and when the run ended after that."""
    spoiled_s: list[float] = []

    def meanwhile(world: World, event: Event) -> None:
        loop = asyncio.get_running_loop()
        if isinstance(event, VisitCompleted) and event.visit.index == 1:
            loop.call_later(later_s, spoil, world)
            spoiled_s.append(loop.time() + later_s)

    outcome = seek(DWELLING, meanwhile, **CAN)
    return outcome, outcome.ended_s - spoiled_s[0]


def _silence(role: str) -> Callable[[World], None]:
    def spoil(world: World) -> None:
        world.faults(role).silent = True

    return spoil


def _hang(world: World) -> None:
    table = world.nodes["turntable"]
    assert isinstance(table, SimulatedCia402)
    table.pause_heartbeat = True


def _restart(world: World) -> None:
    table = world.nodes["turntable"]
    assert isinstance(table, SimulatedCia402)
    table.lose_reference()


def _double(world: World) -> None:
    """A second device with the table's number is switched on: it says so, and lives."""
    world.can.put(encode_heartbeat(5, NmtState.BOOT_UP), lambda _: None)


def _off(world: World) -> None:
    world.can.fail("is bus-off; check termination, bit rate and wiring")


@pytest.mark.parametrize(
    ("spoil", "later_s", "sentence"),
    [
        (_off, _MOVING_S, "is bus-off"),
        (_off, _DWELLING_S, "is bus-off"),
        (_silence("turntable"), _MOVING_S, r"node 5 on sim:can (has been silent|did not answer)"),
        (_silence("gyro"), _DWELLING_S, r"FOG_RATE \(120h\) on sim:can has been silent for 1 s"),
        (_silence("accelerometer"), _DWELLING_S, "node 6 on sim:can sent no valid sample for"),
        (_hang, _MOVING_S, "still answers, but sends no heartbeat"),
        (_restart, _MOVING_S, "node 5 on sim:can has restarted"),
        (_double, _MOVING_S, "a second device with this node number was switched on"),
    ],
)
def test_what_fails_on_the_bus_ends_the_run_in_words_within_two_seconds(
    spoil: Callable[[World], None], later_s: float, sentence: str, record_property: Record
) -> None:
    outcome, noticed_s = _spoiled(spoil, later_s)
    record_property("measured", f"told within {noticed_s:z.2f} s")
    assert outcome.result is None
    assert noticed_s < 2.0
    with pytest.raises(Exception, match=sentence):
        raise outcome.error or AssertionError
    visits = [event for event in outcome.events if isinstance(event, VisitCompleted)]
    assert len(visits) == 2


@pytest.mark.parametrize(
    ("sections", "sentence"),
    [
        ({"gyro": {"driver": "dbc"}}, r"\[gyro\] driver = 'dbc': file, message and signal"),
        ({"gyro": {**FOG, "file": "x.dbc"}}, r"no such file; nmea2000-rate-of-turn.dbc, northf"),
        ({"gyro": {**FOG, "signal": "yaw"}}, "no signal 'yaw'; it has counter, crc, rate"),
        ({"gyro": {"file": "northfinder-fog.dbc"}}, "file: only driver = 'dbc' has it, not 'kvh'"),
        ({"accelerometer": FOG | {"noise_deg_sqrt_h": None}}, "noise_deg_sqrt_h"),
        (
            {"accelerometer": {k: v for k, v in FOG.items() if k != "noise_deg_sqrt_h"}},
            "its unit is not that of a specific force",
        ),
        ({"turntable": {**TABLE, "link": "/dev/ttyUSB0"}}, "this driver is on a CAN bus"),
        ({"turntable": {"link": "can:socketcan:can0:node=5"}}, "'zaber' is not for CAN"),
        ({"turntable": {**TABLE, "link": "can:socketcan:can0"}}, "say which node it is, as in can"),
        ({"turntable": {**TABLE, "link": "can:socketcan"}}, "a CAN link is can:INTERFACE:CHANNEL"),
        ({"turntable": {**TABLE, "link": "can:socketcan:can0:node=x"}}, "a node is a number"),
        (
            {
                "turntable": {**TABLE, "link": "can:socketcan:can0:node=5"},
                "accelerometer": {**INCLINOMETER, "link": "can:socketcan:can0:node=5"},
            },
            "node 5 is the turntable already",
        ),
        (
            {
                "turntable": {**TABLE, "link": "can:pcan:PCAN_USBBUS1:node=5,bitrate=500000"},
                "accelerometer": {**INCLINOMETER, "link": "can:pcan:PCAN_USBBUS1:node=6"},
            },
            "the turntable opens the same bus with other options",
        ),
        ({"gyro": FOG, "accelerometer": {"from": "gyro"}}, "a signal of a DBC file is one axis"),
    ],
)
def test_a_can_rig_that_cannot_be_is_refused_in_words(
    sections: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ConfigError, match=sentence):
        build_rig(config_of(site={"latitude_deg": 40.0}, **sections))


def test_a_scale_too_coarse_for_the_earths_rate_is_refused_unless_accepted() -> None:
    vectors = Path(__file__).parents[1] / "vectors" / "dbc" / "bench.dbc"
    gyro = {"driver": "dbc", "file": str(vectors), "message": "COARSE", "signal": "yaw"}
    with pytest.raises(ConfigError, match=r"one count is 36 deg/h, and the Earth turns by 15"):
        build_rig(config_of(gyro=gyro))
    build_rig(config_of(gyro={**gyro, "accept_coarse_scale": True}))


def test_a_dbc_file_is_looked_for_beside_the_configuration(tmp_path: Path) -> None:
    (tmp_path / "own.dbc").write_text(
        (Path(__file__).parents[1] / "vectors" / "dbc" / "bench.dbc").read_text()
    )
    config = tmp_path / "rig.toml"
    config.write_text(
        '[gyro]\ndriver = "dbc"\nfile = "own.dbc"\nmessage = "IMU"\nsignal = "turn"\n'
    )
    build_rig(load_config(config, {}, {}))
