"""One chunk of a campaign: the same columns whoever computes it, wherever, in whatever order."""

from contextlib import AbstractContextManager
from functools import cache

import numpy as np
from threadpoolctl import ThreadpoolController

from northfinder.angles import within_half_turn
from northfinder.campaign.attitudes import Attitudes
from northfinder.campaign.bounds import Bounds
from northfinder.campaign.estimation import Estimates, Reduction, estimate
from northfinder.campaign.settings import Campaign
from northfinder.campaign.simulation import Bench
from northfinder.estimators.arrays import FloatArray
from northfinder.units import DEG

#: One value a seek, by name; float64.
Columns = dict[str, FloatArray]

_SEEKS_AT_ONCE = 2_000  # of 24 readings are 400 kB: what passes from step to step stays in cache


def run_chunk(campaign: Campaign, chunk: int) -> Columns:
    """Simulate and estimate one chunk.

    The random numbers are those of the chunk's own child of the seed (numpy's
    ``SeedSequence.spawn``), and sums are made on one thread, so that the numbers do not depend
    on who computes which chunk.

    Args:
        campaign: What to draw.
        chunk: From 0 to ``campaign.chunks - 1``.

    Returns:
        One row a seek, angles in deg: ``true_azimuth_deg``, ``true_pitch_deg``,
        ``true_roll_deg``, ``azimuth_deg``, ``vector_azimuth_deg``, ``pitch_deg``, ``roll_deg``,
        ``azimuth_sigma_deg``, ``interval95_half_width_deg``, ``error_deg``, ``bound_deg``, the
        Cramer-Rao bound of the sensors' noise, and ``dof``, the degrees of freedom of the sigma.

    Raises:
        EstimationError: The plan does not determine north.
    """
    seed = np.random.SeedSequence(campaign.seed, spawn_key=(chunk,))
    random, count = np.random.default_rng(seed), campaign.seeks_in(chunk)
    bench, reduction = Bench.of(campaign), Reduction.of(campaign)
    bounds = Bounds(bench)
    parts = []
    with one_thread():
        for start in range(0, count, _SEEKS_AT_ONCE):
            attitudes, readings = bench.simulate(random, min(_SEEKS_AT_ONCE, count - start))
            estimates = estimate(reduction, readings)
            parts.append(_columns(attitudes, estimates, bounds.sigma_rad(estimates)))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def one_thread() -> AbstractContextManager[object]:
    """Keep linear algebra on the calling thread: the chunks are what is shared out."""
    limiter: AbstractContextManager[object] = _libraries().limit(limits=1, user_api="blas")
    return limiter


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def _columns(truth: Attitudes, stated: Estimates, bound_rad: FloatArray) -> Columns:
    error_rad = within_half_turn(stated.azimuth_rad - truth.azimuth_rad)
    in_rad = {
        "true_azimuth": truth.azimuth_rad,
        "true_pitch": truth.pitch_rad,
        "true_roll": truth.roll_rad,
        "azimuth": stated.azimuth_rad,
        "vector_azimuth": stated.vector_azimuth_rad,
        "pitch": stated.pitch_rad,
        "roll": stated.roll_rad,
        "azimuth_sigma": stated.sigma_rad,
        "interval95_half_width": stated.interval95_rad,
        "error": error_rad,
        "bound": bound_rad,
    }
    in_deg = {f"{name}_deg": values / DEG for name, values in in_rad.items()}
    return {**in_deg, "dof": stated.dof}
