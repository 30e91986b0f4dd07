"""From a configuration to a rig that is not open yet: drivers by name, ports, axes."""

import math
from dataclasses import replace
from functools import partial
from typing import cast

from drivers.interfaces import CanLink, InertialSensor, Instrument, Link, Role, Turntable
from drivers.links.serial import SerialLink
from northfinder.config import LEAST_FORCE_NOISE, LEAST_GYRO_NOISE, RigConfig
from northfinder.errors import ConfigError
from northfinder.plugins import load_driver
from northfinder.ports import (
    SIMULATED,
    AnySection,
    check_ports,
    is_can,
    links,
    shares_the_gyros_port,
)
from northfinder.rig import Rig, SensingAxis
from northfinder.units import DEG_PER_SQRT_HOUR
from northfinder.wiring.can import CanBuses, can_settings, check_dbc
from northfinder.wiring.defaults import with_latitude
from northfinder.wiring.world import SimulatedWorld, build_world
from sim.bench import Mounting
from sim.world import World


def build_rig(config: RigConfig) -> Rig:
    """Make the rig that a configuration describes; nothing is opened yet.

    Raises:
        ConfigError: An unknown driver, a driver in a role that it cannot fill, one port for two
            instruments, an axis that is not in the table's plane, no latitude.
    """
    config = with_latitude(config)
    check_ports(config)
    check_dbc(config)
    world = build_world(config, SIMULATED.__eq__) if SIMULATED in links(config) else None
    buses = CanBuses()
    turntable = cast("Turntable", _instrument("turntable", config, world, buses))
    gyro = cast("InertialSensor", _instrument("gyro", config, world, buses))
    if shares_the_gyros_port(config):
        load_driver("accelerometer", config.gyro.driver)
        _check_axes_of_one_body(config)
        accelerometer = gyro
    else:
        accelerometer = cast("InertialSensor", _instrument("accelerometer", config, world, buses))
    simulation = None if world is None else SimulatedWorld(world, config)
    rig = Rig(
        config,
        turntable,
        SensingAxis(gyro, "rate", *_axis(config.gyro.axis), _gyro_noise(config, gyro)),
        SensingAxis(
            accelerometer,
            "force",
            *_axis(config.accelerometer.axis),
            _accelerometer_noise(config, accelerometer),
        ),
        simulation,
    )
    if simulation is not None:
        simulation.on_change = partial(_adopt, rig)
    return rig


def _adopt(rig: Rig, config: RigConfig) -> None:
    """Let what the rig says and predicts follow a simulation that was changed."""
    gyro, accelerometer = rig.gyro, rig.accelerometer
    gyro_noise = _gyro_noise(config, gyro.sensor)
    accelerometer_noise = _accelerometer_noise(config, accelerometer.sensor)
    rig.config = config
    rig.gyro = replace(gyro, expected_noise_sqrt_s=gyro_noise)
    rig.accelerometer = replace(accelerometer, expected_noise_sqrt_s=accelerometer_noise)


def _check_axes_of_one_body(config: RigConfig) -> None:
    """Refuse directions that the two axes of one instrument cannot have together.

    On hardware either of the remaining axes may point up, and the mounting be known to a degree;
    the simulated instrument stands one way.

    Raises:
        ConfigError: They cannot; the message says at which angles the second may stand.
    """
    gyro, accelerometer = config.gyro, config.accelerometer
    (column, sign), (other, other_sign) = _axis(gyro.axis), _axis(accelerometer.axis)
    if column == other:
        apart_deg = [0.0 if sign == other_sign else 180.0]
    elif gyro.link == SIMULATED:
        right, ahead, up = other_sign * Mounting(gyro.axis).body_axes()[other]
        apart_deg = [] if up else [math.degrees(math.atan2(-right, ahead))]
    else:
        apart_deg = [90.0, -90.0]
    given_deg = accelerometer.mount_angle_deg - gyro.mount_angle_deg
    if any(abs(math.remainder(given_deg - apart, 360.0)) <= 1.0 for apart in apart_deg):
        return
    angles = [f"{(gyro.mount_angle_deg + apart) % 360:g} deg" for apart in apart_deg]
    where = f"stands at {' or '.join(angles)}" if angles else "points up"
    msg = (
        f"[accelerometer] axis = {accelerometer.axis!r}, mount_angle_deg = "
        f"{accelerometer.mount_angle_deg:g}: with the gyro's {gyro.axis} at "
        f"{gyro.mount_angle_deg:g} deg that axis of the same instrument {where}"
    )
    raise ConfigError(msg)


def _instrument(role: Role, config: RigConfig, world: World | None, buses: CanBuses) -> Instrument:
    section: AnySection = getattr(config, role)
    driver = load_driver(role, section.driver)
    if driver.transport == "none":
        return cast("Instrument", driver())
    if driver.transport == "can":
        settings = can_settings(role, section, config)
        return cast(
            "Instrument", driver.configured(_bus(role, section.link, world, buses), settings)
        )
    if is_can(section.link):
        msg = f"[{role}] link = {section.link!r}: the driver {section.driver!r} is not for CAN"
        raise ConfigError(msg)
    return cast("Instrument", driver(_line(role, section.link, world, driver.baudrate)))


def _line(role: Role, link: str, world: World | None, baudrate: int) -> Link:
    if link == SIMULATED and world is not None:
        return world.link(role)
    return SerialLink(link, baudrate)


def _bus(role: Role, link: str, world: World | None, buses: CanBuses) -> CanLink:
    if link == SIMULATED and world is not None:
        return world.can_link(role)
    return buses.port(role, link)


def _axis(axis: str) -> tuple[int, float]:
    return "xyz".index(axis[-1]), -1.0 if axis.startswith("-") else 1.0


def _gyro_noise(config: RigConfig, gyro: InertialSensor) -> float:
    """The figure for predictions: configured, else the simulation's, else the data sheet's."""
    simulated_deg_sqrt_h = config.simulation.gyro_noise_deg_sqrt_h
    if config.gyro.noise_deg_sqrt_h is not None:
        return config.gyro.noise_deg_sqrt_h * DEG_PER_SQRT_HOUR
    if config.gyro.link == SIMULATED and simulated_deg_sqrt_h >= LEAST_GYRO_NOISE:
        return simulated_deg_sqrt_h * DEG_PER_SQRT_HOUR
    return gyro.noise.angle_random_walk_rad_sqrt_s


def _accelerometer_noise(config: RigConfig, accelerometer: InertialSensor) -> float:
    if config.accelerometer.noise_g_sqrt_hz is not None:
        return config.accelerometer.noise_g_sqrt_hz
    simulated_g_sqrt_hz = config.simulation.accel_noise_g_sqrt_hz
    if config.accelerometer.link == SIMULATED and simulated_g_sqrt_hz >= LEAST_FORCE_NOISE:
        return simulated_g_sqrt_hz
    return accelerometer.noise.force_noise_g_sqrt_s
