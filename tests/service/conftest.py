"""One service for all tests that leave it as they found it."""

from collections.abc import Iterator

import pytest

from tests.service.process import ServiceProcess, serving, wait_until_ready


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    with serving(tmp_path_factory.mktemp("service")) as running:
        wait_until_ready(running)
        yield running
