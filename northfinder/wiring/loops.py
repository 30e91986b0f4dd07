"""Which time a rig lives in: the wall's, virtual, paced, or scaled."""

import math
from asyncio import AbstractEventLoop
from collections.abc import Callable

from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.wiring.defaults import is_simulated, with_speed
from sim.clock import ScaledTimeLoop, loop_factory


def event_loop(config: RigConfig, simulated_speed: float) -> Callable[[], AbstractEventLoop]:
    """Choose the loop: virtual or paced for a simulated rig, wall time with any real link.

    Args:
        config: The rig; its ``simulation.speed`` wins over the command's own.
        simulated_speed: Multiple of real time; infinite is as fast as it goes.

    Raises:
        ConfigError: A speed other than 1 with hardware.
    """
    speed = with_speed(config, simulated_speed).simulation.speed
    if speed is None or not is_simulated(config):
        return lambda: ScaledTimeLoop(1.0)
    return loop_factory(speed)


def serving_loop(config: RigConfig) -> Callable[[], AbstractEventLoop]:
    """Choose the loop of instruments that other programs talk to: wall time, or scaled.

    Raises:
        ConfigError: An infinite speed: nobody outside could follow.
    """
    require_finite_speed(config)
    return lambda: ScaledTimeLoop(config.simulation.speed or 1.0)


def require_finite_speed(config: RigConfig) -> None:
    """Refuse a rig that is as fast as it goes where somebody is to follow it.

    Raises:
        ConfigError: It is.
    """
    if math.isinf(config.simulation.speed or 1.0):
        msg = "nobody could follow an infinite simulation speed: give a finite one"
        raise ConfigError(msg)
