"""Hardware tests run only where somebody asks for them by their mark."""

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if "hardware" in str(config.getoption("markexpr")):
        return
    hardware = [item for item in items if item.get_closest_marker("hardware")]
    config.hook.pytest_deselected(items=hardware)
    items[:] = [item for item in items if item not in hardware]
