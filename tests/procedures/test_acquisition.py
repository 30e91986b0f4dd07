"""Settling and collecting: nothing of the motion gets in, and what is missing is counted."""

import asyncio
import math
from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from drivers.errors import DeviceFaultError, LinkTimeoutError
from drivers.interfaces import InertialSensor, SampleBlock
from northfinder.errors import AcquisitionError
from northfinder.procedures.acquisition import collect, settle
from northfinder.rig import Rig, SensingAxis
from northfinder.samples import Samples
from northfinder.units import DEG_PER_HOUR
from northfinder.wiring import build_rig
from sim.motion import Ringing
from tests.procedures.rigs import config_of, virtually, world_of

PERIOD_S = 0.01


@dataclass
class Sensor:
    """As much of an instrument as collecting asks for."""

    sample_period_s: float = PERIOD_S
    link_name: str = "sim:gyro"


@dataclass
class Recording:
    """A listener that plays blocks back, and is silent afterwards."""

    blocks: list[SampleBlock]

    async def next(self, timeout_s: float) -> SampleBlock:
        if not self.blocks:
            msg = f"silent for {timeout_s:g} s"
            raise LinkTimeoutError(msg)
        return self.blocks.pop(0)


def block(ticks: list[int], invalid: tuple[int, ...] = ()) -> SampleBlock:
    tick = np.array(ticks)
    vectors = np.repeat(tick[:, np.newaxis], 3, axis=1).astype(float)
    valid = np.repeat(~np.isin(tick, invalid)[:, np.newaxis], 3, axis=1)
    temperature = np.full(len(tick), np.nan)
    return SampleBlock(tick, tick * PERIOD_S, vectors, vectors, valid, valid, temperature)


def collected(start_s: float, duration_s: float, *blocks: SampleBlock) -> Samples:
    axis = SensingAxis(cast("InertialSensor", Sensor()), "rate", 0, 1.0, 1e-6)
    return asyncio.run(collect(axis, Recording(list(blocks)), start_s, duration_s))


def test_exactly_the_share_of_device_time_is_taken_however_the_blocks_are_cut() -> None:
    whole = collected(0.095, 0.2, block(list(range(100))))
    pieces = [block(list(range(k, min(k + 7, 100)))) for k in range(0, 100, 7)]
    for samples in (whole, collected(0.095, 0.2, *pieces)):
        assert samples.tick.tolist() == list(range(10, 30))
        assert samples.expected == 20


def test_lost_samples_are_counted_and_do_not_lengthen_the_visit() -> None:
    came = [k for k in range(40) if k not in (12, 13, 29)]
    samples = collected(0.1, 0.2, block(came))
    assert (samples.tick[0], samples.tick[-1]) == (10, 28)
    assert samples.lost == 3


def test_a_last_sample_that_is_lost_ends_the_visit_with_the_next_that_comes() -> None:
    samples = collected(0.1, 0.2, block(list(range(29))), block([35, 36]))
    assert samples.tick[-1] == 28
    assert samples.lost == 1


def test_invalid_samples_are_kept_and_counted_but_not_averaged() -> None:
    samples = collected(0.1, 0.2, block(list(range(40)), invalid=(10, 29)))
    assert (len(samples), samples.invalid, samples.lost) == (20, 2, 0)
    assert samples.mean == pytest.approx(np.mean(range(11, 29)))


def test_a_visit_with_less_than_half_of_its_samples_is_refused_with_the_counts() -> None:
    with pytest.raises(AcquisitionError, match=r"only 9 of 20 samples .* \(1 lost, 10 marked inv"):
        collected(0.1, 0.2, block([*range(10, 29), 40], invalid=tuple(range(19, 29))))


def test_an_instrument_that_falls_silent_ends_the_visit() -> None:
    with pytest.raises(LinkTimeoutError):
        collected(0.1, 0.2, block(list(range(20))))


async def settled_at(rig: Rig, ringing: Ringing, settle_s: float) -> tuple[float, float]:
    """Return how long after the move it settled, and the plate's fastest tenth of a second then."""
    async with rig:
        plate = world_of(rig).plate
        plate._ringing = ringing
        await rig.home()
        await rig.move_to(math.pi / 2)
        loop = asyncio.get_running_loop()
        arrived_s = loop.time()
        async with rig.gyro.sensor.listen() as rates:
            begin_s = await settle(rig, rates, settle_s)
            await asyncio.sleep(1.0)
        after_s = np.arange(begin_s, begin_s + 0.9, 0.001)
        turned_rad = plate.angle_rad(after_s + 0.1) - plate.angle_rad(after_s)
        return begin_s - arrived_s, float(np.max(np.abs(turned_rad))) / 0.1


def test_a_steady_cruise_is_no_rest_however_late_its_samples_come() -> None:
    """Over a slow link samples of the move arrive after the table stopped."""

    async def settled_in_motion() -> None:
        async with build_rig(config_of()) as rig:
            await rig.home()
            move = asyncio.create_task(rig.move_to(20 * math.pi))
            await asyncio.sleep(1.0)
            async with rig.gyro.sensor.listen() as rates:
                with pytest.raises(AcquisitionError, match=r"the gyro turns at 120 deg/s"):
                    await settle(rig, rates, 0.0)
            await rig.stop()
            with pytest.raises(DeviceFaultError):
                await move

    virtually(config_of(), settled_in_motion())


@pytest.mark.parametrize("damping_ratio", [0.2, 0.05, 0.02])
def test_it_settles_only_after_the_ringing_has_ended(damping_ratio: float) -> None:
    """Of what is left, a milliradian of misalignment shows 0.04 deg/h for a tenth of a second."""
    config = config_of()
    ringing = Ringing(damping_ratio=damping_ratio, share=1.0)
    _, rate_rad_s = virtually(config, settled_at(build_rig(config), ringing, 0.0))
    assert rate_rad_s < 40.0 * DEG_PER_HOUR


def test_it_settles_at_once_where_nothing_rings_but_waits_as_told() -> None:
    config, still = config_of(), Ringing(share=0.0)
    at_once_s, _ = virtually(config, settled_at(build_rig(config), still, 0.0))
    as_told_s, _ = virtually(config, settled_at(build_rig(config), still, 2.0))
    assert at_once_s < 0.5
    assert as_told_s == pytest.approx(2.0, abs=0.1)


def test_a_table_that_never_settles_is_refused_and_says_what_to_look_for() -> None:
    config, endless = config_of(), Ringing(damping_ratio=1e-4, share=1.0)
    with pytest.raises(
        AcquisitionError, match=r"not settled 10 s after .* at (89|90)\.\d\d deg.*vibrat"
    ):
        virtually(config, settled_at(build_rig(config), endless, 0.0))
