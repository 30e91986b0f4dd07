"""Configuration from environment variables: ``NORTHFINDER_SITE__LATITUDE_DEG=40``."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

from northfinder.errors import ConfigError

_PREFIX = "NORTHFINDER_"

#: The service's; whoever keeps it in the shell may still find north from there.
_NOT_CONFIGURATION = {"NORTHFINDER_TOKEN"}


def from_environment(
    environ: Mapping[str, str], keys: Iterable[tuple[str, str]]
) -> dict[str, dict[str, Any]]:
    """Return the sections with the keys that the environment sets, still as text.

    Args:
        environ: The process environment.
        keys: Section and key of everything that can be configured.

    Raises:
        ConfigError: A variable of ours that nothing reads; the message names the nearest.
    """
    known = {f"{section}__{key}".upper(): (section, key) for section, key in keys}
    tree: dict[str, dict[str, Any]] = {}
    for name, value in environ.items():
        if name.startswith(_PREFIX) and name not in _NOT_CONFIGURATION:
            suffix = name.removeprefix(_PREFIX)
            if suffix not in known:
                raise ConfigError(_unknown(suffix, known))
            section, key = known[suffix]
            tree.setdefault(section, {})[key] = value
    return tree


def _unknown(suffix: str, known: Iterable[str]) -> str:
    near = get_close_matches(suffix, known, n=1)
    advice = f"did you mean {_PREFIX}{near[0]}?" if near else f"write {_PREFIX}SECTION__KEY"
    return f"the environment variable {_PREFIX}{suffix} is unknown; {advice}"
