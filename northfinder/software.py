"""Which software computed a result."""

import platform
from importlib.metadata import version as _version_of


def version() -> str:
    """Return northfinder's version."""
    return _version_of("northfinder")


def description() -> dict[str, str]:
    """Return the versions that a result depends on, for its record."""
    return {
        "version": version(),
        "python": platform.python_version(),
        "numpy": _version_of("numpy"),
    }
