"""From a configuration to a rig: drivers by name, ports, axes, and which time it lives in."""

import contextlib
import math
from typing import Any

import pytest

from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.wiring import build_rig, event_loop, serving_loop, with_speed
from sim.clock import PacedTimeLoop, ScaledTimeLoop, VirtualTimeLoop
from tests.procedures.rigs import SHORT, config_of, seek, sigmas_off

HARDWARE: dict[str, dict[str, Any]] = {
    "site": {"latitude_deg": 40.0},
    "turntable": {"link": "COM1"},
    "gyro": {"link": "COM2"},
    "accelerometer": {"link": "COM3"},
}
KNOWN_NOISE = {"noise_deg_sqrt_h": 0.001}


def assert_finds_north(**sections: dict[str, Any]) -> None:
    sections["gyro"] = {**KNOWN_NOISE, **sections.get("gyro", {})}
    assert sigmas_off(seek(SHORT, **sections).completed, 48.0) < 4.0


def test_drivers_are_found_by_their_entry_point() -> None:
    rig = build_rig(config_of(**{**HARDWARE, "gyro": {"link": "COM2", "driver": "stim300"}}))
    names = [type(instrument).__name__ for instrument in rig._instruments()]
    assert names == ["Zaber", "Stim300", "Stim300"]


@pytest.mark.parametrize("link", ["sim:", "COM2"])
def test_an_unknown_driver_names_the_nearest(link: str) -> None:
    config = config_of(**{**HARDWARE, "gyro": {"driver": "kvhh", "link": link}})
    with pytest.raises(ConfigError, match=r"\[gyro\] driver = 'kvhh': .*did you mean kvh\?"):
        build_rig(config)


@pytest.mark.parametrize(("role", "driver"), [("gyro", "zaber"), ("turntable", "kvh")])
def test_a_driver_in_a_role_it_cannot_fill_is_refused(role: str, driver: str) -> None:
    with pytest.raises(ConfigError, match=rf"\[{role}\] driver = '{driver}': .* not as {role}"):
        build_rig(config_of(**{**HARDWARE, role: {"driver": driver, "link": "COM9"}}))


def test_one_port_for_two_different_instruments_is_refused() -> None:
    shared = {**HARDWARE, "accelerometer": {"link": "COM2"}}
    with pytest.raises(ConfigError, match=r"\[accelerometer\] link = 'COM2' is the gyro's"):
        build_rig(config_of(**shared))


@pytest.mark.parametrize(
    "accelerometer",
    [{"from": "gyro"}, {"driver": "kvh", "link": "COM2", "axis": "x"}],
    ids=["said outright", "the same port"],
)
def test_one_instrument_may_fill_both_roles(accelerometer: dict[str, Any]) -> None:
    rig = build_rig(config_of(**{**HARDWARE, "accelerometer": accelerometer}))
    assert rig.accelerometer.sensor is rig.gyro.sensor


def test_a_shared_instruments_axis_and_port_are_the_gyros_unless_given() -> None:
    gyro = {"driver": "stim300", "link": "COM7", "axis": "-y", "mount_angle_deg": 12.0}
    shared = config_of(gyro=gyro, accelerometer={"from": "gyro"}).accelerometer
    found = (shared.driver, shared.link, shared.axis, shared.mount_angle_deg)
    assert found == ("stim300", "COM7", "-y", 12.0)
    other = config_of(gyro=gyro, accelerometer={"from": "gyro", "axis": "x"}).accelerometer
    assert (other.axis, other.mount_angle_deg) == ("x", 12.0)


@pytest.mark.parametrize("extra", [{}, {"axis": "y", "mount_angle_deg": 90.0}])
@pytest.mark.parametrize("driver", ["kvh", "stim300"])
def test_one_instrument_in_both_roles_finds_north(driver: str, extra: dict[str, Any]) -> None:
    result = seek(
        SHORT, gyro={"driver": driver, **KNOWN_NOISE}, accelerometer={"from": "gyro", **extra}
    ).completed
    assert sigmas_off(result, 48.0) < 4.0
    assert result["tilt"]["pitch_deg"] == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize("link", ["sim:", "COM2"])
@pytest.mark.parametrize(("axis", "mount_angle_deg"), [("y", 0.0), ("x", 90.0), ("-x", 0.0)])
def test_axes_that_one_instrument_cannot_have_are_refused(
    link: str, axis: str, mount_angle_deg: float
) -> None:
    accelerometer = {"from": "gyro", "axis": axis, "mount_angle_deg": mount_angle_deg}
    config = config_of(
        site={"latitude_deg": 40.0}, gyro={"link": link}, accelerometer=accelerometer
    )
    with pytest.raises(ConfigError, match=r"\[accelerometer\] .* of the same instrument stands at"):
        build_rig(config)


def test_an_axis_that_points_up_feels_no_tilt_and_is_refused() -> None:
    with pytest.raises(ConfigError, match="points up"):
        build_rig(config_of(accelerometer={"from": "gyro", "axis": "z"}))


@pytest.mark.parametrize("axis", ["x", "y", "z", "-x", "-y", "-z"])
@pytest.mark.parametrize("mount_angle_deg", [0.0, -77.0])
def test_every_axis_and_mounting_finds_the_same_north(axis: str, mount_angle_deg: float) -> None:
    assert_finds_north(
        gyro={"axis": axis, "mount_angle_deg": mount_angle_deg},
        accelerometer={"axis": axis, "mount_angle_deg": 2 * mount_angle_deg + 10.0},
    )


def test_a_table_that_counts_clockwise_finds_the_same_north() -> None:
    result = seek(SHORT, turntable={"positive_direction": "clockwise"}, gyro=KNOWN_NOISE).completed
    assert sigmas_off(result, 48.0) < 4.0
    assert [visit["angle_deg"] for visit in result["visits"]][1] == pytest.approx(90.0)


def test_a_simulated_rig_lives_in_virtual_time_and_hardware_in_the_walls() -> None:
    chosen = {
        VirtualTimeLoop: event_loop(RigConfig(), math.inf),
        PacedTimeLoop: event_loop(config_of(simulation={"speed": 20.0}), math.inf),
        ScaledTimeLoop: event_loop(config_of(**HARDWARE, simulation={"speed": 1.0}), math.inf),
    }
    for kind, factory in chosen.items():
        with contextlib.closing(factory()) as loop:
            assert type(loop) is kind
    with contextlib.closing(serving_loop(RigConfig())()) as loop:
        assert type(loop) is ScaledTimeLoop


@pytest.mark.parametrize(
    ("sections", "speed"),
    [({}, 20.0), ({"simulation": {"speed": 3.0}}, 3.0), (HARDWARE, 1.0)],
)
def test_a_speed_is_filled_in_where_none_is_given(sections: dict[str, Any], speed: float) -> None:
    assert with_speed(config_of(**sections), 20.0).simulation.speed == speed


@pytest.mark.parametrize("speed", [2.0, math.inf])
def test_a_speed_is_refused_with_any_hardware(speed: float) -> None:
    config = config_of(turntable={"link": "COM1"}, simulation={"speed": speed})
    with pytest.raises(ConfigError, match="cannot be kept with hardware"):
        event_loop(config, math.inf)


def test_instruments_that_others_talk_to_cannot_run_infinitely_fast() -> None:
    with pytest.raises(ConfigError, match="give a finite one"):
        serving_loop(config_of(simulation={"speed": math.inf}))
