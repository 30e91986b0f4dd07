"""Which instrument is on which port, and which of them is one instrument in two roles."""

from itertools import combinations

from drivers.interfaces import Role
from northfinder.config import AccelerometerConfig, GyroConfig, RigConfig, TurntableConfig
from northfinder.errors import ConfigError

SIMULATED = "sim:"

AnySection = TurntableConfig | GyroConfig | AccelerometerConfig


def links(config: RigConfig) -> list[str]:
    """Return every instrument's link."""
    return [config.turntable.link, config.gyro.link, config.accelerometer.link]


def shares_the_gyros_port(config: RigConfig) -> bool:
    """One device in two roles: said outright, or by naming the same port twice."""
    gyro, accelerometer = config.gyro, config.accelerometer
    same_port = gyro.link == accelerometer.link != SIMULATED
    return accelerometer.source == "gyro" or same_port


def check_ports(config: RigConfig) -> None:
    """Refuse two instruments on one port; one instrument in two roles is no such thing.

    Raises:
        ConfigError: A port is given twice, with different drivers.
    """
    roles: tuple[tuple[Role, AnySection], ...] = (
        ("turntable", config.turntable),
        ("gyro", config.gyro),
        ("accelerometer", config.accelerometer),
    )
    for (first, one), (second, other) in combinations(roles, 2):
        if one.link == other.link != SIMULATED and one.driver != other.driver:
            msg = (
                f"[{second}] link = {other.link!r} is the {first}'s, whose driver is "
                f"{one.driver!r}, not {other.driver!r}: give each instrument a port of its own"
            )
            raise ConfigError(msg)
