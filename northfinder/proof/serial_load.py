"""A minute of both sensors at full rate through real pseudo-terminals, in wall time."""

import asyncio
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from drivers.interfaces import InertialSensor
from drivers.kvh import Kvh
from drivers.links.serial import SerialLink
from drivers.stim300 import Stim300
from northfinder.proof.figure import Figure
from northfinder.proof.processes import simulated_instruments

_SENSORS: dict[str, type[Kvh] | type[Stim300]] = {"gyro": Kvh, "accelerometer": Stim300}


def serial_load(duration_s: float = 60.0) -> Iterator[Figure]:
    """Read KVH format A at 1 kHz and STIM300 at 500 Hz; the instruments are another process.

    The processor time is this process's own: drivers, links and codecs.
    """
    lost, share = asyncio.run(_load(duration_s))
    of_load = f"{duration_s:g} s of KVH and STIM300 on ptys"
    yield Figure(f"{of_load}: samples lost", float(lost), "samples", None, 0.0)
    yield Figure(f"{of_load}: processor", 100.0 * share, "% of one core", None, 25.0)


async def _load(duration_s: float) -> tuple[int, float]:
    with tempfile.TemporaryDirectory() as folder:
        async with simulated_instruments(Path(folder)) as links:
            return await _read(links, duration_s)


async def _read(links: dict[str, str], duration_s: float) -> tuple[int, float]:
    sensors: list[InertialSensor] = [
        await driver(SerialLink(links[role], driver.baudrate)).open()
        for role, driver in _SENSORS.items()
    ]
    try:
        start_s, start_cpu_s = time.perf_counter(), time.process_time()
        counts = await asyncio.gather(*(count_lost(sensor, duration_s) for sensor in sensors))
        elapsed_s = time.perf_counter() - start_s
        share = (time.process_time() - start_cpu_s) / elapsed_s
    finally:
        for sensor in sensors:
            await sensor.close()
    return sum(counts), share


async def count_lost(sensor: InertialSensor, duration_s: float) -> int:
    """Listen for that much device time, and return how many of its samples did not come."""
    expected, came, first = round(duration_s / sensor.sample_period_s), 0, None
    async with sensor.listen() as listener:
        while True:
            block = await listener.next(timeout_s=2.0)
            first = int(block.tick[0]) if first is None else first
            came += int((block.tick < first + expected).sum())
            if block.tick[-1] >= first + expected - 1:
                return expected - came
