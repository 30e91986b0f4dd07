"""A north-seek's result as REST, the records and the command line show it: degrees, plain JSON."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.tilt import TiltEstimate
from northfinder.procedures.events import Estimate
from northfinder.procedures.fits import Search
from northfinder.procedures.plain_json import checks_json, or_null, visit_json, wrapped_deg
from northfinder.procedures.planning import budget_json
from northfinder.procedures.reduction import NorthSeek
from northfinder.samples import Samples
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_HOUR_PER_HOUR

JsonObject = dict[str, Any]


def north_seek_json(seek: NorthSeek) -> JsonObject:
    """Return every number of the result; azimuths in [0, 360), null for what is not determined.

    The 95 % interval alone is not wrapped: its ends stay in order around the azimuth.
    """
    solution, budget = (
        seek.solutions["coordinate_transform"],
        seek.budgets["coordinate_transform"],
    )
    azimuth_deg = wrapped_deg(float(solution.azimuth_rad) / DEG)
    half_width_deg = float(budget.interval95_rad) / DEG
    earth = seek.earth_rate
    return {
        "azimuth_deg": azimuth_deg,
        "azimuth_sigma_deg": float(budget.sigma_rad) / DEG,
        "azimuth_interval95_deg": [azimuth_deg - half_width_deg, azimuth_deg + half_width_deg],
        "reference_azimuth_deg": wrapped_deg(azimuth_deg + seek.reference_offset_rad / DEG),
        "solutions": {
            method: {
                "azimuth_deg": wrapped_deg(float(seek.solutions[method].azimuth_rad) / DEG),
                "sigma_deg": float(seek.budgets[method].sigma_rad) / DEG,
            }
            for method in seek.solutions
        },
        "segments": _segments_json(seek.gyro),
        "gyro_fit": _gyro_fit_json(seek.gyro, [visit.gyro for visit in seek.used]),
        "accelerometer_fit": _fit_json(
            seek.accelerometer, [visit.accelerometer for visit in seek.used], 1.0, "g", "g2"
        ),
        "left_out": left_out_json(seek.searches),
        "tilt": _tilt_json(seek.tilt),
        "earth_rate": {
            "horizontal_measured_deg_h": float(earth.measured_rad_s) / DEG_PER_HOUR,
            "horizontal_expected_deg_h": float(earth.expected_rad_s) / DEG_PER_HOUR,
            "z": or_null(earth.z),
        },
        "budget": budget_json(budget),
        "checks": checks_json(seek.checks),
        "visits": [visit_json(visit) for visit in seek.visits],
    }


def estimate_json(estimate: Estimate) -> JsonObject:
    """Return north so far, in the result's own names."""
    return {
        "azimuth_deg": wrapped_deg(estimate.azimuth_rad / DEG),
        "azimuth_sigma_deg": estimate.sigma_rad / DEG,
        "visits": estimate.visits,
        "gyro_fit": _gyro_fit_json(estimate.gyro, ()),
        "segments": _segments_json(estimate.gyro),
        "left_out": left_out_json(estimate.searches),
        "tilt": _tilt_json(estimate.tilt),
        "checks": checks_json(estimate.checks),
    }


def left_out_json(searches: Sequence[Search]) -> list[JsonObject]:
    """Return the visits that do not belong, and how many times the others' scatter each is off."""
    return [
        {"visit": visit.index, "sensor": search.sensor, "times": times}
        for search in searches
        for visit, times in search.left_out
    ]


def _segments_json(gyro: HarmonicFit) -> list[JsonObject]:
    """Return each segment's bias at its middle; those that take no part are not among them."""
    return [
        {
            "segment": terms.label,
            "R_deg_h": float(terms.R) / DEG_PER_HOUR,
            "drift_deg_h_h": (
                float(terms.drift[0]) / DEG_PER_HOUR_PER_HOUR if len(terms.drift) else None
            ),
        }
        for terms in gyro.segments
    ]


def _gyro_fit_json(fit: HarmonicFit, samples: Sequence[Samples]) -> JsonObject:
    return _fit_json(fit, samples, DEG_PER_HOUR, "deg_h", "deg2_h2")


def _fit_json(
    fit: HarmonicFit, samples: Sequence[Samples], unit: float, suffix: str, squared: str
) -> JsonObject:
    """Chi-square is against the given noise, else against the scatter within the visits."""
    covariance = np.asarray(fit.covariance) / unit**2
    chi2 = fit.chi2 if fit.sigma_known else _chi2_within(fit, samples)
    return {
        f"R_{suffix}": float(fit.R) / unit,
        f"a_{suffix}": float(fit.a) / unit,
        f"b_{suffix}": float(fit.b) / unit,
        f"covariance_{squared}": [[float(value) for value in row] for row in covariance],
        f"residual_sigma_{suffix}": or_null(fit.residual_sigma / unit),
        "chi2": or_null(chi2),
        "dof": fit.dof,
    }


def _chi2_within(fit: HarmonicFit, samples: Sequence[Samples]) -> float:
    within = np.array([part.sigma for part in samples])
    if not np.all(within > 0.0):  # samples that are all alike: nothing to compare with
        return math.nan
    return float(np.sum((fit.residuals / within) ** 2))


def _tilt_json(tilt: TiltEstimate) -> JsonObject:
    return {
        "epsilon_deg": float(tilt.epsilon_rad) / DEG,
        "zeta_deg": or_null(tilt.zeta_rad / DEG),
        "pitch_deg": float(tilt.pitch_rad) / DEG,
        "roll_deg": float(tilt.roll_rad) / DEG,
        "sigma_deg": float(tilt.sigma_rad) / DEG,
    }
