"""The simulated Zaber stage answers byte for byte as its manual says."""

import asyncio
import math
from collections.abc import Awaitable, Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.clock import run_virtual
from sim.devices.zaber import SimulatedZaber
from sim.devices.zaber_axis import MICROSTEPS_PER_TURN
from sim.motion import Plate

HOMED = ("/1 1 home", 5.0)


def counts(angle_deg: float) -> int:
    return round(angle_deg / 360 * MICROSTEPS_PER_TURN)


class Port:
    """Speaks to the stage, a line at a time."""

    def __init__(self, plate: Plate) -> None:
        self.plate = plate
        self.device = SimulatedZaber(plate)
        self.device.connect(self._hear)
        self.heard: list[str] = []

    def _hear(self, data: bytes) -> None:
        self.heard += data.decode().splitlines()

    def ask(self, line: str) -> str:
        """Return the last answer to a line, or an empty string."""
        self.heard.clear()
        self.device.receive_data(line.encode() + b"\n")
        return self.heard[-1] if self.heard else ""


def on_port(use: Callable[[Port], Awaitable[None]], start_deg: float = 100.0) -> None:
    async def run() -> None:
        port = Port(Plate(math.radians(start_deg), 1e-5, np.random.default_rng(5)))
        running = asyncio.create_task(port.device.run())
        await use(port)
        running.cancel()

    run_virtual(run())


def script(*lines: str | tuple[str, float]) -> list[str]:
    """Return the answer to each line; a line with a number is followed by so many seconds."""
    answers: list[str] = []

    async def use(port: Port) -> None:
        for line in lines:
            text, pause_s = line if isinstance(line, tuple) else (line, 0.0)
            answers.append(port.ask(text))
            await asyncio.sleep(pause_s)

    on_port(use)
    return answers


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("/", "@01 0 OK IDLE WR 0"),
        ("/0 0 00:00", "@01 0 00 OK IDLE WR 0"),
        ("/1 0 01 get comm.packet.size.max:CF", "@01 0 01 RJ IDLE WR BADCOMMAND"),
        ("/1 1 12 warnings:72", "@01 1 12 OK IDLE WR 01 WR"),
        ("/1 1 12 warnings:73", ""),
        ("/2 1 get pos", ""),
        ("/1 2 get pos", "@01 2 RJ IDLE WR BADAXIS"),
        ("/1 1 100 get pos", "@01 1 100 RJ IDLE WR BADMESSAGEID"),
        ("/1 get pos", "@01 0 OK IDLE WR 0"),
        ("/1 1 get limit.cycle.dist", "@01 1 OK IDLE WR 1536000"),
        ("/1 1 get maxspeed", "@01 1 OK IDLE WR 838861"),  # 120 deg/s
        ("/1 1 get accel", "@01 1 OK IDLE WR 252"),  # 360 deg/s^2
        ("/1 get system.serial", "@01 0 OK IDLE WR 77261"),
        ("/1 get version", "@01 0 OK IDLE WR 7.30"),
        ("/1 1 get version", "@01 1 RJ IDLE WR DEVICEONLY"),
        ("/1 get nonsense", "@01 0 RJ IDLE WR BADCOMMAND"),
        ("/1 set version 8", "@01 0 RJ IDLE WR BADCOMMAND"),
        ("/1 1 set pos 8", "@01 1 RJ IDLE WR BADCOMMAND"),
        ("/1 1 set limit.cycle.dist 8", "@01 1 RJ IDLE WR BADCOMMAND"),
        ("/1 1 set maxspeed 0", "@01 1 RJ IDLE WR BADDATA"),
        ("/1 1 set maxspeed fast", "@01 1 RJ IDLE WR BADDATA"),
        ("/1 set comm.alert 2", "@01 0 RJ IDLE WR BADDATA"),
        ("/1 1 move abs", "@01 1 RJ IDLE WR BADCOMMAND"),
        ("/1 1 move abs 1000000001", "@01 1 RJ IDLE WR BADDATA"),
        ("/1 1 move index 0", "@01 1 RJ IDLE WR BADDATA"),
        ("/1 1 move sideways 1", "@01 1 RJ IDLE WR BADCOMMAND"),
        ("/1 1 warnings explain", "@01 1 RJ IDLE WR BADCOMMAND"),
        ("/1 dance", "@01 0 RJ IDLE WR BADCOMMAND"),
        ("@01 0 OK IDLE -- 0:8D", ""),
    ],
)
def test_one_command_gets_the_manuals_answer(line: str, answer: str) -> None:
    assert script(line) == [answer]


def test_homing_is_busy_then_homed_at_zero() -> None:
    answers = script("/1 1 home", "/1 1", ("/1 1 warnings", 5.0), "/1 1 get pos", "/1 1 warnings")
    assert answers == [
        "@01 1 OK BUSY WR 0",
        "@01 1 OK BUSY WR 0",
        "@01 1 OK BUSY WR 01 WR",
        "@01 1 OK IDLE -- 0",
        "@01 1 OK IDLE -- 00",
    ]


@pytest.mark.parametrize(
    ("command", "position"),
    [
        (f"move abs {counts(-400)}", counts(-400)),
        (f"move rel {counts(12)}", counts(48)),
        ("move index 3", counts(60)),
        ("move index 12", counts(-30)),  # the shortest way
        ("move index 13", 0),
    ],
)
def test_a_homed_stage_moves_where_it_is_told(command: str, position: int) -> None:
    answers = script(
        HOMED, (f"/1 1 move abs {counts(36)}", 5.0), (f"/1 1 {command}", 9.0), "/1 1 get pos"
    )
    assert answers[2:] == ["@01 1 OK BUSY -- 0", f"@01 1 OK IDLE -- {position}"]


def test_a_velocity_is_kept_until_stopped_and_has_a_sign() -> None:
    speed = round(counts(30) * 1.6384)
    lines = HOMED, (f"/1 1 move vel {-speed}", 10.0), "/1 1 get pos", ("/1 1 move vel 0", 2.0)
    *_, moving, stopping, stopped = script(*lines, "/1 1")
    position = int(moving.split()[-1])
    assert position == pytest.approx(counts(-30 * (10 - 30 / 360 / 2)), rel=1e-4)
    assert (stopping, stopped) == ("@01 1 OK BUSY NI 0", "@01 1 OK IDLE NI 0")


@pytest.mark.parametrize(("end", "sign"), [("max", 1), ("min", -1)])
def test_towards_a_limit_it_turns_on_and_on(end: str, sign: int) -> None:
    answers = script(HOMED, (f"/1 1 move {end}", 20.0), "/1 1 get pos")
    assert sign * int(answers[-1].split()[-1]) > counts(2000)


def test_without_a_reference_it_is_no_faster_than_an_approach() -> None:
    answers = script(("/1 1 move max", 10.0), "/1 1 get pos")
    assert int(answers[-1].split()[-1]) == pytest.approx(counts(600), rel=0.01)


def test_a_stop_interrupts_and_an_emergency_stop_does_so_at_once() -> None:
    soft = script(HOMED, ("/1 1 move max", 2.0), ("/1 1 stop", 0.1), ("/1 1", 1.0), "/1 1")
    hard = script(HOMED, ("/1 1 move max", 2.0), ("/1 1 estop", 0.1), "/1 1", "/1 1 warnings clear")
    assert soft[2:] == ["@01 1 OK BUSY NI 0", "@01 1 OK BUSY NI 0", "@01 1 OK IDLE NI 0"]
    assert hard[3:] == ["@01 1 OK IDLE NI 0", "@01 1 OK IDLE -- 01 NI"]


def test_a_stop_during_homing_leaves_it_without_reference() -> None:
    answers = script(("/1 1 home", 0.5), ("/1 1 stop", 1.0), "/1 1 warnings")
    assert answers[-1] == "@01 1 OK IDLE WR 02 WR NI"


def test_a_stall_is_flagged_until_it_is_cleared() -> None:
    async def use(port: Port) -> None:
        port.plate.block_at(math.radians(50))
        port.ask("/1 1 home")
        await asyncio.sleep(5.0)
        assert port.ask("/1 1") == "@01 1 OK IDLE FS 0"
        assert port.ask("/1 1 warnings clear") == "@01 1 OK IDLE WR 02 FS WR"
        assert port.ask("/1 1") == "@01 1 OK IDLE WR 0"

    on_port(use)


def test_a_shortfall_shows_in_the_position_but_the_gearings_error_does_not() -> None:
    async def use(port: Port) -> None:
        for short_deg, position in [(0.0, counts(36)), (0.5, counts(71.5))]:
            port.ask("/1 1 home")
            await asyncio.sleep(5.0)
            port.plate.fall_short_by(math.radians(short_deg))
            target = counts(72 if short_deg else 36)
            port.ask(f"/1 1 move abs {target}")
            await asyncio.sleep(5.0)
            now_s = asyncio.get_running_loop().time()
            counted = int(port.ask("/1 1 get pos").split()[-1])
            assert counted == pytest.approx(position, abs=10 if short_deg else 0)
            assert counts(math.degrees(port.plate.angle_at(now_s))) != position

    on_port(use)


@pytest.mark.parametrize("how", ["/1 system reset", "supply"])
def test_after_a_restart_the_counter_begins_at_zero_without_reference(how: str) -> None:
    async def use(port: Port) -> None:
        port.ask("/1 1 home")
        await asyncio.sleep(5.0)
        port.ask(f"/1 1 move abs {counts(90)}")
        await asyncio.sleep(5.0)
        if how == "supply":
            port.device.lose_reference()
        else:
            assert port.ask(how) == "@01 0 OK IDLE WR 0"
        assert port.ask("/1 1 get pos") == "@01 1 OK IDLE WR 0"

    on_port(use)


def test_alerts_come_unasked_at_the_end_of_a_motion_where_they_are_switched_on() -> None:
    async def use(port: Port) -> None:
        for switch, alerts in [("1", ["!01 1 IDLE --"]), ("0", [])]:
            port.ask(f"/1 set comm.alert {switch}")
            port.ask("/1 1 home")
            port.heard.clear()
            await asyncio.sleep(5.0)
            assert port.heard == alerts

    on_port(use)


def test_the_end_of_a_motion_that_an_obstacle_cut_short_is_alerted_in_time() -> None:
    async def use(port: Port) -> None:
        port.ask("/1 set comm.alert 1")
        port.ask("/1 1 move max")
        await asyncio.sleep(1.0)
        port.plate.block_at(port.plate.angle_at(asyncio.get_running_loop().time()) + 0.01)
        port.heard.clear()
        await asyncio.sleep(0.1)
        assert port.heard == ["!01 1 IDLE FS"]

    on_port(use)


def test_checksums_are_added_where_they_are_switched_on() -> None:
    switched, plain = script("/1 set comm.checksum 1", "/1 set comm.checksum 0")
    assert switched == "@01 0 OK IDLE WR 0:3E"
    assert plain == "@01 0 OK IDLE WR 0"


def test_an_unconnected_stage_stays_silent() -> None:
    async def run() -> None:
        SimulatedZaber(Plate(0.0, 0.0, np.random.default_rng(0))).receive_data(b"/\n")

    run_virtual(run())


@given(st.binary(max_size=300))
def test_no_bytes_whatever_bring_it_down(data: bytes) -> None:
    async def use(port: Port) -> None:
        port.device.receive_data(data)
        assert port.ask("\n/1 9").startswith("@01 9 RJ")

    on_port(use)
