"""The gyro's word on how the table turned, from whole runs."""

import math
from dataclasses import fields

import numpy as np
import pytest

from drivers.interfaces import FloatArray, SampleBlock
from northfinder.procedures.events import Event
from northfinder.procedures.north_seek import run
from northfinder.procedures.reduction import NorthSeek
from northfinder.procedures.turning import TurnMeter
from northfinder.wiring import build_rig
from sim.world import World
from tests.procedures.rigs import SHORT, Meanwhile, config_of, virtually, world_of

PERIOD_S = 0.01
UP_G = np.array([0.0, 0.0, 1.0])


def block(rate_z_rad_s: FloatArray, force_g: FloatArray = UP_G, first_tick: int = 1) -> SampleBlock:
    k = len(rate_z_rad_s)
    tick = np.arange(first_tick, first_tick + k)
    time_s = tick.astype(np.float64) * PERIOD_S
    rates = np.stack([np.zeros(k), np.zeros(k), rate_z_rad_s], axis=1)
    valid = np.ones((k, 3), dtype=bool)
    forces = np.tile(force_g, (k, 1))
    return SampleBlock(tick, time_s, rates, forces, valid, valid, np.full(k, 23.0))


def turned(*blocks: SampleBlock) -> float | None:
    meter = TurnMeter(PERIOD_S, 0.0)
    for each in blocks:
        meter.add(each)
    return meter.finish()


MOVE = np.concatenate([np.zeros(5), np.full(100, 0.5), np.zeros(50)])


@pytest.mark.parametrize(("force_g", "sign"), [(UP_G, 1.0), (-UP_G, -1.0)])
def test_the_rate_adds_up_to_the_angle_about_the_upward_vertical(
    force_g: FloatArray, sign: float
) -> None:
    assert turned(block(MOVE, force_g)) == pytest.approx(sign * 0.5)


def test_a_bias_is_known_from_the_rest_and_does_not_count() -> None:
    assert turned(block(MOVE + 0.01)) == pytest.approx(0.5)


def test_a_few_lost_frames_do_no_harm() -> None:
    whole = block(MOVE)
    kept = np.arange(len(MOVE)) % 20 != 7
    columns = (getattr(whole, field.name)[kept] for field in fields(SampleBlock))
    assert turned(SampleBlock(*columns)) == pytest.approx(0.5, rel=0.01)


def test_it_tells_nothing_of_samples_that_it_did_not_hear() -> None:
    assert turned() is None
    assert turned(block(MOVE), block(MOVE, first_tick=300)) is None
    assert turned(block(MOVE, np.full(3, np.nan))) is None
    assert turned(block(np.where(MOVE > 0, np.nan, MOVE))) is None


def test_what_comes_after_it_was_asked_or_was_sampled_before_does_not_count() -> None:
    meter = TurnMeter(PERIOD_S, 0.1)
    meter.add(block(np.concatenate([np.full(10, 9.0), MOVE])))
    assert meter.finish() == pytest.approx(0.5)
    meter.add(block(MOVE, first_tick=166))
    assert meter.finish() == pytest.approx(0.5)


def seek(meanwhile: Meanwhile, **gyro: object) -> NorthSeek:
    config = config_of(gyro=gyro)

    async def find() -> NorthSeek:
        rig = build_rig(config)

        async def emit(event: Event) -> None:
            meanwhile(world_of(rig), event)

        async with rig:
            return await run(rig, SHORT, emit)

    return virtually(config, find())


def table_check(seek: NorthSeek) -> tuple[str, str]:
    return next((check.status, check.detail) for check in seek.checks if check.name == "table")


@pytest.mark.parametrize("axis", ["x", "-y", "z"])
def test_every_move_of_a_run_is_seen_to_a_hundredth_of_a_degree(axis: str) -> None:
    found = seek(lambda _world, _event: None, axis=axis)
    turned_deg = [math.degrees(visit.turned_rad or math.nan) for visit in found.visits[1:]]
    assert turned_deg == pytest.approx([90, 90, 90, 0, -90, -90, -90], abs=0.02)
    assert table_check(found)[0] == "pass"


def test_a_table_mounted_upside_down_is_found_out() -> None:
    def turn_over(world: World, _: Event) -> None:
        world.bench._direction = -1.0

    status, detail = table_check(seek(turn_over))
    assert status == "fail"
    assert "the azimuth is mirrored" in detail


def test_a_plate_that_slips_on_its_motor_is_found_out() -> None:
    """The motor's encoder does not see it: the table reports that it arrived."""

    def loosen(world: World, _: Event) -> None:
        world.bench._direction = 0.97

    status, detail = table_check(seek(loosen))
    assert status == "warn"
    assert "its plate for slip" in detail
