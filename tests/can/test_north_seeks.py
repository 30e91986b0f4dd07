"""Whole north-seeks in wall time; instruments and client share nothing but the kernel's bus."""

import asyncio
import math
import subprocess
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from northfinder.config import RigConfig, load_config
from northfinder.procedures.events import Event
from northfinder.procedures.north_seek import Plan, run
from northfinder.procedures.north_seek_json import north_seek_json
from northfinder.wiring import build_rig, serve_simulation
from tests.can.onlookers import CHANNEL, received
from tests.can.rigs import NOISE_DEG_SQRT_H, result_of, rig, seeking, simulating
from tests.evidence import Record

TRUE_DEG = 48.0
SHORT = ("--order", "sequential", "--json")
LOAD_HZ = 6000  # of 8 bytes: about 80 % of 1 Mbit/s


def sigmas_off(result: dict[str, Any], true_deg: float) -> float:
    off_deg = math.remainder(result["azimuth_deg"] - true_deg, 360.0)
    return abs(off_deg) / float(result["azimuth_sigma_deg"])


def lost(result: dict[str, Any]) -> int:
    """Return how many samples of the visits are missing, or are there twice."""
    return sum(abs(visit["lost"]) for visit in result["visits"])


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.proof) for n in (1, 2))])
def test_a_rig_finds_north(tmp_path: Path, seed: int, record_property: Record) -> None:
    bench = rig(tmp_path)
    plan = ("--positions", "8", "--dwell", "0.5", *SHORT)
    with simulating(bench, "--seed", str(seed)), seeking(bench, *plan) as client:
        result = result_of(client)
    told = f"{sigmas_off(result, TRUE_DEG):.1f} sigma off, {lost(result)} lost"
    record_property("measured", f"seed {seed}: {told}")
    assert sigmas_off(result, TRUE_DEG) < 4.0
    assert result["azimuth_sigma_deg"] < 0.1
    assert lost(result) == 0
    assert [check for check in result["checks"] if check["status"] == "fail"] == []
    gyro, inclinometer = (result["rig"]["devices"][place]["counters"] for place in (1, 2))
    # 1 kHz and 100 Hz; a guest on a slow computer sends fewer SYNCs.
    assert gyro["frames"] / inclinometer["frames"] == pytest.approx(10.0, rel=0.5)


def test_two_rigs_on_one_bus_find_each_its_own_north(tmp_path: Path) -> None:
    """Node numbers and the gyros' addresses tell them apart; there is one producer of SYNC.

    All in one process, each end of each rig with a socket of its own: a guest kernel is slow in
    switching between many.
    """
    found, held_up_s = asyncio.run(_two_norths(tmp_path))
    for result, azimuth_deg in zip(found, (48.0, 251.0), strict=True):
        assert sigmas_off(result, azimuth_deg) < 4.0
        # Neither sensor counts its messages, and both stand still with the computer.
        assert lost(result) <= held_up_s * (100 + 10)


async def _two_norths(folder: Path) -> tuple[list[dict[str, Any]], float]:
    benches = rig(folder, (5, 6), 35), rig(folder, (15, 16), 36)
    noise = {"gyro_noise_deg_sqrt_h": NOISE_DEG_SQRT_H}
    configs = [
        load_config(bench.config, {}, {"simulation": {"azimuth_deg": azimuth_deg, **noise}})
        for bench, azimuth_deg in zip(benches, (48.0, 251.0), strict=True)
    ]
    async with AsyncExitStack() as stack:
        for config in configs:
            served = serve_simulation(config, "pty", f"socketcan:{CHANNEL}")
            await stack.enter_async_context(served)
        # One goes on when the other has left, and its SYNC with it.
        plans = (Plan(positions=n, dwell_s=2, settle_s=0.1, order="sequential") for n in (4, 6))
        pauses_s: list[float] = []
        watching = asyncio.create_task(_watch_for_pauses(pauses_s))
        found = list(await asyncio.gather(*map(_seek, configs, plans)))
        watching.cancel()
        return found, sum(pauses_s)


async def _watch_for_pauses(pauses_s: list[float]) -> None:
    """Note in which pauses the loop did nothing, of those that a driver takes for losses."""
    loop = asyncio.get_running_loop()
    seen_s = loop.time()
    while True:
        await asyncio.sleep(0.02)
        before_s, seen_s = seen_s, loop.time()
        if seen_s - before_s > 0.1:
            pauses_s.append(seen_s - before_s)


async def _seek(config: RigConfig, plan: Plan) -> dict[str, Any]:
    async def ignore(_: Event) -> None: ...

    async with build_rig(config) as bench:
        return north_seek_json(await run(bench, plan, ignore))


@contextmanager
def foreign_load(folder: Path, seconds: int) -> Iterator[None]:
    """Replay J1939-like frames that nobody wants in their own time, each millisecond's at once."""
    log = folder / "load.log"
    with log.open("w") as lines:
        for number in range(LOAD_HZ * seconds):
            stamp_s = 1.7e9 + number // (LOAD_HZ // 1000) / 1000
            lines.write(f"({stamp_s:.6f}) {CHANNEL} {0x18FE0000 + number % 64:08X}#{number:016X}\n")
    with subprocess.Popen(["canplayer", "-I", str(log)]) as player:  # noqa: S607
        try:
            yield
            assert player.poll() is None  # it lasted
        finally:
            player.kill()


@pytest.mark.proof
def test_a_bus_that_others_fill_to_80_percent_loses_nothing(tmp_path: Path) -> None:
    """In the long form: it takes all of the guest's one processor for half a minute.

    That the kernel's filters lose nothing under that load is ``test_vcan``'s, in every run.
    """
    bench = rig(tmp_path)
    with simulating(bench), foreign_load(tmp_path, 60):
        before = received()
        with seeking(bench, "--positions", "4", "--dwell", "0.5", *SHORT) as client:
            result = result_of(client)
        total = received() - before
    own = sum(one["counters"]["frames"] for one in result["rig"]["devices"])
    assert total > 4 * own  # the load was one
    assert sigmas_off(result, TRUE_DEG) < 4.0
    assert lost(result) == 0
