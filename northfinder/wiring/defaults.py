"""What is filled in where a configuration leaves it open, and for a simulated rig only."""

from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.ports import SIMULATED, links

_SIMULATED_LATITUDE_DEG = 40.0


def is_simulated(config: RigConfig) -> bool:
    """Return whether every link is simulated, so that time need not be the wall's."""
    return all(link == SIMULATED for link in links(config))


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


def with_speed(config: RigConfig, simulated_speed: float) -> RigConfig:
    """Fill in the simulation's speed where none is given; with any real link it is 1.

    Args:
        config: The rig; its ``simulation.speed`` wins over the command's own.
        simulated_speed: Multiple of real time; infinite is as fast as it goes.

    Raises:
        ConfigError: A speed other than 1 with hardware.
    """
    speed = config.simulation.speed
    simulated = is_simulated(config)
    if not simulated and speed not in {None, 1.0}:
        msg = f"a simulation speed of {speed:g} cannot be kept with hardware: leave it out"
        raise ConfigError(msg)
    if speed is not None:
        return config
    filled_in = {"speed": simulated_speed if simulated else 1.0}
    return config.model_copy(update={"simulation": config.simulation.model_copy(update=filled_in)})
