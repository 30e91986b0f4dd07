"""A world powers its devices, wires them, and is the same again from the same seed."""

import asyncio
from collections.abc import Callable
from typing import ClassVar

import numpy as np
import pytest

from drivers.interfaces import FloatArray, Transport
from sim.bench import Mounting
from sim.clock import run_virtual
from sim.interfaces import Sensing
from sim.noise import NoiseLevels
from sim.pacing import bursts
from sim.truth import EARTH_RATE_RAD_S, Truth
from sim.world import World, WorldSettings


class Reporter:
    """Sends what it senses as plain numbers, ten times a second; a command breaks it."""

    transport: ClassVar[Transport] = "serial"

    def __init__(self, sensing: Sensing) -> None:
        self._sensing = sensing
        self._broken = False
        self._send: Callable[[bytes], None] = lambda _: None

    def connect(self, send: Callable[[bytes], None]) -> None:
        self._send = send

    def receive_data(self, data: bytes) -> None:
        self._broken = data == b"break"

    async def run(self) -> None:
        async for time_s in bursts(10.0, 0.1):
            if self._broken:
                msg = "the firmware has a defect"
                raise RuntimeError(msg)
            self._send(self._sensing.sense(time_s, 0.1).rate_rad_s.tobytes())


def settings(latitude_rad: float, noise: NoiseLevels, seed: int = 1) -> WorldSettings:
    return WorldSettings(Truth(latitude_rad, 0.8, 0.0, 0.0), noise, noise, 1e-5, False, seed)


def world(seed: int = 1) -> World:
    made = World(settings(0.7, NoiseLevels(white_sqrt_s=1e-6), seed))
    for name in ("gyro", "accelerometer"):
        made.add_sensor(name, Reporter, Mounting("x"))
    return made


def record(name: str, seed: int) -> bytes:
    """Return the first second of a device's bytes."""

    async def session() -> bytes:
        made = world(seed)
        link = made.link(name)
        await link.open()
        await made.start()
        await asyncio.sleep(1.01)
        await made.stop()
        await asyncio.sleep(1.0)
        return (await link.read(1.0)).data

    return run_virtual(session())


def test_devices_live_from_start_to_stop() -> None:
    rate = np.frombuffer(record("gyro", seed=1)).reshape(-1, 3)
    assert len(rate) == 10


def test_equal_seeds_give_equal_worlds_bit_for_bit_and_others_do_not() -> None:
    assert record("gyro", seed=1) == record("gyro", seed=1) != record("gyro", seed=2)
    assert world(1).plate.angle_at(0.0) == world(1).plate.angle_at(0.0)
    assert world(1).plate.angle_at(0.0) != world(2).plate.angle_at(0.0)


def test_each_sensor_has_noise_of_its_own() -> None:
    assert record("gyro", seed=1) != record("accelerometer", seed=1)


def test_a_wires_faults_are_reached_by_its_name() -> None:
    made = world()
    made.link("gyro")
    made.link("accelerometer")
    made.faults("gyro").silent = True
    assert not made.faults("accelerometer").silent


def test_a_changed_world_is_felt_from_the_next_burst_on() -> None:
    still = NoiseLevels()

    async def session() -> tuple[FloatArray, FloatArray]:
        made = world()
        made.change(settings(0.7, still))
        link = made.link("gyro")
        await link.open()
        await made.start()
        await asyncio.sleep(0.51)
        made.change(settings(0.0, NoiseLevels(bias=1.0)))
        await asyncio.sleep(0.5)
        await made.stop()
        rate = np.frombuffer((await link.read(1.0)).data).reshape(-1, 3)
        return rate[:5], rate[5:]

    before, after = run_virtual(session())
    up = EARTH_RATE_RAD_S * np.sin(0.7)
    assert before[:, 2] == pytest.approx(np.full(5, up))
    assert after[:, 2] == pytest.approx(np.full(5, 1.0))  # on the equator none of it points up


def test_a_device_that_crashed_says_so_when_the_world_is_stopped() -> None:
    async def session() -> None:
        made = world()
        link = made.link("gyro")
        await link.open()
        await made.start()
        await link.write(b"break")
        await asyncio.sleep(1.0)
        with pytest.raises(RuntimeError, match="the firmware has a defect"):
            await made.stop()
        await made.stop()

    run_virtual(session())
