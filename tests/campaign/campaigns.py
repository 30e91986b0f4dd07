"""Campaigns on the default bench, planned as the command line plans them."""

from typing import Any

import numpy as np
from scipy.stats import binom

from northfinder.campaign.chunks import Columns, run_chunk
from northfinder.campaign.planning import plan_campaign
from northfinder.campaign.settings import Campaign
from northfinder.campaign.tally import covered
from northfinder.config import load_config
from northfinder.procedures.plan import Plan

DEG, ARCMIN = np.pi / 180.0, np.pi / 10800.0
DEG_PER_HOUR = DEG / 3600.0
OMEGA_E_DEG_H = 15.041067
SEQUENTIAL = Plan(order="sequential")

#: The program is told the noise that the default simulation has, and of nothing else.
KNOWN: dict[str, dict[str, Any]] = {
    "gyro": {"noise_deg_sqrt_h": 0.001},
    "accelerometer": {"noise_g_sqrt_hz": 1e-5},
    "turntable": {"angle_sigma_deg": 0.0},
    "site": {"latitude_sigma_deg": 0.0},
}


def planned(
    plan: Plan = Plan(),  # noqa: B008 - frozen
    sections: dict[str, dict[str, Any]] | None = None,
    **drawn: Any,  # noqa: ANN401 - the campaign's own fields
) -> Campaign:
    config = load_config(None, {}, sections or {})
    return plan_campaign(config, plan, **{"seeks": 2_000, **drawn})[0]


def added(*parts: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Put sections together; what stands later wins, key by key."""
    whole: dict[str, dict[str, Any]] = {}
    for part in parts:
        for section, keys in part.items():
            whole[section] = {**whole.get(section, {}), **keys}
    return whole


def all_columns(campaign: Campaign) -> Columns:
    chunks = [run_chunk(campaign, chunk) for chunk in range(campaign.chunks)]
    return {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}


def is_covered_as_stated(columns: Columns) -> bool:
    """Whether 95 % of the intervals hold the truth, within what chance gives in 9999 of 10 000."""
    inside = covered(columns)
    low, high = binom.interval(0.9999, len(inside), 0.95)
    return bool(low <= inside.sum() <= high)
