"""What the page sees of an open rig: numbers that are right, and plain words when they stop."""

import asyncio
import math
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

import pytest

from drivers.errors import DeviceFaultError
from northfinder.rig import JsonObject, Rig
from northfinder.telemetry import RigTelemetry
from northfinder.units import DEG
from northfinder.wiring import build_rig
from tests.procedures.rigs import config_of, virtually, world_of

T = TypeVar("T")
LEAST_WAIT_S = 0.001


def watching(use: Callable[[Rig, RigTelemetry], Awaitable[T]], **sections: dict[str, Any]) -> T:
    config = config_of(**sections)

    async def run() -> T:
        async with build_rig(config) as rig, RigTelemetry(rig) as telemetry:
            return await use(rig, telemetry)

    return virtually(config, run())


async def seen(telemetry: RigTelemetry, role: str) -> JsonObject:
    devices = (await telemetry.snapshot())["devices"]
    return next(device for device in devices if device["role"] == role)


def test_a_rig_at_rest_shows_what_the_earth_makes_its_sensors_read() -> None:
    async def use(rig: Rig, telemetry: RigTelemetry) -> JsonObject:
        await rig.home()
        await asyncio.sleep(3.0)
        return await telemetry.snapshot()

    snapshot = watching(use, accelerometer={"driver": "kvh"})
    table, (turntable, gyro, accelerometer) = snapshot["table"], snapshot["devices"]
    assert table == {
        "angle_deg": pytest.approx(0.0, abs=0.001),
        "moving": False,
        "homed": True,
        "target_deg": None,
    }
    assert turntable["identity"]["vendor"] == "Zaber"
    assert [device["state"] for device in (turntable, gyro, accelerometer)] == ["ok"] * 3
    # Azimuth 48, pitch 0.8, latitude 40, bias 0.3 deg/h; 0.2 s of noise is 0.13 deg/h.
    cos, sin = math.cos, math.sin
    north, up = cos(40 * DEG) * cos(48 * DEG) * cos(0.8 * DEG), sin(40 * DEG) * sin(0.8 * DEG)
    assert gyro["reading"] == pytest.approx(15.041 * (north + up) + 0.3, abs=0.6)
    assert gyro["reading_unit"] == "deg/h"
    assert accelerometer["reading"] == pytest.approx(sin(0.8 * DEG), abs=1e-3)
    assert accelerometer["reading_unit"] == "g"
    assert gyro["rate_hz"] == pytest.approx(1000.0, rel=1e-6)
    assert gyro["temperature_deg_c"] == 23.0
    assert gyro["counters"]["frames"] > 3000


def test_a_move_shows_where_the_table_is_and_where_it_goes() -> None:
    async def use(rig: Rig, telemetry: RigTelemetry) -> list[JsonObject]:
        await rig.home()
        move = asyncio.create_task(rig.move_to(90.0 * DEG))
        tables = []
        while not move.done():
            await asyncio.sleep(0.05)
            tables.append((await telemetry.snapshot())["table"])
        return tables

    tables = watching(use, turntable={"positive_direction": "clockwise"})
    assert [table["angle_deg"] for table in tables] == sorted(t["angle_deg"] for t in tables)
    assert [table["target_deg"] for table in tables[:-2]] == [90.0] * (len(tables) - 2)
    assert tables[0]["moving"]
    assert tables[-1] == {
        "angle_deg": pytest.approx(90.0, abs=0.001),
        "moving": False,
        "homed": True,
        "target_deg": None,
    }


def test_a_silent_gyro_says_so_hides_its_numbers_and_comes_back_by_itself() -> None:
    async def use(rig: Rig, telemetry: RigTelemetry) -> list[JsonObject]:
        await asyncio.sleep(1.0)
        world_of(rig).faults("gyro").silent = True
        await asyncio.sleep(5.0)
        states = [await seen(telemetry, "gyro"), await seen(telemetry, "accelerometer")]
        world_of(rig).faults("gyro").silent = False
        await asyncio.sleep(5.0)
        return [*states, await seen(telemetry, "gyro")]

    silent, other, back = watching(use)
    assert silent["state"] == "silent"
    assert silent["detail"] == "KVH on sim:gyro has been silent for 1 s; check power and cable"
    assert (silent["reading"], silent["temperature_deg_c"], silent["rate_hz"]) == (None, None, 0.0)
    assert (other["state"], other["rate_hz"]) == ("ok", pytest.approx(500.0, rel=1e-6))
    assert (back["state"], back["detail"]) == ("ok", None)
    assert back["rate_hz"] == pytest.approx(1000.0, rel=0.01)
    assert back["counters"]["reconnects"] == 1


def test_an_unplugged_accelerometer_is_offline_after_the_grace_time_until_it_is_back() -> None:
    async def use(rig: Rig, telemetry: RigTelemetry) -> list[str]:
        link = world_of(rig)._wires["accelerometer"].link
        states = []
        for act, wait_s in ((link.unplug, 3.0), (None, 10.0), (link.plug_in, 5.0)):
            if act is not None:
                act()
            await asyncio.sleep(wait_s)
            states.append((await seen(telemetry, "accelerometer"))["state"])
        return states

    assert watching(use) == ["silent", "offline", "ok"]


def test_a_table_that_does_not_answer_hides_nothing_else_and_holds_nobody_up() -> None:
    async def use(rig: Rig, telemetry: RigTelemetry) -> tuple[float, JsonObject, JsonObject]:
        loop = asyncio.get_running_loop()
        world_of(rig).faults("turntable").silent = True
        longest_s, silent = 0.0, await telemetry.snapshot()
        for _ in range(20):
            await asyncio.sleep(0.1)
            asked_s = loop.time()
            silent = await telemetry.snapshot()
            longest_s = max(longest_s, loop.time() - asked_s)
        world_of(rig).faults("turntable").silent = False
        await asyncio.sleep(1.0)
        await telemetry.snapshot()
        return longest_s, silent, await telemetry.snapshot()

    longest_s, silent, back = watching(use)
    assert longest_s < 0.2
    assert silent["table"] is None
    assert silent["devices"][0]["state"] == "silent"
    assert silent["devices"][0]["detail"].endswith("check its power and its cable.")
    assert silent["devices"][1]["state"] == "ok"
    assert back["devices"][0]["state"] == "ok"
    assert not back["table"]["moving"]


def test_a_fault_is_shown_and_still_ends_the_move_that_it_befell() -> None:
    async def use(rig: Rig, telemetry: RigTelemetry) -> list[JsonObject]:
        await rig.home()
        world_of(rig).plate.block_at(50.0 * DEG)
        move = asyncio.create_task(rig.move_to(90.0 * DEG))
        shown = []
        while not move.done():
            await asyncio.sleep(LEAST_WAIT_S)
            shown.append(await seen(telemetry, "turntable"))
        with pytest.raises(DeviceFaultError, match="FS, stalled and stopped, at 50 deg"):
            await move
        return shown

    faults = [device for device in watching(use) if device["state"] == "fault"]
    assert faults
    assert "FS, stalled and stopped, at 50 deg" in faults[0]["detail"]


def test_one_instrument_in_two_roles_is_shown_twice_and_heard_once() -> None:
    async def use(_: Rig, telemetry: RigTelemetry) -> tuple[int, list[JsonObject]]:
        await asyncio.sleep(1.0)
        listening = [t for t in asyncio.all_tasks() if t.get_name().startswith("telemetry of")]
        return len(listening), (await telemetry.snapshot())["devices"]

    tasks, devices = watching(use, accelerometer={"from": "gyro"})
    assert tasks == 1
    assert [device["role"] for device in devices] == ["turntable", "gyro", "accelerometer"]
    assert [device["link"] for device in devices[1:]] == ["sim:gyro"] * 2
    assert [device["reading_unit"] for device in devices[1:]] == ["deg/h", "g"]


def test_many_who_ask_at_a_time_share_one_question_to_the_table() -> None:
    async def use(rig: Rig, telemetry: RigTelemetry) -> int:
        world_of(rig).faults("turntable").delay_s = 0.02
        before = int((await seen(telemetry, "turntable"))["counters"]["frames"])
        await asyncio.gather(*(telemetry.snapshot() for _ in range(50)))
        return int((await seen(telemetry, "turntable"))["counters"]["frames"]) - before

    assert watching(use) <= 3  # 'get pos' twice, and 'warnings' where a flag hides the reference


def test_closing_leaves_nothing_running() -> None:
    async def run() -> int:
        async with build_rig(config_of()) as rig:
            before = len(asyncio.all_tasks())
            async with RigTelemetry(rig) as telemetry:
                world_of(rig).faults("turntable").silent = True
                await telemetry.snapshot()  # its question is still out
            world_of(rig).faults("turntable").silent = False
            return len(asyncio.all_tasks()) - before

    assert virtually(config_of(), run()) == 0
