"""Zaber's own client, over a pseudo-terminal and in wall time, takes the stage for a real one."""

import asyncio
import math
import sys
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import pytest
from zaber_motion import MovementFailedException
from zaber_motion.ascii import Axis, Connection

from sim.devices.zaber import SimulatedZaber
from sim.devices.zaber_axis import MICROSTEPS_PER_TURN
from sim.motion import Plate
from sim.pty import serve_on_pty

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")
T = TypeVar("T")
DEGREE = MICROSTEPS_PER_TURN / 360  # whole numbers of microsteps only at multiples of 3


def with_client(plate: Plate, use: Callable[[Connection, Axis], T]) -> T:
    """Serve the stage on the loop, and let the client use it in a thread."""

    def client(path: str) -> T:
        with Connection.open_serial_port(path) as connection:
            connection.enable_alerts()
            (device,) = connection.detect_devices(identify_devices=False)
            return use(connection, device.get_axis(1))

    async def serve() -> T:
        stage = SimulatedZaber(plate)
        running = asyncio.create_task(stage.run())
        async with serve_on_pty(stage) as path:
            used = await asyncio.to_thread(client, path)
        running.cancel()
        return used

    return asyncio.run(serve())


def plate(angle_deg: float) -> Plate:
    return Plate(math.radians(angle_deg), 1e-5, np.random.default_rng(7))


def test_it_homes_moves_and_reads_positions_and_settings() -> None:
    def use(_: Connection, axis: Axis) -> tuple[bool, bool, list[float], float]:
        homed_before = axis.is_homed()
        axis.home()
        positions = [axis.get_position()]
        axis.move_absolute(12 * DEGREE)
        positions.append(axis.get_position())
        axis.move_relative(-21 * DEGREE)
        positions.append(axis.get_position())
        return homed_before, axis.is_homed(), positions, axis.settings.get("limit.cycle.dist")

    table = plate(5.0)
    homed_before, homed, positions, cycle = with_client(table, use)
    assert (homed_before, homed) == (False, True)
    assert positions == [0.0, 12 * DEGREE, -9 * DEGREE]
    assert cycle == MICROSTEPS_PER_TURN
    assert table.angle_at(1e9) == pytest.approx(math.radians(-9), abs=1e-4)


def test_it_turns_at_a_speed_given_with_the_move() -> None:
    def use(_: Connection, axis: Axis) -> tuple[float, float]:
        axis.home()
        begin_s = time.monotonic()
        axis.move_absolute(12 * DEGREE, velocity=round(24 * DEGREE * 1.6384))  # 24 deg/s, native
        return time.monotonic() - begin_s, axis.get_position()

    lasted_s, position = with_client(plate(0.0), use)
    assert position == 12 * DEGREE
    assert lasted_s >= 12 / 24  # at its own speed of 120 deg/s, less than 0.4 s


def test_it_stops_a_move_under_way() -> None:
    def use(_: Connection, axis: Axis) -> tuple[bool, bool, float]:
        axis.move_absolute(720 * DEGREE, wait_until_idle=False)
        busy = False
        while axis.get_position() < 3 * DEGREE:
            busy = axis.is_busy()
        axis.stop()
        return busy, axis.is_busy(), axis.get_position()

    busy, still_busy, position = with_client(plate(0.0), use)
    assert (busy, still_busy) == (True, False)
    assert 3 * DEGREE < position < 700 * DEGREE


def test_it_learns_of_a_stall_and_reads_the_warnings() -> None:
    table = plate(0.0)
    table.block_at(math.radians(5))

    def use(_: Connection, axis: Axis) -> set[str]:
        axis.home()
        with pytest.raises(MovementFailedException, match="Stalled"):
            axis.move_absolute(42 * DEGREE)
        axis.move_absolute(42 * DEGREE, wait_until_idle=False)
        return axis.warnings.get_flags()

    assert with_client(table, use) == {"FS"}


def test_it_is_alerted_when_a_motion_ends() -> None:
    def use(connection: Connection, axis: Axis) -> list[str]:
        statuses: list[str] = []
        connection.alert.subscribe(lambda alert: statuses.append(alert.status))
        axis.move_relative(6 * DEGREE)
        axis.wait_until_idle()
        return statuses

    assert with_client(plate(0.0), use) == ["IDLE"]
