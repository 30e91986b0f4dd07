"""Which instrument is on which port or bus, and which of them is one instrument in two roles."""

from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, Self

from drivers.interfaces import Role
from northfinder.config import AccelerometerConfig, GyroConfig, RigConfig, TurntableConfig
from northfinder.errors import ConfigError

SIMULATED = "sim:"
_CAN = "can:"

AnySection = TurntableConfig | GyroConfig | AccelerometerConfig


@dataclass(frozen=True, slots=True)
class CanAddress:
    """Where on which CAN bus: ``can:socketcan:can0:node=5,bitrate=500000``.

    Attributes:
        interface: One of python-can's.
        channel: Its channel.
        node: Node number or J1939 address; None where it is not given.
        options: What else python-can is to be given.
    """

    interface: str
    channel: str
    node: int | None = None
    options: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def parse(cls, link: str, role: str) -> Self:
        """Read a link.

        Raises:
            ConfigError: It is no CAN link.
        """
        if not is_can(link):
            msg = (
                f"[{role}] link = {link!r}: this driver is on a CAN bus; give a link like"
                " can:socketcan:can0:node=5"
            )
            raise ConfigError(msg)
        interface, _, rest = link.removeprefix(_CAN).partition(":")
        channel, separator, tail = rest.rpartition(":")
        if not separator or "=" not in tail:
            channel, tail = rest, ""
        given = dict(part.partition("=")[::2] for part in tail.split(",") if part)
        if not (interface and channel and all(given.values())):
            msg = (
                f"[{role}] link = {link!r}: a CAN link is can:INTERFACE:CHANNEL:node=N, as in"
                " can:socketcan:can0:node=5 or can:slcan:/dev/ttyACM0:node=5,bitrate=500000"
            )
            raise ConfigError(msg)
        options = {key: _value(text) for key, text in given.items()}
        node = options.pop("node", None)
        if node is not None and not (isinstance(node, int) and 0 <= node <= 253):
            msg = f"[{role}] link = {link!r}: a node is a number, 1 to 127 in CANopen"
            raise ConfigError(msg)
        return cls(interface, channel, node, options)

    @property
    def bus(self) -> tuple[str, str]:
        """Return which bus it is."""
        return self.interface, self.channel


def is_can(link: str) -> bool:
    """Say whether a link is a CAN bus."""
    return link.startswith(_CAN)


def links(config: RigConfig) -> list[str]:
    """Return every instrument's link."""
    return [section.link for _, section in sections(config)]


def sections(config: RigConfig) -> tuple[tuple[Role, AnySection], ...]:
    """Return the section of every instrument that has a link, by its role."""
    sensors: tuple[tuple[Role, AnySection], ...] = (
        ("gyro", config.gyro),
        ("accelerometer", config.accelerometer),
    )
    return (("turntable", config.turntable), *sensors) if config.turntable.turns else sensors


def shares_the_gyros_port(config: RigConfig) -> bool:
    """One device in two roles: said outright, or by naming the same serial port twice."""
    gyro, accelerometer = config.gyro, config.accelerometer
    same_port = gyro.link == accelerometer.link != SIMULATED and not is_can(gyro.link)
    return accelerometer.source == "gyro" or same_port


def check_ports(config: RigConfig) -> None:
    """Refuse two instruments on one port or node; one instrument in two roles is no such thing.

    Raises:
        ConfigError: A port is given twice, with different drivers, or a node, or a bus differently.
    """
    for (first, one), (second, other) in combinations(sections(config), 2):
        if is_can(one.link) and is_can(other.link):
            _check_bus(first, one, second, other)
        elif one.link == other.link != SIMULATED and one.driver != other.driver:
            msg = (
                f"[{second}] link = {other.link!r} is the {first}'s, whose driver is "
                f"{one.driver!r}, not {other.driver!r}: give each instrument a port of its own"
            )
            raise ConfigError(msg)


def _check_bus(first: Role, one: AnySection, second: Role, other: AnySection) -> None:
    """Let two instruments share a bus, but neither a node nor an opinion on its bit rate."""
    here, there = CanAddress.parse(one.link, first), CanAddress.parse(other.link, second)
    if here.bus != there.bus:
        return
    if here.options != there.options:
        msg = (
            f"[{second}] link = {other.link!r}: the {first} opens the same bus with other options"
            f" ({one.link!r}): give both the same"
        )
        raise ConfigError(msg)
    if here.node is not None and here.node == there.node and one.driver != other.driver:
        msg = f"[{second}] link = {other.link!r}: node {here.node} is the {first} already"
        raise ConfigError(msg)


def _value(text: str) -> str | int | float | bool:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return {"true": True, "false": False}.get(text.lower(), text)
