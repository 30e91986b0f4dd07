"""Drivers and simulated devices by name, also from packages installed beside this one."""

from difflib import get_close_matches
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from drivers.interfaces import Role
from northfinder.errors import ConfigError


def load_driver(role: Role, name: str) -> Any:  # noqa: ANN401 - what a plug-in exports
    """Return the driver's class.

    Raises:
        ConfigError: There is none of this name, or it cannot fill the role.
    """
    driver = _load("northfinder.drivers", "driver", role, name)
    if role not in driver.roles:
        can = " or ".join(sorted(driver.roles))
        msg = f"[{role}] driver = {name!r}: this driver serves as {can}, not as {role}"
        raise ConfigError(msg)
    return driver


def load_simulated(role: Role, name: str) -> Any:  # noqa: ANN401 - what a plug-in exports
    """Return what simulates the driver's instrument.

    Raises:
        ConfigError: Nothing does.
    """
    return _load("northfinder.simulated", "simulated instrument", role, name)


def _load(group: str, what: str, role: Role, name: str) -> Any:  # noqa: ANN401 - as above
    found: dict[str, EntryPoint] = {entry.name: entry for entry in entry_points(group=group)}
    if name in found:
        return found[name].load()
    near = get_close_matches(name, found, n=1)
    known = f"did you mean {near[0]}?" if near else f"known are {', '.join(sorted(found))}"
    msg = f"[{role}] driver = {name!r}: there is no such {what}; {known}"
    raise ConfigError(msg)
