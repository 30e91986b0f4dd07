"""The one place that chooses hardware or simulation: from a configuration to a rig."""

import sys
from asyncio import AbstractEventLoop
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from importlib.metadata import EntryPoint, entry_points
from typing import Any, cast

from drivers.interfaces import InertialSensor, Instrument, Link, Role, Turntable
from drivers.links.serial import SerialLink
from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.rig import Rig, SensingAxis
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_HOUR_PER_HOUR, DEG_PER_SQRT_HOUR
from sim.bench import Mounting
from sim.clock import loop_factory
from sim.interfaces import SimulatedDevice
from sim.noise import NoiseLevels
from sim.tcp import serve_on_tcp
from sim.truth import Truth
from sim.world import World, WorldSettings

_SIMULATED = "sim:"
_SIMULATED_LATITUDE_DEG = 40.0


def is_simulated(config: RigConfig) -> bool:
    """Return whether every link is simulated, so that time may be virtual."""
    return all(link == _SIMULATED for link in _links(config))


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
    if config.turntable.link == _SIMULATED:
        world.add_table("turntable", _load("northfinder.simulated", config.turntable.driver))
    for role, section in (("gyro", config.gyro), ("accelerometer", config.accelerometer)):
        if section.link == _SIMULATED and getattr(section, "source", None) is None:
            mounting = Mounting(section.axis, section.mount_angle_deg * DEG)
            world.add_sensor(role, _load("northfinder.simulated", section.driver), mounting)
    return world


def build_rig(config: RigConfig) -> Rig:
    """Make the rig that a configuration describes; nothing is opened yet.

    Raises:
        ConfigError: An unknown driver, a driver in a role that it cannot fill, no latitude.
    """
    config = with_latitude(config)
    world = build_world(config) if _SIMULATED in _links(config) else None
    turntable = cast("Turntable", _instrument("turntable", config.turntable, world))
    gyro = cast("InertialSensor", _instrument("gyro", config.gyro, world))
    if _shares_the_gyros_port(config):
        accelerometer = gyro
        _check_role(config.gyro.driver, type(gyro), "accelerometer")
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


def _links(config: RigConfig) -> list[str]:
    links = [config.turntable.link, config.gyro.link]
    return links if config.accelerometer.source else [*links, config.accelerometer.link]


def _shares_the_gyros_port(config: RigConfig) -> bool:
    """One device in two roles: said outright, or by naming the same port twice."""
    gyro, accelerometer = config.gyro, config.accelerometer
    same_port = gyro.link == accelerometer.link != _SIMULATED
    return accelerometer.source == "gyro" or same_port


def _instrument(role: Role, section: Any, world: World | None) -> Instrument:  # noqa: ANN401 - any of three sections
    driver = _load("northfinder.drivers", section.driver)
    _check_role(section.driver, driver, role)
    link: Link
    if section.link == _SIMULATED and world is not None:
        link = world.link(role)
    else:
        link = SerialLink(section.link, driver.baudrate)
    return cast("Instrument", driver(link))


def _load(group: str, name: str) -> Any:  # noqa: ANN401 - what a plug-in exports
    """Find a driver or a simulated device by name, also in packages installed beside this one."""
    found: dict[str, EntryPoint] = {entry.name: entry for entry in entry_points(group=group)}
    if name in found:
        return found[name].load()
    near = get_close_matches(name, found, n=1)
    known = f"did you mean {near[0]}?" if near else f"known are {', '.join(sorted(found))}"
    what = "driver" if group.endswith("drivers") else "simulated device"
    msg = f"there is no {what} named {name!r}: {known}"
    raise ConfigError(msg)


def _check_role(name: str, driver: Any, role: Role) -> None:  # noqa: ANN401 - what a plug-in exports
    if role not in driver.roles:
        can = " or ".join(sorted(driver.roles))
        msg = f"[{role}] driver = {name!r}: this driver serves as {can}, not as {role}"
        raise ConfigError(msg)


def _axis(axis: str) -> tuple[int, float]:
    return "xyz".index(axis[-1]), -1.0 if axis.startswith("-") else 1.0


def _gyro_noise(config: RigConfig, gyro: InertialSensor) -> float:
    """The figure for predictions: configured, else the simulation's, else the data sheet's."""
    if config.gyro.noise_deg_sqrt_h is not None:
        return config.gyro.noise_deg_sqrt_h * DEG_PER_SQRT_HOUR
    if config.gyro.link == _SIMULATED:
        return config.simulation.gyro_noise_deg_sqrt_h * DEG_PER_SQRT_HOUR
    return gyro.noise.angle_random_walk_rad_sqrt_s


def _accelerometer_noise(config: RigConfig, accelerometer: InertialSensor) -> float:
    if config.accelerometer.noise_g_sqrt_hz is not None:
        return config.accelerometer.noise_g_sqrt_hz
    section = config.gyro if _shares_the_gyros_port(config) else config.accelerometer
    if section.link == _SIMULATED:
        return config.simulation.accel_noise_g_sqrt_hz
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
        ConfigError: No pseudo-terminals on this platform.
    """
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
