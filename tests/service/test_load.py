"""A run at real time over real pseudo-terminals that many people watch: the short form."""

import sys

import pytest

from northfinder.proof.service_load import service_load

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX"),
]


def test_nothing_is_lost_and_nobody_misses_an_event_while_many_watch() -> None:
    """How fast the answers come says more of this machine's other work: `make proof` asserts it."""
    lost, _answers, missed = service_load(duration_s=6.0, subscribers=20, requests_per_s=20.0)
    assert lost.met, lost
    assert missed.met, missed
