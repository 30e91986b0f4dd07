"""What a plan leaves open, chosen by what it is predicted to bring."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from northfinder.errors import ConfigError
from northfinder.estimators.uncertainty import SystematicUncertainty
from northfinder.ports import SIMULATED
from northfinder.procedures.plan import (
    FEWEST_FOR_TARGET,
    LONGEST_DWELL_S,
    MOST_VISITS,
    Plan,
    systematic,
)
from northfinder.procedures.prediction import (
    budget_of,
    course,
    planned_ends_s,
    promise,
    shortest_dwell_s,
)
from northfinder.procedures.visits import Order
from northfinder.rig import Rig
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR

_TRIAL_DWELL_S = 5.0
_POSITIONS = (6, 8, 12, 16, 24, 36)
_REVOLUTIONS = (1, 2, 3, 4)
_SECTORS = 24
_TURNS = (1, 2, 4, 8)  # of a table that does not stop: the faster, the less the bias wanders
_OVER_PLANNED = 2  # a run that looks for its target gives up after twice the visits planned


def choose(plan: Plan, rig: Rig) -> tuple[Plan, str | None]:
    """Return a plan with nothing left open, and a sentence that says what was chosen and why.

    Raises:
        ConfigError: The target cannot be reached.
        EstimationError: No north is observable at this latitude.
    """
    if plan.order == "auto":
        return _automatic(plan, rig)
    if plan.target_sigma_deg is not None and plan.most_visits is None:
        chosen = for_target(plan, plan.target_sigma_deg, rig, systematic(rig.config))
        return chosen, _of_target(chosen, plan.target_sigma_deg)
    return plan, None


def _of_target(plan: Plan, target_deg: float) -> str:
    spread = "" if plan.continuous else ", and takes opposite angles, pairs far from one another"
    return (
        f"{plan.dwell_s:.3g} s at each angle are expected to bring {target_deg:.3g} deg; the run "
        f"ends as soon as it states that, at the latest after {plan.most_visits} visits{spread}"
    )


def _automatic(plan: Plan, rig: Rig) -> tuple[Plan, str]:
    known = systematic(rig.config)
    if plan.target_sigma_deg is not None:  # by what the result will state
        return _quickest(plan, plan.target_sigma_deg, rig, known)
    return _finest(plan, rig, replace(known, bias_instability_rad_s=_bias_instability(rig)))


def _bias_instability(rig: Rig) -> float:
    """Return the configured one, else the simulation's, else the data sheet's, rad/s."""
    gyro = rig.config.gyro
    if gyro.bias_instability_deg_h:
        return gyro.bias_instability_deg_h * DEG_PER_HOUR
    if gyro.link == SIMULATED:
        return rig.config.simulation.gyro_bias_instability_deg_h * DEG_PER_HOUR
    return rig.gyro.sensor.noise.bias_instability_rad_s


def _quickest(
    plan: Plan, target_deg: float, rig: Rig, known: SystematicUncertainty
) -> tuple[Plan, str]:
    """Take what reaches the target in the least time.

    Raises:
        ConfigError: Nothing does.
    """
    shapes = _shapes(plan, ("opposite",))
    plans = [each for shape in shapes if (each := _reaching(shape, target_deg, rig, known)[0])]
    if not plans:
        return for_target(shapes[-1], target_deg, rig, known), ""
    durations_s = [promise(each, rig, known).duration_s for each in plans]
    best = int(np.argmin(durations_s))
    why = f"the least time for {target_deg:.3g} deg by {_noise_in_words(rig, known)}"
    if plan.allowed_s is not None and durations_s[best] > plan.allowed_s:
        why += f", longer than the {plan.allowed_s:.4g} s allowed"
    return plans[best], f"{_shape_in_words(plans[best])}: {why}"


def _finest(plan: Plan, rig: Rig, known: SystematicUncertainty) -> tuple[Plan, str]:
    """Take what brings the smallest sigma within the time allowed.

    Raises:
        ConfigError: It is too short for any.
    """
    usual = plan.model_copy(
        update={"order": "out-and-back", "modulation": "indexed", "allowed_s": None}
    )
    allowed_s = plan.allowed_s or promise(usual, rig, known).duration_s
    shapes = _shapes(plan, ("opposite", "out-and-back", "sequential"))
    plans = [each for shape in shapes if (each := _filling(shape, allowed_s, rig)) is not None]
    if not plans:
        msg = (
            f"{allowed_s:g} s are too short for a north-seek on this rig: finding the reference, "
            f"moving and settling leave no time to measure. Allow more"
        )
        raise ConfigError(msg)
    sigmas_rad = [promise(each, rig, known).sigma_rad for each in plans]
    best = int(np.argmin(sigmas_rad))
    why = (
        f"the smallest sigma, {sigmas_rad[best] / DEG:.3g} deg, within {allowed_s:.4g} s by "
        f"{_noise_in_words(rig, known)}"
    )
    return plans[best], f"{_shape_in_words(plans[best])}: {why}"


def _shapes(plan: Plan, orders: Sequence[Order]) -> list[Plan]:
    """Return the plans to choose among, their dwell still open; all state an honest interval."""
    choices: list[dict[str, Any]] = [
        {"modulation": "indexed", "order": order, "positions": n, "revolutions": times}
        for order, n, times in product(orders, _POSITIONS, _REVOLUTIONS)
    ]
    choices += [
        {
            "modulation": "continuous",
            "order": "out-and-back",
            "positions": _SECTORS,
            "revolutions": times,
        }
        for times in _TURNS
    ]
    shapes = [
        plan.model_copy(update={**choice, "allowed_s": None})
        for choice in choices
        if plan.modulation in {"auto", choice["modulation"]}
    ]
    return [each for each in shapes if each.positions * each.visits_per_angle >= FEWEST_FOR_TARGET]


def _filling(shape: Plan, allowed_s: float, rig: Rig) -> Plan | None:
    """Return a plan with the dwell that fills the time; None where it would be too short."""
    visits = course(shape)
    away_s = planned_ends_s(shape, visits, rig)[-1] - sum(visit.dwell_s for visit in visits)
    dwell_s = min((allowed_s - away_s) / shape.positions, LONGEST_DWELL_S)
    if dwell_s < _shortest_dwell_s(shape, rig):
        return None
    return shape.model_copy(update={"dwell_s": dwell_s})


def _shortest_dwell_s(shape: Plan, rig: Rig) -> float:
    """Return the dwell that the slower sensor needs, and a table that does not stop."""
    visit_s = shortest_dwell_s(rig)
    if shape.continuous:
        visit_s = max(visit_s, 2 * math.pi / shape.positions / rig.motion_limits.speed_rad_s)
    return visit_s * shape.visits_per_angle


def _shape_in_words(plan: Plan) -> str:
    times = "once" if plan.revolutions == 1 else f"{plan.revolutions} times"
    how = "turning steadily out and back" if plan.continuous else plan.order
    return f"{plan.positions} angles, {plan.dwell_s:.3g} s each in all, {how} {times}"


def _noise_in_words(rig: Rig, known: SystematicUncertainty) -> str:
    noise = rig.gyro.expected_noise_sqrt_s / DEG_PER_SQRT_HOUR
    instability = known.bias_instability_rad_s / DEG_PER_HOUR
    return f"a noise of {noise:.2g} deg/sqrt(h) and a bias instability of {instability:.2g} deg/h"


def for_target(plan: Plan, target_deg: float, rig: Rig, known: SystematicUncertainty) -> Plan:
    """Choose the dwell whose predicted sigma is the target.

    Raises:
        ConfigError: The target cannot be reached.
        EstimationError: No north is observable at this latitude.
    """
    chosen, rest_rad = _reaching(plan, target_deg, rig, known)
    if chosen is None:
        msg = (
            f"a sigma of {target_deg:g} deg cannot be reached within {LONGEST_DWELL_S:g} s at "
            f"each angle: what averaging does not see makes {rest_rad / DEG:.2g} deg of it. Take "
            f"a larger target or more positions"
        )
        raise ConfigError(msg)
    return chosen


def _reaching(
    plan: Plan, target_deg: float, rig: Rig, known: SystematicUncertainty
) -> tuple[Plan | None, float]:
    """Return the plan that reaches a target, if any, and what averaging does not see, rad.

    Noise falls with the dwell, the rest stays. The dwell chosen does not depend on the plan's
    own. The order is that of opposite angles, and the revolutions are enough for a run that may
    end as soon as its interval is honest.
    """
    revolutions = max(plan.revolutions, math.ceil(FEWEST_FOR_TARGET / (2 * plan.positions)))
    visits = 2 * revolutions * plan.positions
    order = "out-and-back" if plan.continuous else "opposite"
    opened = {"order": order, "revolutions": revolutions, "most_visits": visits}
    trial, rest_rad = plan.model_copy(update=opened), 0.0
    shortest_s = _shortest_dwell_s(trial, rig)
    trial = trial.model_copy(update={"dwell_s": max(_TRIAL_DWELL_S, shortest_s)})
    for _ in range(5):  # the flicker's part depends on the timing, weakly
        dwell_s, rest_rad = _dwell_for_target(trial, target_deg, rig, known)
        if dwell_s > LONGEST_DWELL_S:
            return None, rest_rad
        trial = trial.model_copy(update={"dwell_s": max(dwell_s, shortest_s)})
    bound = min(_OVER_PLANNED * visits, MOST_VISITS // plan.visits_per_look * plan.visits_per_look)
    return trial.model_copy(update={"most_visits": bound}), rest_rad


def _dwell_for_target(
    trial: Plan, target_deg: float, rig: Rig, known: SystematicUncertainty
) -> tuple[float, float]:
    """Return the dwell that would bring the target, were it not for the timing, and the rest."""
    visits = course(trial)
    budget = budget_of(trial, visits, planned_ends_s(trial, visits, rig), rig, known)
    noise = sum(float(line.u_rad) ** 2 for line in budget.lines if line.source.endswith("noise"))
    rest = float(budget.sigma_rad) ** 2 - noise
    dwell_s = trial.dwell_s * noise / max((target_deg * DEG) ** 2 - rest, 1e-30)
    return dwell_s, math.sqrt(rest)
