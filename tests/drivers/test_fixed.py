"""A rig without a table aligns; it refuses to seek north, and says why."""

import asyncio
from typing import Any

import pytest

from drivers.errors import DeviceFaultError
from drivers.fixed import FixedMount
from northfinder.errors import ConfigError
from northfinder.procedures.alignment import Plan
from tests.procedures.rigs import config_of, seek, sigmas_off

IN_A_VEHICLE: dict[str, Any] = {
    "turntable": {"driver": "fixed"},
    "simulation": {"base": "nominal", "gyro_bias_deg_h": 0.01, "accel_noise_g_sqrt_hz": 5e-6},
}


def test_it_aligns_without_a_table() -> None:
    result = seek(Plan(duration_s=60.0), **IN_A_VEHICLE).completed
    assert sigmas_off(result, 48.0) < 4.0


def test_a_north_seek_is_refused() -> None:
    assert "align instead" in seek(**IN_A_VEHICLE).reason


def test_it_has_no_link() -> None:
    with pytest.raises(ConfigError, match="a fixed mount has no link"):
        config_of(turntable={"driver": "fixed", "link": "/dev/ttyUSB0"})


def test_it_stands() -> None:
    async def session() -> None:
        mount = await FixedMount().open()
        states = [await mount.state(), await mount.observe(), await mount.home()]
        assert {(state.angle_rad, state.homed, state.moving) for state in states} == {
            (0.0, True, False)
        }
        await mount.stop()
        with pytest.raises(DeviceFaultError, match="this rig has no table"):
            await mount.move_to(1.0)
        await mount.close()

    asyncio.run(session())
