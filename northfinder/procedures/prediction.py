"""What a plan with nothing left open will take and achieve."""

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from drivers.interfaces import MotionLimits
from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.estimators.design import harmonic_design
from northfinder.estimators.prediction import predict_azimuth
from northfinder.estimators.uncertainty import AzimuthBudget, SystematicUncertainty
from northfinder.procedures.plan import (
    FEWEST_FOR_TARGET,
    Plan,
    attenuation_of,
    chosen_order,
    drift_orders,
)
from northfinder.procedures.timing import ends_s, homing_s, passage_ends_s
from northfinder.procedures.visits import PlannedVisit, legs, schedule
from northfinder.rig import Rig
from northfinder.units import DEG

HIGH_LATITUDE_DEG = 80.0
FEWEST_SAMPLES = 10  # a visit's mean needs a standard error
_ROUNDING = 1e-6  # of a target that the dwell was chosen for


@dataclass(frozen=True, slots=True)
class Prediction:
    """A plan with nothing left open, and what it promises.

    Attributes:
        plan: With all that was open chosen.
        visits: In time order; of a run that ends at its target, those until then.
        end_s: When each visit will be over, from the start of the run.
        reserve: Visits that follow where the target is not reached by then.
        reserve_end_s: When each of those will be over.
        homing_s: Time set aside to find the table's reference.
        duration_s: Of the whole run.
        motion_limits: How fast the table will turn.
        budget: Of the azimuth, at the least favourable azimuth.
        warnings: Sentences for whoever is about to start it.
        chosen: What was chosen and why, as a sentence; None where nothing was open.
    """

    plan: Plan
    visits: list[PlannedVisit]
    end_s: list[float]
    reserve: list[PlannedVisit]
    reserve_end_s: list[float]
    homing_s: float
    duration_s: float
    motion_limits: MotionLimits
    budget: AzimuthBudget
    warnings: list[str]
    chosen: str | None = None

    @property
    def sigma_rad(self) -> float:
        """Return the predicted standard uncertainty of the azimuth."""
        return float(self.budget.sigma_rad)

    def explained(self, chosen: str) -> Self:
        """Return it with a sentence that says what was chosen and why."""
        return replace(self, chosen=chosen)

    def to_json(self) -> dict[str, Any]:
        """Return it as REST and the command line show it, degrees."""
        return {
            "duration_s": self.duration_s,
            "azimuth_sigma_deg": self.sigma_rad / DEG,
            "motion_limits": _motion_limits_json(self.motion_limits),
            "budget": budget_json(self.budget),
            "warnings": self.warnings,
            "chosen": self.chosen,
            "plan": self.plan.model_dump(mode="json"),
            "schedule": [
                {"angle_deg": visit.angle_rad / DEG, "direction": visit.direction}
                for visit in self.visits
            ],
        }


def _motion_limits_json(limits: MotionLimits) -> dict[str, float | None]:
    acceleration_deg_s2 = limits.acceleration_rad_s2 / DEG
    return {
        "speed_deg_s": limits.speed_rad_s / DEG,
        "acceleration_deg_s2": acceleration_deg_s2 if math.isfinite(acceleration_deg_s2) else None,
    }


def budget_json(budget: AzimuthBudget) -> list[dict[str, Any]]:
    """Return a budget's lines, degrees and shares of the variance."""
    return [
        {"source": line.source, "u_deg": float(line.u_rad) / DEG, "share": float(share)}
        for line, share in zip(budget.lines, budget.shares, strict=True)
    ]


def promise(plan: Plan, rig: Rig, known: SystematicUncertainty) -> Prediction:
    """Work out what a plan takes and brings, on an open rig.

    Raises:
        ConfigError: The dwell is too short for the sensors.
        EstimationError: No north is observable at this latitude.
    """
    visits = course(plan)
    check_dwell(visits[0].dwell_s, rig)
    limits = rig.motion_limits
    begin_s = homing_s(limits)
    check_speed(plan, visits[0].dwell_s, rig)
    end_s = planned_ends_s(plan, visits, rig)
    needed = _needed(plan, visits, end_s, rig, known)
    budget = budget_of(plan, visits[:needed], end_s[:needed], rig, known)
    return Prediction(
        plan,
        visits[:needed],
        end_s[:needed],
        visits[needed:],
        end_s[needed:],
        begin_s,
        end_s[needed - 1],
        limits,
        budget,
        _warnings(plan, rig.config, needed, float(budget.sigma_rad) / DEG),
    )


def course(plan: Plan) -> list[PlannedVisit]:
    """Return every visit that the plan may make, in time order."""
    order = chosen_order(plan)
    if plan.most_visits is None:
        return schedule(plan.positions, plan.dwell_s, order, plan.revolutions)
    rounds = math.ceil(plan.most_visits / (2 * plan.positions))
    dwell_s = plan.dwell_s / plan.revolutions * rounds
    return schedule(plan.positions, dwell_s, order, rounds)[: plan.most_visits]


def _needed(
    plan: Plan,
    visits: Sequence[PlannedVisit],
    end_s: Sequence[float],
    rig: Rig,
    known: SystematicUncertainty,
) -> int:
    """Return after how many visits the target is predicted to be reached, two at a time."""
    if plan.target_sigma_deg is None or not plan.ends_at_target:
        return len(visits)
    target_rad = plan.target_sigma_deg * DEG * (1.0 + _ROUNDING)

    step = plan.visits_per_look

    def reached(looks: int) -> bool:
        n = step * looks
        return bool(budget_of(plan, visits[:n], end_s[:n], rig, known).sigma_rad <= target_rad)

    looks = range(math.ceil(FEWEST_FOR_TARGET / step), len(visits) // step + 1)
    found = bisect_left(looks, True, key=reached)
    return len(visits) if found == len(looks) else step * looks[found]


def planned_ends_s(plan: Plan, visits: Sequence[PlannedVisit], rig: Rig) -> list[float]:
    """Return when each visit will be over, from the start of the run."""
    limits = rig.motion_limits
    ends = passage_ends_s if plan.continuous else ends_s
    return ends(visits, plan.settle_s, limits, homing_s(limits))


def check_speed(plan: Plan, visit_s: float, rig: Rig) -> None:
    """Refuse a steady turn that is faster than the table.

    Raises:
        ConfigError: It is.
    """
    speed_rad_s = 2 * math.pi / plan.positions / visit_s
    highest_rad_s = rig.motion_limits.speed_rad_s
    if plan.continuous and speed_rad_s > highest_rad_s:
        msg = (
            f"the table would have to turn at {speed_rad_s / DEG:.4g} deg/s, and turns at up to "
            f"{highest_rad_s / DEG:.4g} deg/s: lengthen the dwell or take fewer revolutions"
        )
        raise ConfigError(msg)


def shortest_dwell_s(rig: Rig) -> float:
    """Return how long a visit has to last for the slower sensor."""
    axes = (rig.gyro, rig.accelerometer)
    return FEWEST_SAMPLES * max(axis.sensor.sample_period_s for axis in axes)


def check_dwell(dwell_s: float, rig: Rig) -> None:
    """Refuse visits that are too short for the sensors.

    Raises:
        ConfigError: They are.
    """
    shortest_s = shortest_dwell_s(rig)
    if dwell_s < shortest_s * (1 - 1e-9):
        msg = (
            f"each visit would last {dwell_s:g} s, but the slower sensor needs {shortest_s:g} s "
            f"for {FEWEST_SAMPLES} samples: lengthen the dwell or take fewer revolutions"
        )
        raise ConfigError(msg)


def budget_of(
    plan: Plan,
    visits: Sequence[PlannedVisit],
    end_s: Sequence[float],
    rig: Rig,
    known: SystematicUncertainty,
) -> AzimuthBudget:
    """Return the budget that visits promise, at the least favourable azimuth.

    Raises:
        EstimationError: No north is observable at this latitude, or by these visits.
    """
    config = rig.config
    dwell_s = np.array([visit.dwell_s for visit in visits])
    angle_rad = np.array([visit.angle_rad for visit in visits])
    segment = legs(visits) if plan.continuous else [0] * len(visits)
    felt = attenuation_of(visits, plan)
    between = known.slow_noise.covariances(np.array(end_s) - dwell_s, dwell_s)
    white = rig.gyro.expected_noise_sqrt_s / np.sqrt(dwell_s)
    gyro = harmonic_design(
        angle_rad + config.gyro.mount_angle_deg * DEG,
        None if between else white,
        np.array(end_s) - dwell_s / 2,
        drift_orders(chosen_order(plan), np.bincount(segment).tolist()),
        segment,
        covariance=np.diag(white**2) + sum(between.values()) if between else None,
        attenuation=felt,
    )
    accelerometer = harmonic_design(
        angle_rad + config.accelerometer.mount_angle_deg * DEG,
        rig.accelerometer.expected_noise_sqrt_s / np.sqrt(dwell_s) / config.site.gravity_g,
        segment=segment,
        attenuation=felt,
    )
    latitude_rad = plan.latitude_rad(config)
    return predict_azimuth(gyro, accelerometer, latitude_rad, known, dwell_s).budget


def _warnings(plan: Plan, config: RigConfig, visits: int, sigma_deg: float) -> list[str]:
    warnings = []
    latitude_deg = plan.latitude_rad(config) / DEG
    if abs(latitude_deg) > HIGH_LATITUDE_DEG:
        warnings.append(
            f"at a latitude of {latitude_deg:.2f} deg the horizontal Earth rate is small: every "
            f"error counts {1 / math.cos(latitude_deg * DEG):.1f} times as much as at the equator"
        )
    if chosen_order(plan) == "sequential":
        warnings.append(
            "the order 'sequential' has to fit a drift, at 1.6 times the uncertainty where it "
            "matters most; 'out-and-back' takes equally long and cancels a linear drift"
        )
    target_deg = plan.target_sigma_deg or math.inf
    if sigma_deg > target_deg * (1.0 + 2 * _ROUNDING):
        warnings.append(
            f"the target of {target_deg:.3g} deg is not expected to be reached: after all {visits} "
            f"visits sigma will be about {sigma_deg:.3g} deg; lengthen the dwell or take a larger "
            f"target"
        )
    return warnings
