"""What all tests share: marks that follow from what a test uses, and one PostgreSQL server."""

import hypothesis
import pytest

pytest_plugins = ["tests.postgresql"]

# A busy machine is no defect, and a run that fails must fail again.
hypothesis.settings.register_profile("northfinder", deadline=None, derandomize=True)
hypothesis.settings.load_profile("northfinder")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what needs PostgreSQL; leave out what needs hardware unless somebody asks for it."""
    for item in items:
        if "postgresql" in item.name or "postgresql_server" in getattr(item, "fixturenames", ()):
            item.add_marker("postgresql")
    if "hardware" in str(config.getoption("markexpr")):
        return
    hardware = [item for item in items if item.get_closest_marker("hardware")]
    config.hook.pytest_deselected(items=hardware)
    items[:] = [item for item in items if item not in hardware]
