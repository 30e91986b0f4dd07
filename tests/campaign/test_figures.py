"""The short forms of the campaign's measurements."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest

from northfinder.campaign.chunks import run_chunk
from northfinder.campaign.estimation import Reduction, estimate
from northfinder.campaign.simulation import Bench, Readings
from northfinder.proof.campaigns import (
    campaign_dask,
    campaign_speed,
    coverage_by_noise,
    order_sigmas,
)
from northfinder.proof.figure import Figure
from northfinder.proof.timing import best_of
from tests.campaign.campaigns import SEQUENTIAL, planned


@pytest.mark.parametrize("measure", [partial(coverage_by_noise, 5_000), order_sigmas])
def test_what_is_stated_is_true(measure: Callable[[], Iterator[Figure]]) -> None:
    assert [figure for figure in measure() if not figure.met] == []


@pytest.mark.alone
def test_thousands_at_once_cost_a_fraction_of_one_by_one() -> None:
    """The public estimators called for each seek, against the same in blocks: the same work."""
    campaign = planned(SEQUENTIAL, tilt_deg=10.0, seeks=10_000)
    _, readings = Bench.of(campaign).simulate(np.random.default_rng(1), 50)
    reduction = Reduction.of(campaign)

    def one_by_one() -> None:
        for row in range(50):
            part = slice(row, row + 1)
            estimate(reduction, Readings(readings.rate_rad_s[part], readings.force_g[part]))

    each_s = best_of(one_by_one, 5) / 50
    in_blocks_s = best_of(lambda: run_chunk(campaign, 0), 5) / 10_000  # simulation included
    assert each_s / in_blocks_s > 50.0  # 190 on an idle machine


@pytest.mark.slow
@pytest.mark.parametrize("measure", [campaign_speed, campaign_dask])
def test_the_timed_measurements_can_be_made(measure: Callable[[int], Iterator[Figure]]) -> None:
    """Whether they are met is `make proof`'s, which has the cores to itself."""
    (figure,) = measure(100_000)
    assert figure.value > 0.0
    assert figure.least is not None
