"""The short forms of `make soak`, and that it would find what it looks for."""

import sys

import numpy as np
import pytest

from northfinder.proof.soak import Account, growth_of, soak

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")


@pytest.mark.alone
def test_some_seconds_of_work_lose_nothing() -> None:
    """So short, the memory tells of no leak, only that runs do not pile up."""
    lost, missed, growth = soak(duration_s=15.0, settled_s=10.0, subscribers=20)
    assert lost.met, lost
    assert missed.met, missed
    assert growth.value < 50.0, growth


@pytest.mark.alone
@pytest.mark.proof
@pytest.mark.timeout(300)
def test_a_minute_and_a_half_of_work_loses_nothing_and_lets_nothing_grow() -> None:
    lost, missed, growth = soak(duration_s=90.0, settled_s=60.0, subscribers=20)
    assert lost.met, lost
    assert missed.met, missed
    assert growth.value < 5.0, growth


def account(mb_per_minute: float, minutes: float) -> Account:
    at_s = np.arange(0.0, 60.0 * minutes, 0.25)
    rss = 3e8 + mb_per_minute * 1e6 / 60.0 * at_s
    return Account(at_s=at_s.tolist(), rss_bytes=rss.astype(int).tolist())


def test_a_leak_is_found_and_its_pace_is_told() -> None:
    growth, story = growth_of(account(1.0, 30.0), 60.0)
    assert growth > 2.0
    assert "+1000 kB/min" in story
    assert growth_of(account(0.0, 30.0), 60.0)[0] == pytest.approx(0.0, abs=1e-9)


def test_a_soak_that_ends_before_the_memory_settles_says_nothing() -> None:
    with pytest.raises(RuntimeError, match="before 60 s had settled"):
        growth_of(account(0.0, 1.0), 60.0)
