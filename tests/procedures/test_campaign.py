"""Whole runs through drivers and bytes, by the hundred: is the stated uncertainty true?"""

import asyncio
import math

import numpy as np
import pytest

from northfinder.config import load_config
from northfinder.procedures.events import Event
from northfinder.procedures.north_seek import Plan, run
from northfinder.procedures.north_seek_json import JsonObject, north_seek_json
from northfinder.wiring import build_rig, event_loop
from tests.evidence import Record

RUNS = 500


def seek(simulation: dict[str, float], latitude_deg: float, plan: Plan) -> JsonObject:
    config = load_config(
        None, {}, {"simulation": simulation, "site": {"latitude_deg": latitude_deg}}
    )

    async def ignore(_: Event) -> None: ...

    async def find() -> JsonObject:
        async with build_rig(config) as rig:
            return north_seek_json(await run(rig, plan, ignore))

    with asyncio.Runner(loop_factory=event_loop(config, math.inf)) as runner:
        return runner.run(find())


@pytest.mark.proof
@pytest.mark.timeout(1200)
def test_the_interval_covers_the_truth_as_often_as_it_says(record_property: Record) -> None:
    """Any azimuth, tilt to 10 deg, latitude to 75 deg; a binomial band of 99.9 %."""
    random = np.random.default_rng(2026)
    plan = Plan(positions=8, dwell_s=0.4, settle_s=0.1)
    errors_deg, covered, sigmas_deg = [], 0, []
    for seed in range(RUNS):
        tilt, towards = random.uniform(0.0, 10.0), random.uniform(0.0, 2 * np.pi)
        truth = {
            "azimuth_deg": random.uniform(0.0, 360.0),
            "pitch_deg": tilt * np.cos(towards),
            "roll_deg": tilt * np.sin(towards),
            "seed": seed,
        }
        result = seek(truth, random.uniform(-75.0, 75.0), plan)
        error_deg = (result["azimuth_deg"] - truth["azimuth_deg"] + 180.0) % 360.0 - 180.0
        low_deg, high_deg = result["azimuth_interval95_deg"]
        covered += abs(error_deg) <= (high_deg - low_deg) / 2
        errors_deg.append(error_deg)
        sigmas_deg.append(result["azimuth_sigma_deg"])
    band = 3.3 * math.sqrt(0.95 * 0.05 / RUNS)
    record_property("measured", f"{covered} of {RUNS} = {100 * covered / RUNS:.1f} %")
    assert abs(covered / RUNS - 0.95) < band
    assert np.max(np.abs(errors_deg) / np.array(sigmas_deg)) < 6.0  # Student's t, 13 dof, 500 runs
