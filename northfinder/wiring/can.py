"""CAN instruments: their buses, each opened once, and what the configuration says of each."""

import math
from functools import partial
from pathlib import Path
from typing import Any

import drivers
from drivers.interfaces import CanLink, CanSettings, Role
from drivers.links.can_port import Bus, CanPort
from northfinder.config import RigConfig, TurntableConfig
from northfinder.errors import ConfigError
from northfinder.ports import SIMULATED, AnySection, CanAddress, sections

_MOST_CHARACTERS = 16_000_000  # a whole vehicle takes a tenth of that
_SHIPPED = Path(drivers.__file__).parent / "dbc_files"
#: Node numbers, and the address, of simulated instruments whose link is only ``sim:``.
_SIMULATED_NODES: dict[Role, int] = {"turntable": 5, "accelerometer": 6, "gyro": 35}
_COARSEST_RAD_S = math.radians(1.0) / 3600.0


class CanBuses:
    """The real buses of one rig."""

    def __init__(self) -> None:
        self._buses: dict[tuple[str, str], Bus] = {}

    def port(self, role: Role, link: str) -> CanLink:
        """Return an instrument's part of the bus that its link names; not open yet.

        Raises:
            ConfigError: It names none.
        """
        address = CanAddress.parse(link, role)
        if address.bus not in self._buses:
            from drivers.links.can import CanBus  # noqa: PLC0415 - python-can takes 0.2 s

            self._buses[address.bus] = CanBus(*address.bus, address.options)
        return CanPort(self._buses[address.bus])


def can_settings(role: Role, section: AnySection, config: RigConfig) -> CanSettings:
    """Return what an instrument on a CAN bus is told.

    Raises:
        ConfigError: No DBC file of that name, or half of what the driver needs.
    """
    node = _SIMULATED_NODES[role]
    if section.link != SIMULATED:
        given = CanAddress.parse(section.link, role).node
        if given is None and section.driver != "dbc":
            msg = (
                f"[{role}] link = {section.link!r}: say which node it is, as in"
                f" {section.link}:node={node}"
            )
            raise ConfigError(msg)
    else:
        given = node
    if isinstance(section, TurntableConfig):
        return CanSettings(node=given, units_per_turn=section.units_per_turn)
    column = "xyz".index(section.axis[-1])
    dbc: tuple[str, dict[str, str]] | None = None
    if section.driver == "dbc":
        if not (section.file and section.message and section.signal):
            msg = f"[{role}] driver = 'dbc': file, message and signal must be given"
            raise ConfigError(msg)
        dbc = _text(role, section.file), section.dbc_names
    return CanSettings(node=given, column=column, gravity_g=config.site.gravity_g, dbc=dbc)


def tells_its_node(settings: CanSettings) -> bool:
    """Say whether an instrument's frames carry its node: those of a plain DBC message do not."""
    if settings.node is None or settings.dbc is None:
        return settings.node is not None
    from drivers.codecs.dbc import DbcDecoder  # noqa: PLC0415 - cantools takes 0.3 s

    return DbcDecoder.configured(settings).is_j1939


def check_dbc(config: RigConfig) -> None:
    """Refuse a DBC signal of the wrong kind or too coarse, and DBC keys of another driver.

    Raises:
        ConfigError: It is.
    """
    for role, section in sections(config):
        _check_dbc(role, section, config)


def _check_dbc(role: Role, section: AnySection, config: RigConfig) -> None:
    if isinstance(section, TurntableConfig):
        return
    if section.driver != "dbc":
        if section.dbc_keys:
            given = next(iter(section.dbc_keys))
            msg = f"[{role}] {given}: only driver = 'dbc' has it, not {section.driver!r}"
            raise ConfigError(msg)
        return
    from drivers.codecs.dbc import DbcDecoder  # noqa: PLC0415 - cantools takes 0.3 s

    try:
        decoder = DbcDecoder.configured(can_settings(role, section, config))
    except ValueError as error:
        msg = f"[{role}] file = {section.file!r}: {error}"
        raise ConfigError(msg) from error
    wanted = "rate" if role == "gyro" else "force"
    if decoder.quantity != wanted:
        what = "an angular rate" if role == "gyro" else "a specific force"
        msg = f"[{role}] signal = {section.signal!r}: its unit is not that of {what}"
        raise ConfigError(msg)
    if role == "gyro" and decoder.resolution > _COARSEST_RAD_S:
        _check_accepted(config, decoder.resolution)


def _check_accepted(config: RigConfig, resolution_rad_s: float) -> None:
    if config.gyro.accept_coarse_scale:
        return
    coarse_deg_h = math.degrees(resolution_rad_s) * 3600.0
    msg = (
        f"[gyro] signal = {config.gyro.signal!r}: one count is {coarse_deg_h:.3g} deg/h, and the"
        " Earth turns by 15: too coarse for a north-seek, which wants 1 deg/h or finer. Take a"
        " finer signal, or set accept_coarse_scale = true if its noise is larger than a count"
    )
    raise ConfigError(msg)


def _text(role: Role, file: str) -> str:
    """Return a DBC file's text: of the path given, or of a file that comes with the program."""
    for path in (Path(file), _SHIPPED / file):
        try:
            with path.open(encoding="cp1252") as opened:
                text = opened.read(_MOST_CHARACTERS + 1)
        except FileNotFoundError:
            continue
        except (OSError, UnicodeDecodeError) as error:
            msg = f"[{role}] file = {file!r} cannot be read: {error}"
            raise ConfigError(msg) from error
        if len(text) > _MOST_CHARACTERS:
            msg = f"[{role}] file = {file!r} is larger than {_MOST_CHARACTERS:,} bytes: no DBC file"
            raise ConfigError(msg)
        return text
    shipped = ", ".join(sorted(one.name for one in _SHIPPED.glob("*.dbc")))
    msg = f"[{role}] file = {file!r}: there is no such file; {shipped} come with the program"
    raise ConfigError(msg)


def simulated(role: Role, kind: Any, section: AnySection, config: RigConfig) -> Any:  # noqa: ANN401 - what a plug-in exports
    """Return what makes a simulated instrument from what it feels."""
    if kind.transport != "can":
        return kind
    return partial(kind.configured, settings=can_settings(role, section, config))
