"""A campaign's outcome as JSON: what is printed, and what lies beside the seeks."""

import json
from pathlib import Path
from typing import Any

from northfinder.campaign.figure import campaign_figure
from northfinder.campaign.settings import Campaign
from northfinder.campaign.tally import EDGES, Share, Tally
from northfinder.procedures.planning import Prediction
from northfinder.software import version
from northfinder.units import DEG

JsonObject = dict[str, Any]


def campaign_json(campaign: Campaign, prediction: Prediction, tally: Tally) -> JsonObject:
    """Return what a campaign was of, and what came out; percents and degrees."""
    rig = campaign.rig
    stated = {
        "gyro_noise_deg_sqrt_h": rig.gyro.noise_deg_sqrt_h,
        "gyro_bias_instability_deg_h": rig.gyro.bias_instability_deg_h,
        "accel_noise_g_sqrt_hz": rig.accelerometer.noise_g_sqrt_hz,
    }
    every, *classes = (_share_json(share) for share in tally.shares)
    return {
        "kind": "campaign",
        "state": "completed",
        **every,
        "classes": classes,
        "histogram": {"edges": EDGES.tolist(), "seeks": tally.histogram.tolist()},
        "predicted_sigma_deg": prediction.sigma_rad / DEG,
        "seek_duration_s": prediction.duration_s,
        "chosen": prediction.chosen,
        "warnings": prediction.warnings,
        "plan": campaign.plan.model_dump(mode="json"),
        "site": {"latitude_deg": campaign.latitude_rad / DEG},
        "drawn": {
            "seed": campaign.seed,
            "azimuth_deg": campaign.azimuth_deg,
            "tilt_deg": campaign.tilt_deg,
            "outliers": campaign.outliers,
            "outlier_size_deg_h": campaign.outlier_size_deg_h,
        },
        "simulation": rig.simulation.model_dump(mode="json", exclude={"seed", "speed"}),
        "stated": stated,
        "software": {"version": version()},
    }


def _share_json(share: Share) -> JsonObject:
    return {
        "name": share.name,
        "seeks": share.seeks,
        "coverage_percent": 100.0 * share.coverage,
        "coverage_band_percent": [100.0 * end for end in share.band],
        "wrong": share.wrong,
        "wrong_by_chance": share.by_chance,
        "scatter_deg": share.scatter_deg,
        "scatter_over_sigma": share.over_sigma,
        "scatter_over_bound": share.over_bound,
    }


def write_summary(folder: Path, result: JsonObject, tally: Tally) -> list[str]:
    """Write the figure and the outcome beside the seeks; returns the names of all three files."""
    texts = {"campaign.svg": campaign_figure(tally), "summary.json": json.dumps(result, indent=1)}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [str(folder / name) for name in ("seeks.parquet", *texts)]
