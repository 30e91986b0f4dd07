"""The world of a configuration's simulated devices, and what may be changed in it."""

from collections.abc import Callable, Mapping
from typing import Any

from northfinder.config import AccelerometerConfig, RigConfig, SimulationConfig, TurntableConfig
from northfinder.errors import ConfigError
from northfinder.plugins import load_simulated
from northfinder.ports import sections
from northfinder.rig import JsonObject
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_HOUR_PER_HOUR, DEG_PER_SQRT_HOUR
from northfinder.validation import validated
from northfinder.wiring.can import simulated
from northfinder.wiring.defaults import with_latitude
from northfinder.wiring.faults import WorldFaults
from sim.bench import Mounting
from sim.noise import NoiseLevels
from sim.rocking_base import RockingSettings, nominal, paper_like
from sim.truth import Truth
from sim.world import World, WorldSettings

_FIXED = ("seed", "speed")  # what the world was made from, and the time it lives in


def build_world(config: RigConfig, is_simulated: Callable[[str], bool]) -> World:
    """Make the world of the instruments whose link is simulated; the latitude is filled in."""
    world = World(_settings(config))
    for role, section in sections(config):
        if not is_simulated(section.link):
            continue
        kind = simulated(role, load_simulated(role, section.driver), section, config)
        if isinstance(section, TurntableConfig):
            world.add_table(role, kind)
        elif not (isinstance(section, AccelerometerConfig) and section.source):
            mounting = Mounting(section.axis, section.mount_angle_deg * DEG)
            world.add_sensor(role, kind, mounting)
    return world


def _settings(config: RigConfig) -> WorldSettings:
    simulation, site = config.simulation, with_latitude(config).site
    return WorldSettings(
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
        rocking=_rocking(simulation, site.latitude_rad),
        turns=config.turntable.turns,
    )


def _rocking(simulation: SimulationConfig, latitude_rad: float) -> RockingSettings | None:
    """Return how the base moves; the world puts it where the bench stands."""
    motions = {"nominal": nominal, "paper-like": paper_like}
    if simulation.base == "still":
        return None
    return motions[simulation.base](latitude_rad, simulation.seed)


class SimulatedWorld:
    """The simulation as a rig sees it; everything is called on the rig's loop.

    What is changed acts on the samples from the next burst on: azimuth and tilt as if the bench
    had been set down anew, the gyro's bias from its new value, its drift from where the bias has
    got to.

    Args:
        world: The running world; tests reach further into it.
        config: What it was made from.

    Attributes:
        on_change: Told the configuration as it has become.
    """

    def __init__(self, world: World, config: RigConfig) -> None:
        self.world = world
        self.on_change: Callable[[RigConfig], None] = lambda _: None
        self._config = config
        self._faults = WorldFaults(world, clockwise=_settings(config).clockwise)

    async def start(self) -> None:
        """Power the simulated devices up."""
        await self.world.start()

    async def stop(self) -> None:
        """Power them down."""
        await self.world.stop()

    def truth(self) -> JsonObject:
        """Return the world's settings as they are now; all but the speed."""
        return self._config.simulation.model_dump(mode="json", exclude={"speed"})

    def change(self, settings: Mapping[str, Any]) -> JsonObject:
        """Change some settings at once, and return all of them.

        Raises:
            ConfigError: An unknown or fixed one, or out of its limits; nothing has changed then.
        """
        before = self._config.simulation.model_dump()
        for key in _FIXED:
            if settings.get(key, before[key]) != before[key]:
                msg = f"simulation: {key} = {settings[key]!r}: it is fixed while the rig runs"
                raise ConfigError(msg)
        simulation = validated(SimulationConfig, {**before, **settings}, "simulation")
        self._config = self._config.model_copy(update={"simulation": simulation})
        self.world.change(_settings(self._config))
        self.on_change(self._config)
        return self.truth()

    def faults(self) -> dict[str, JsonObject]:
        """Return the faults of each simulated device by its role."""
        return self._faults.to_json()

    def set_faults(self, device: str, given: Mapping[str, Any]) -> dict[str, JsonObject]:
        """Set some faults of a device at once, and return all faults of all devices.

        Raises:
            ConfigError: No such device or fault, or out of its limits; nothing has changed then.
        """
        self._faults.set(device, given)
        return self.faults()

    def clear_faults(self) -> dict[str, JsonObject]:
        """Mend everything."""
        for device in self.faults():
            self._faults.clear(device)
        return self.faults()
