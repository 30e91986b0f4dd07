"""A minute of a gyro and an inclinometer on python-can's `virtual` bus, in wall time."""

import asyncio
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import Any

from northfinder.config import AccelerometerConfig, GyroConfig, RigConfig, TurntableConfig
from northfinder.proof.figure import Figure
from northfinder.proof.serial_load import count_lost
from northfinder.wiring import serve_simulation, serving_loop
from northfinder.wiring.can import CanBuses, can_settings
from northfinder.wiring.defaults import with_latitude

_BUS = "virtual:northfinder-can-load"
_NODE = 6
_CONFIG = RigConfig(
    turntable=TurntableConfig(driver="cia402"),
    gyro=GyroConfig(
        driver="dbc",
        file="northfinder-fog.dbc",
        message="FOG_RATE",
        signal="rate",
        counter="counter",
        status="status",
        checksum="crc",
    ),
    accelerometer=AccelerometerConfig(driver="cia410"),
)
_Loop = asyncio.AbstractEventLoop


def can_load(duration_s: float = 60.0) -> Iterator[Figure]:
    """Read a DBC gyro at 1 kHz and a CiA 410 inclinometer at 100 Hz, with checksum and SYNC.

    That bus is within one process, so the instruments are in a thread of it. The processor time
    is the process's without that thread's: drivers, codecs, the link and its reader, and the
    reader at the instruments' end too.
    """
    with _simulated_instruments() as loop:
        lost, share = asyncio.run(_load(loop, duration_s))
    of_load = f"{duration_s:g} s of DBC gyro and CiA 410 on virtual"
    yield Figure(f"{of_load}: samples lost", float(lost), "samples", None, 0.0)
    yield Figure(f"{of_load}: processor", 100.0 * share, "% of one core", None, 30.0)


async def _load(instruments: _Loop, duration_s: float) -> tuple[int, float]:
    # Not above: python-can and cantools take half a second, and the command line imports this.
    from drivers.cia410 import Cia410  # noqa: PLC0415
    from drivers.dbc import Dbc  # noqa: PLC0415

    buses, link = CanBuses(), f"can:{_BUS}"
    settings = can_settings("gyro", _CONFIG.gyro, with_latitude(_CONFIG))
    sensors = (
        Dbc.configured(buses.port("gyro", link), settings),
        Cia410(buses.port("accelerometer", link), _NODE),
    )
    try:
        for sensor in sensors:
            await sensor.open()
        start_s, start_cpu_s = time.perf_counter(), await _processor_s(instruments)
        lost = await asyncio.gather(*(count_lost(sensor, duration_s) for sensor in sensors))
        elapsed_s = time.perf_counter() - start_s
        share = (await _processor_s(instruments) - start_cpu_s) / elapsed_s
    finally:
        for sensor in sensors:
            await sensor.close()
    return sum(lost), share


async def _processor_s(instruments: _Loop) -> float:
    """Return the processor time of this process without that of the instruments' thread."""
    theirs = asyncio.run_coroutine_threadsafe(_of_this_thread_s(), instruments)
    return time.process_time() - await asyncio.wrap_future(theirs)


async def _of_this_thread_s() -> float:
    return time.thread_time()


@contextmanager
def _simulated_instruments() -> Iterator[_Loop]:
    """Serve the simulated instruments from a thread of their own; yields its loop."""
    ready: Future[Any] = Future()
    with ThreadPoolExecutor(1, "instruments") as pool:
        served: Future[Any] = pool.submit(_serve, ready)
        wait([ready, served], return_when=FIRST_COMPLETED)
        if not ready.done():
            served.result()  # raises why not
        loop, stop = ready.result()
        try:
            yield loop
        finally:
            loop.call_soon_threadsafe(stop.set)
            served.result()


def _serve(ready: Future[Any]) -> None:
    async def live() -> None:
        stop = asyncio.Event()
        async with serve_simulation(_CONFIG, "tcp", _BUS):
            ready.set_result((asyncio.get_running_loop(), stop))
            await stop.wait()

    with asyncio.Runner(loop_factory=serving_loop(_CONFIG)) as runner:
        runner.run(live())
