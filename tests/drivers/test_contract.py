"""What every driver keeps: over memory in virtual time, over a real pty, and on hardware.

On hardware, with KVH=/dev/ttyUSB0, STIM300=... and ZABER=... naming the ports that there are:
``pytest -m hardware tests/drivers/test_contract.py``. The table homes and turns by 20 deg.
"""

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any, TypeVar

import numpy as np
import pytest

from drivers.errors import DeviceFaultError
from drivers.interfaces import InertialSensor, Link, SampleBlock, Turntable
from drivers.kvh import Kvh
from drivers.links.serial import SerialLink
from drivers.stim300 import Stim300
from drivers.zaber import Zaber
from sim.bench import Mounting
from sim.clock import run_virtual
from sim.devices.kvh import SimulatedKvh
from sim.devices.stim300 import SimulatedStim300
from sim.devices.zaber import SimulatedZaber
from sim.noise import NoiseLevels
from sim.truth import Truth
from sim.world import World, WorldSettings

DEG = np.pi / 180
DRIVERS: dict[str, Any] = {"kvh": Kvh, "stim300": Stim300, "zaber": Zaber}
TRANSPORTS = [
    "memory",
    pytest.param(
        "pty",
        marks=pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX"),
    ),
    pytest.param("hardware", marks=pytest.mark.hardware),
]
over_every_transport = pytest.mark.parametrize("transport", TRANSPORTS)
of_every_sensor = pytest.mark.parametrize("name", ["kvh", "stim300"])

T = TypeVar("T")


def world() -> World:
    settings = WorldSettings(
        truth=Truth(40 * DEG, 48 * DEG, 0.0, 0.0),
        gyro=NoiseLevels(white_sqrt_s=5e-7),
        accelerometer=NoiseLevels(white_sqrt_s=1e-5),
        table_sigma_rad=0.0,
        clockwise=False,
        seed=3,
    )
    made = World(settings)
    made.add_sensor("kvh", SimulatedKvh, Mounting("x"))
    made.add_sensor("stim300", SimulatedStim300, Mounting("y"))
    made.add_table("zaber", SimulatedZaber)
    return made


@asynccontextmanager
async def link_to(name: str, transport: str) -> AsyncIterator[Link]:
    baudrate = DRIVERS[name].baudrate
    if transport == "hardware":
        port = os.environ.get(name.upper())
        if port is None:
            pytest.skip(f"{name.upper()} names no port")
        yield SerialLink(port, baudrate)
        return
    simulated = world()
    await simulated.start()
    try:
        if transport == "memory":
            yield simulated.link(name)
        else:
            from sim.pty import serve_on_pty  # noqa: PLC0415 - absent on Windows

            async with serve_on_pty(simulated.devices[name]) as path:
                yield SerialLink(path, baudrate)
    finally:
        await simulated.stop()


def using(name: str, transport: str, use: Callable[[Link], Awaitable[T]]) -> T:
    async def run() -> T:
        async with link_to(name, transport) as link:
            return await use(link)

    return run_virtual(run()) if transport == "memory" else asyncio.run(run())


async def samples(sensor: InertialSensor, count: int) -> list[SampleBlock]:
    blocks: list[SampleBlock] = []
    async with sensor.listen() as listener:
        while sum(map(len, blocks)) < count:
            blocks.append(await listener.next(timeout_s=2.0))
    return blocks


@over_every_transport
@of_every_sensor
def test_a_sensor_streams_what_the_earth_makes_it_feel(name: str, transport: str) -> None:
    async def use(link: Link) -> tuple[Any, list[SampleBlock]]:
        sensor = await DRIVERS[name](link).open()
        try:
            await samples(sensor, round(0.5 / sensor.sample_period_s))  # it may be starting up
            return sensor, await samples(sensor, round(1.0 / sensor.sample_period_s))
        finally:
            await sensor.close()

    sensor, blocks = using(name, transport, use)
    assert sensor.identity.serial_number
    assert (sensor.counters.lost, sensor.counters.crc_errors) == (0, 0)
    ticks = np.concatenate([block.tick for block in blocks])
    assert np.all(np.diff(ticks) == 1)
    times_s = np.concatenate([block.time_s for block in blocks])
    assert np.polyfit(ticks, times_s, 1)[0] == pytest.approx(sensor.sample_period_s, rel=0.02)
    force_g = np.concatenate([block.specific_force_g for block in blocks])
    assert np.linalg.norm(force_g.mean(axis=0)) == pytest.approx(1.0, abs=0.02)
    rate_rad_s = np.concatenate([block.rate_rad_s for block in blocks])
    assert np.all(np.abs(rate_rad_s.mean(axis=0)) < 1e-3)  # the Earth's is 7e-5
    assert all(block.rate_valid.all() and block.force_valid.all() for block in blocks)


@over_every_transport
@of_every_sensor
def test_a_sensor_can_be_opened_again_and_listened_to_twice(name: str, transport: str) -> None:
    async def use(link: Link) -> tuple[list[int], list[int]]:
        await (await DRIVERS[name](link).open()).close()
        sensor = await DRIVERS[name](link).open()
        try:
            both = await asyncio.gather(samples(sensor, 50), samples(sensor, 50))
        finally:
            await sensor.close()
        first, second = ([int(t) for block in part for t in block.tick] for part in both)
        return first, second

    first, second = using(name, transport, use)
    assert first == second


@over_every_transport
def test_a_table_homes_turns_and_stands_where_it_was_sent(transport: str) -> None:
    async def use(link: Link) -> list[float]:
        table: Turntable = await Zaber(link).open()
        try:
            angles = [(await table.home()).angle_rad]
            for target_deg in (20.0, 5.0, 20.0):
                state = await table.move_to(target_deg * DEG)
                assert state.homed
                assert not state.moving
                angles.append(state.angle_rad / DEG)
            return angles
        finally:
            await table.close()

    assert using("zaber", transport, use) == pytest.approx([0.0, 20.0, 5.0, 20.0], abs=0.01)


@over_every_transport
def test_a_move_that_is_stopped_says_so_and_the_table_stands(transport: str) -> None:
    async def use(link: Link) -> None:
        table = await Zaber(link).open()
        try:
            if not (await table.state()).homed:
                await table.home()
            move = asyncio.create_task(table.move_to(170 * DEG))
            while not (await table.state()).moving:  # noqa: ASYNC110 - the table has no event
                await asyncio.sleep(0.01)
            await table.stop()
            with pytest.raises(DeviceFaultError, match="stopped"):
                await move
            assert not (await table.state()).moving
        finally:
            await table.close()

    using("zaber", transport, use)
