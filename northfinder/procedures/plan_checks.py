"""Checks that a plan asks for: of its target, and of a table that turned steadily."""

import math

import numpy as np

from drivers.interfaces import BoolArray
from northfinder.errors import EstimationError
from northfinder.estimators.checks import Check
from northfinder.estimators.harmonic import fit_harmonic
from northfinder.estimators.uncertainty import AzimuthBudget
from northfinder.procedures.fits import Fitted
from northfinder.procedures.plan import Plan
from northfinder.procedures.segments import planned_visits
from northfinder.units import DEG

_DELAY_SIGMAS = 4.0
_LATE_S = 0.05  # no sensor that is read as it should be is so late


def check_plan(plan: Plan, fitted: Fitted, budget: AzimuthBudget) -> list[Check]:
    """Return the checks that the plan asks for; none of a plan that promised nothing."""
    checks = []
    if plan.target_sigma_deg is not None and plan.ends_at_target:
        visits = len(planned_visits(fitted.visits))
        checks.append(check_target(plan.target_sigma_deg, visits, budget))
    if plan.continuous:
        checks += check_passages(plan, fitted)
    return checks


def check_passages(plan: Plan, fitted: Fitted) -> list[Check]:
    """Say by how much out and back differ, as a delay between the gyro's clock and the table's.

    Samples that are tau late stand at angles that the table has left: that turns the harmonic by
    speed times tau on the way out and by as much the other way on the way back. The mean of both
    does not feel it. A drift differs in sign too and looks the same, so it says nothing of those
    without a way back.
    """
    ways = np.array([visit.direction for visit in fitted.used])
    try:
        out, back = (_phase(fitted, ways == way) for way in ("out", "back"))
    except EstimationError:  # too few of one way
        return []
    speed_rad_s = 2 * math.pi / plan.positions / (plan.dwell_s / plan.visits_per_angle)
    apart_rad = math.remainder(out[0] - back[0], 2 * math.pi)
    sigma_s = math.hypot(out[1], back[1]) / (2 * speed_rad_s)
    delay_s = apart_rad / (2 * speed_rad_s)
    late = abs(delay_s) > _DELAY_SIGMAS * sigma_s and abs(delay_s) > _LATE_S
    text = (
        f"Out and back differ by {apart_rad / DEG:.3f} deg, which they cancel; as a delay of the "
        f"gyro's samples behind the table's positions {delay_s * 1e3:.0f} ms +- "
        f"{2 * sigma_s * 1e3:.0f} ms (2 sigma)"
    )
    advice = ": look for buffers between the instruments and here, and for a drift"
    return [Check("passages", "warn" if late else "pass", text + (advice if late else "."))]


def _phase(fitted: Fitted, mask: BoolArray) -> tuple[float, float]:
    """Return the table angle of north by some of the readings, and its sigma."""
    design = fitted.gyro.design
    fit = fit_harmonic(
        design.angle_rad[mask], fitted.gyro.reading[mask], segment=design.segment[mask]
    )
    a, b = float(fit.a), float(fit.b)
    across = np.array([-b, a]) / (a * a + b * b)
    return math.atan2(b, a), math.sqrt(float(across @ fit.covariance[1:, 1:] @ across))


def check_target(target_deg: float, visits: int, budget: AzimuthBudget) -> Check:
    """Say whether the stated sigma is the one that was asked for, and otherwise what would help.

    Args:
        target_deg: One sigma.
        visits: How many were made.
        budget: Of the azimuth.
    """
    sigma_deg = float(budget.sigma_rad) / DEG
    reached = f"after {visits} visits sigma is {sigma_deg:.3g} deg, target {target_deg:.3g} deg"
    if sigma_deg <= target_deg:
        return Check("target", "pass", reached)
    return Check("target", "warn", f"{reached}: {_help(target_deg, sigma_deg, budget)}")


def _help(target_deg: float, sigma_deg: float, budget: AzimuthBudget) -> str:
    """Say how much longer to measure, or what stands in the way however long that is."""
    noise = sum(float(line.u_rad) ** 2 for line in budget.lines if line.source.endswith("noise"))
    noise_deg2 = noise / DEG**2
    rest_deg2 = sigma_deg**2 - noise_deg2
    spare_deg2 = target_deg**2 - rest_deg2
    if spare_deg2 > 0.0:
        return f"measure {noise_deg2 / spare_deg2:.2g} times as long, or allow a larger sigma"
    others = [line for line in budget.lines if not line.source.endswith("noise")]
    largest = max(others, key=lambda line: float(line.u_rad))
    return (
        f"no longer run reaches it, for what averaging does not see makes {rest_deg2**0.5:.2g} "
        f"deg, most of it the {largest.source}; mend that, or allow a larger sigma"
    )
