"""What a north-seek will take and what it will achieve, before anything moves."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivers.interfaces import MotionLimits
from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.estimators.design import harmonic_design
from northfinder.estimators.prediction import predict_azimuth
from northfinder.estimators.uncertainty import AzimuthBudget, SystematicUncertainty
from northfinder.procedures.plan import (
    LONGEST_DWELL_S,
    Plan,
    chosen_order,
    drift_order,
    systematic,
)
from northfinder.procedures.visits import Order, PlannedVisit, schedule
from northfinder.rig import Rig
from northfinder.units import DEG

HIGH_LATITUDE_DEG = 80.0
_FEWEST_SAMPLES = 10  # a visit's mean needs a standard error
_TRIAL_DWELL_S = 5.0
_ARRIVAL_S = 0.1  # polls of the table and the last tenth of a second of settling
_HOMING_TURNS = 1.0


@dataclass(frozen=True, slots=True)
class Prediction:
    """A plan with nothing left open, and what it promises.

    Attributes:
        plan: With the order and the dwell chosen.
        visits: In time order.
        end_s: When each visit will be over, from the start of the run.
        homing_s: Time set aside to find the table's reference.
        duration_s: Of the whole run.
        motion_limits: How fast the table will turn.
        budget: Of the azimuth, at the least favourable azimuth.
        warnings: Sentences for whoever is about to start it.
    """

    plan: Plan
    visits: list[PlannedVisit]
    end_s: list[float]
    homing_s: float
    duration_s: float
    motion_limits: MotionLimits
    budget: AzimuthBudget
    warnings: list[str]

    @property
    def sigma_rad(self) -> float:
        """Return the predicted standard uncertainty of the azimuth."""
        return float(self.budget.sigma_rad)

    def to_json(self) -> dict[str, Any]:
        """Return it as REST and the command line show it, degrees."""
        return {
            "duration_s": self.duration_s,
            "azimuth_sigma_deg": self.sigma_rad / DEG,
            "motion_limits": _motion_limits_json(self.motion_limits),
            "budget": budget_json(self.budget),
            "warnings": self.warnings,
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


def predict(plan: Plan, rig: Rig) -> Prediction:
    """Work out duration, uncertainty and warnings on an open rig, without moving it.

    Raises:
        ConfigError: The rig has no table, the dwell is too short for the sensors, or the target
            cannot be reached.
        EstimationError: No north is observable at this latitude.
    """
    if not rig.turns:
        msg = (
            "[turntable] driver = 'fixed': a north-seek turns a table, and this rig has none; "
            "align instead"
        )
        raise ConfigError(msg)
    if plan.order == "auto":
        plan = plan.model_copy(update={"order": _best_order(plan, rig)})
    if plan.target_sigma_deg is not None:
        plan = plan.model_copy(update={"dwell_s": _dwell_for_target(plan, rig)})
    return _predict(plan, rig, systematic(rig.config))


def _best_order(plan: Plan, rig: Rig) -> Order:
    """Take the order with the smallest predicted sigma; the flicker makes the difference."""
    known = systematic(rig.config)
    if known.bias_instability_rad_s == 0.0:
        data_sheet = rig.gyro.sensor.noise.bias_instability_rad_s
        known = replace(known, bias_instability_rad_s=data_sheet)
    orders: tuple[Order, ...] = ("out-and-back", "opposite", "sequential")
    sigmas_rad = [
        _predict(plan.model_copy(update={"order": order}), rig, known).sigma_rad for order in orders
    ]
    return orders[int(np.argmin(sigmas_rad))]


def _dwell_for_target(plan: Plan, rig: Rig) -> float:
    """Choose the dwell whose predicted sigma is the target: noise falls with it, the rest stays.

    It does not depend on the plan's own dwell, so that a chosen plan predicts itself.
    """
    target_deg = plan.target_sigma_deg or 0.0
    shortest_s = _shortest_dwell_s(rig) * plan.visits_per_angle
    plan = plan.model_copy(update={"dwell_s": max(_TRIAL_DWELL_S, shortest_s)})
    for _ in range(5):  # the flicker's part depends on the timing, weakly
        prediction = _predict(plan, rig, systematic(rig.config))
        lines = prediction.budget.lines
        noise = sum(float(line.u_rad) ** 2 for line in lines if line.source.endswith("noise"))
        rest = prediction.sigma_rad**2 - noise
        dwell_s = plan.dwell_s * noise / max((target_deg * DEG) ** 2 - rest, 1e-30)
        if dwell_s > LONGEST_DWELL_S:
            msg = (
                f"a sigma of {target_deg:g} deg cannot be reached within {LONGEST_DWELL_S:g} s at "
                f"each angle: what averaging does not see makes {math.sqrt(rest) / DEG:.2g} deg of "
                f"it. Take a larger target or more positions"
            )
            raise ConfigError(msg)
        plan = plan.model_copy(update={"dwell_s": max(dwell_s, shortest_s)})
    return plan.dwell_s


def _predict(plan: Plan, rig: Rig, known: SystematicUncertainty) -> Prediction:
    visits = schedule(plan.positions, plan.dwell_s, chosen_order(plan), plan.revolutions)
    _check_dwell(visits[0].dwell_s, rig)
    homing_s = _move_s(_HOMING_TURNS * 2 * math.pi, rig.motion_limits)
    end_s = _ends(plan, visits, rig.motion_limits, homing_s)
    budget = _budget(plan, visits, end_s, rig, known)
    warnings = _warnings(plan, rig.config)
    limits = rig.motion_limits
    return Prediction(plan, visits, end_s, homing_s, end_s[-1], limits, budget, warnings)


def _shortest_dwell_s(rig: Rig) -> float:
    axes = (rig.gyro, rig.accelerometer)
    return _FEWEST_SAMPLES * max(axis.sensor.sample_period_s for axis in axes)


def _check_dwell(dwell_s: float, rig: Rig) -> None:
    shortest_s = _shortest_dwell_s(rig)
    if dwell_s < shortest_s * (1 - 1e-9):
        msg = (
            f"each visit would last {dwell_s:g} s, but the slower sensor needs {shortest_s:g} s "
            f"for {_FEWEST_SAMPLES} samples: lengthen the dwell or take fewer revolutions"
        )
        raise ConfigError(msg)


def _ends(
    plan: Plan, visits: list[PlannedVisit], limits: MotionLimits, homing_s: float
) -> list[float]:
    now_s, angle_rad, ends = homing_s, 0.0, []
    for visit in visits:
        now_s += _move_s(abs(visit.angle_rad - angle_rad), limits)
        now_s += max(plan.settle_s, _ARRIVAL_S) + _ARRIVAL_S + visit.dwell_s
        angle_rad = visit.angle_rad
        ends.append(now_s)
    return ends


def _move_s(distance_rad: float, limits: MotionLimits) -> float:
    """Return the time of a trapezoidal move, or of a triangular one that is too short for it."""
    ramps_rad = limits.speed_rad_s**2 / limits.acceleration_rad_s2
    if distance_rad < ramps_rad:
        return 2 * math.sqrt(distance_rad / limits.acceleration_rad_s2)
    return distance_rad / limits.speed_rad_s + limits.speed_rad_s / limits.acceleration_rad_s2


def _budget(
    plan: Plan,
    visits: list[PlannedVisit],
    end_s: list[float],
    rig: Rig,
    known: SystematicUncertainty,
) -> AzimuthBudget:
    config = rig.config
    dwell_s = np.array([visit.dwell_s for visit in visits])
    angle_rad = np.array([visit.angle_rad for visit in visits])
    gyro = harmonic_design(
        angle_rad + config.gyro.mount_angle_deg * DEG,
        rig.gyro.expected_noise_sqrt_s / np.sqrt(dwell_s),
        np.array(end_s) - dwell_s / 2,
        drift_order(chosen_order(plan), len(visits)),
    )
    accelerometer = harmonic_design(
        angle_rad + config.accelerometer.mount_angle_deg * DEG,
        rig.accelerometer.expected_noise_sqrt_s / np.sqrt(dwell_s) / config.site.gravity_g,
    )
    latitude_rad = plan.latitude_rad(config)
    return predict_azimuth(gyro, accelerometer, latitude_rad, known, dwell_s).budget


def _warnings(plan: Plan, config: RigConfig) -> list[str]:
    warnings = []
    latitude_deg = plan.latitude_rad(config) / DEG
    if abs(latitude_deg) > HIGH_LATITUDE_DEG:
        warnings.append(
            f"at a latitude of {latitude_deg:.2f} deg the horizontal Earth rate is small: every "
            f"error counts {1 / math.cos(latitude_deg * DEG):.1f} times as much as at the equator"
        )
    if plan.order == "sequential":
        warnings.append(
            "the order 'sequential' has to fit a drift, at 1.6 times the uncertainty where it "
            "matters most; 'out-and-back' takes equally long and cancels a linear drift"
        )
    return warnings
