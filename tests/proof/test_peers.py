"""The short form of `northfinder bench peers`; ratios are held where nothing else runs."""

from collections.abc import Callable, Iterator
from importlib import import_module as found_module
from types import ModuleType

import numpy as np
import pytest

from northfinder.errors import ConfigError
from northfinder.proof import peers
from northfinder.proof.figure import Figure
from northfinder.proof.service_peers import service_peers
from northfinder.proof.timing import Machine

SLOW_MACHINE = Machine(bytes_s=1e9, flops=1e9)


def attitude() -> Iterator[Figure]:
    return peers.attitude_peers(SLOW_MACHINE, 500_000)


def wahba() -> Iterator[Figure]:
    return peers.wahba_peers(SLOW_MACHINE, 5_000)


@pytest.mark.alone
@pytest.mark.parametrize("measure", [attitude, wahba])
def test_the_peers_find_the_same_and_take_longer(measure: Callable[[], Iterator[Figure]]) -> None:
    """That both find the same is asserted before either is timed."""
    for figure in measure():
        assert figure.value > 2.0, figure
        assert "1.0 GB/s" in figure.limit


@pytest.mark.alone
@pytest.mark.slow
def test_the_service_answers_no_slower_than_a_few_of_the_plainest_app() -> None:
    figures = list(service_peers(requests=100, runs=3))
    paths = [figure.name.split()[1] for figure in figures]
    assert paths == ["/healthz", "/api/v1/rig", "/api/v1/runs"]
    for figure in figures:
        assert figure.value > 0.15, figure  # of so few requests; `make proof` holds each limit
        assert "a bare socket" in figure.limit


def test_an_attitude_that_differs_is_refused_whichever_its_sign() -> None:
    q = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
    peers._require_same(q, -q, 1e-12)
    with pytest.raises(RuntimeError, match=r"differs by 1"):
        peers._require_same(q, q[::-1], 0.1)
    with pytest.raises(RuntimeError, match=r"differs by nan"):
        peers._require_same(q, np.full_like(q, np.nan), 0.1)


def test_a_peer_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def without_ahrs(module: str) -> ModuleType:
        if module.startswith("ahrs"):
            raise ModuleNotFoundError(module)
        return found_module(module)

    monkeypatch.setattr(peers, "import_module", without_ahrs)
    with pytest.raises(ConfigError, match=r"bench peers needs ahrs: pip install"):
        list(peers.wahba_peers(SLOW_MACHINE, 100))


def test_a_limit_says_what_share_of_it_is_reached() -> None:
    machine = Machine(bytes_s=2e9, flops=4e9)
    assert machine.memory_limit(1e9, 1.0) == "memory 2.0 GB/s: 50 % of it"
    assert machine.flops_limit(1e9, 1.0) == "4.0 Gflop/s: 25 % of it"


def test_this_machine_copies_and_multiplies() -> None:
    """A copy below 0.1 GB/s or above 10 TB/s would be a clock misread; so would such products."""
    machine = Machine.measured()
    assert 1e8 < machine.bytes_s < 1e13
    assert 1e8 < machine.flops < 1e14
