"""The one place that chooses hardware or simulation: from a configuration to a rig."""

import math
import sys
from asyncio import AbstractEventLoop
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from typing import Any, cast

from drivers.interfaces import InertialSensor, Instrument, Link, Role, Turntable
from drivers.links.serial import SerialLink
from northfinder.config import AccelerometerConfig, GyroConfig, RigConfig
from northfinder.errors import ConfigError
from northfinder.plugins import load_driver, load_simulated
from northfinder.ports import SIMULATED, AnySection, check_ports, links, shares_the_gyros_port
from northfinder.rig import Rig, SensingAxis
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_HOUR_PER_HOUR, DEG_PER_SQRT_HOUR
from sim.bench import Mounting
from sim.clock import loop_factory
from sim.interfaces import SimulatedDevice
from sim.noise import NoiseLevels
from sim.tcp import serve_on_tcp
from sim.truth import Truth
from sim.world import World, WorldSettings

_SIMULATED_LATITUDE_DEG = 40.0


def is_simulated(config: RigConfig) -> bool:
    """Return whether every link is simulated, so that time may be virtual."""
    return all(link == SIMULATED for link in links(config))


def event_loop(config: RigConfig, simulated_speed: float) -> Callable[[], AbstractEventLoop]:
    """Choose the loop: virtual or scaled for a simulated rig, wall time with any real link.

    Args:
        config: The rig; its ``simulation.speed`` wins over the command's own.
        simulated_speed: Multiple of real time; infinite is as fast as it goes.

    Raises:
        ConfigError: A speed other than 1 with hardware.
    """
    speed = config.simulation.speed
    if is_simulated(config):
        return loop_factory(simulated_speed if speed is None else speed)
    if speed not in {None, 1.0}:
        msg = f"a simulation speed of {speed:g} cannot be kept with hardware: leave it out"
        raise ConfigError(msg)
    return loop_factory(1.0)


def serving_loop(config: RigConfig) -> Callable[[], AbstractEventLoop]:
    """Choose the loop of instruments that other programs talk to: wall time, or scaled.

    Raises:
        ConfigError: An infinite speed: nobody outside could follow.
    """
    speed = config.simulation.speed or 1.0
    if math.isinf(speed):
        msg = "other programs cannot follow an infinite simulation speed: give a finite one"
        raise ConfigError(msg)
    return loop_factory(speed)


def with_latitude(config: RigConfig) -> RigConfig:
    """Fill in the simulated bench's latitude where none is given.

    Raises:
        ConfigError: No latitude, and hardware: nothing there can be guessed.
    """
    if config.site.latitude_deg is not None:
        return config
    if not is_simulated(config):
        msg = "[site] latitude_deg is required with hardware: give the bench's latitude in degrees"
        raise ConfigError(msg)
    site = config.site.model_copy(update={"latitude_deg": _SIMULATED_LATITUDE_DEG})
    return config.model_copy(update={"site": site})


def build_world(config: RigConfig) -> World:
    """Make the world of the configuration's simulated devices."""
    simulation, site = config.simulation, with_latitude(config).site
    world = World(
        WorldSettings(
            truth=Truth(
                latitude_rad=site.latitude_rad,
                azimuth_rad=simulation.azimuth_deg * DEG,
                pitch_rad=simulation.pitch_deg * DEG,
                roll_rad=simulation.roll_deg * DEG,
                height_m=site.height_m,
                gravity_m_s2=site.gravity_m_s2,
            ),
            gyro=NoiseLevels(
                white_sqrt_s=simulation.gyro_noise_deg_sqrt_h * DEG_PER_SQRT_HOUR,
                bias=simulation.gyro_bias_deg_h * DEG_PER_HOUR,
                drift_per_s=simulation.gyro_drift_deg_h_h * DEG_PER_HOUR_PER_HOUR,
                bias_instability=simulation.gyro_bias_instability_deg_h * DEG_PER_HOUR,
            ),
            accelerometer=NoiseLevels(white_sqrt_s=simulation.accel_noise_g_sqrt_hz),
            table_sigma_rad=config.turntable.angle_sigma_deg * DEG,
            clockwise=config.turntable.positive_direction == "clockwise",
            seed=simulation.seed,
        )
    )
    if config.turntable.link == SIMULATED:
        world.add_table("turntable", load_simulated("turntable", config.turntable.driver))
    if config.gyro.link == SIMULATED:
        _add_sensor(world, "gyro", config.gyro)
    if config.accelerometer.link == SIMULATED and config.accelerometer.source is None:
        _add_sensor(world, "accelerometer", config.accelerometer)
    return world


def _add_sensor(world: World, role: Role, section: GyroConfig | AccelerometerConfig) -> None:
    mounting = Mounting(section.axis, section.mount_angle_deg * DEG)
    world.add_sensor(role, load_simulated(role, section.driver), mounting)


def build_rig(config: RigConfig) -> Rig:
    """Make the rig that a configuration describes; nothing is opened yet.

    Raises:
        ConfigError: An unknown driver, a driver in a role that it cannot fill, one port for two
            instruments, an axis that is not in the table's plane, no latitude.
    """
    config = with_latitude(config)
    check_ports(config)
    world = build_world(config) if SIMULATED in links(config) else None
    turntable = cast("Turntable", _instrument("turntable", config.turntable, world))
    gyro = cast("InertialSensor", _instrument("gyro", config.gyro, world))
    if shares_the_gyros_port(config):
        load_driver("accelerometer", config.gyro.driver)
        _check_axes_of_one_body(config)
        accelerometer = gyro
    else:
        section = config.accelerometer
        accelerometer = cast("InertialSensor", _instrument("accelerometer", section, world))
    return Rig(
        config,
        turntable,
        SensingAxis(gyro, "rate", *_axis(config.gyro.axis), _gyro_noise(config, gyro)),
        SensingAxis(
            accelerometer,
            "force",
            *_axis(config.accelerometer.axis),
            _accelerometer_noise(config, accelerometer),
        ),
        None if world is None else SimulatedWorld(world, config),
    )


@dataclass(frozen=True, slots=True)
class SimulatedWorld:
    """The simulation as a rig sees it; tests reach the world's faults through ``world``."""

    world: World
    config: RigConfig

    async def start(self) -> None:
        """Power the simulated devices up."""
        await self.world.start()

    async def stop(self) -> None:
        """Power them down."""
        await self.world.stop()

    def truth(self) -> dict[str, Any]:
        """Return the settings that the world was made from."""
        return self.config.simulation.model_dump(mode="json", exclude={"speed"})


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


def _instrument(role: Role, section: AnySection, world: World | None) -> Instrument:
    driver = load_driver(role, section.driver)
    link: Link
    if section.link == SIMULATED and world is not None:
        link = world.link(role)
    else:
        link = SerialLink(section.link, driver.baudrate)
    return cast("Instrument", driver(link))


def _axis(axis: str) -> tuple[int, float]:
    return "xyz".index(axis[-1]), -1.0 if axis.startswith("-") else 1.0


def _gyro_noise(config: RigConfig, gyro: InertialSensor) -> float:
    """The figure for predictions: configured, else the simulation's, else the data sheet's."""
    simulated_deg_sqrt_h = config.simulation.gyro_noise_deg_sqrt_h
    if config.gyro.noise_deg_sqrt_h is not None:
        return config.gyro.noise_deg_sqrt_h * DEG_PER_SQRT_HOUR
    if config.gyro.link == SIMULATED and simulated_deg_sqrt_h > 0.0:
        return simulated_deg_sqrt_h * DEG_PER_SQRT_HOUR
    return gyro.noise.angle_random_walk_rad_sqrt_s


def _accelerometer_noise(config: RigConfig, accelerometer: InertialSensor) -> float:
    if config.accelerometer.noise_g_sqrt_hz is not None:
        return config.accelerometer.noise_g_sqrt_hz
    simulated_g_sqrt_hz = config.simulation.accel_noise_g_sqrt_hz
    if config.accelerometer.link == SIMULATED and simulated_g_sqrt_hz > 0.0:
        return simulated_g_sqrt_hz
    return accelerometer.noise.force_noise_g_sqrt_s


@asynccontextmanager
async def serve_simulation(
    config: RigConfig, transport: str
) -> AsyncIterator[list[dict[str, str]]]:
    """Serve the configuration's simulated devices on pseudo-terminals or TCP ports.

    Args:
        config: The rig; every instrument whose link is ``sim:`` is served.
        transport: ``pty`` or ``tcp``.

    Yields:
        Role, driver and link of each.

    Raises:
        ConfigError: No link is simulated, or this platform has no pseudo-terminals.
    """
    if SIMULATED not in links(config):
        msg = 'no link of this configuration is "sim:": there is nothing to serve'
        raise ConfigError(msg)
    world = build_world(config)
    serve = serve_on_tcp if transport == "tcp" else _pty_server()
    async with AsyncExitStack() as stack:
        listening = [
            {
                "role": role,
                "driver": getattr(config, role).driver,
                "link": await stack.enter_async_context(serve(device)),
            }
            for role, device in world.devices.items()
        ]
        await world.start()
        stack.push_async_callback(world.stop)
        yield listening


def _pty_server() -> Callable[[SimulatedDevice], AbstractAsyncContextManager[str]]:
    if sys.platform == "win32":
        msg = "--serial pty needs pseudo-terminals, which this platform lacks: use --serial tcp"
        raise ConfigError(msg)
    from sim.pty import serve_on_pty  # noqa: PLC0415 - absent on Windows

    return serve_on_pty
