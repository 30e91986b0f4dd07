"""Whether a run that ends at its target may end."""

from collections.abc import Sequence

import numpy as np

from northfinder.config import RigConfig
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.procedures.events import Estimate
from northfinder.procedures.plan import FEWEST_FOR_TARGET, Plan
from northfinder.procedures.reduction import reduce_visits
from northfinder.procedures.visits import Visit
from northfinder.units import DEG

FEWEST_DOF = FEWEST_FOR_TARGET - 4  # R, a, b and a drift
_WIDEST_GAP_RAD = 120.001 * DEG  # three angles are the fewest


def target_reached(
    visits: Sequence[Visit], plan: Plan, config: RigConfig, so_far: Estimate | None
) -> bool:
    """Say whether the sigma that the result would state is no larger than the plan's target.

    A run that ended where sigma happens to look small would state too small a one, so it has to
    be honest (`docs/theory.md`): there are degrees of freedom enough, the angles surround the
    table, and where sigma comes from the residuals, the scatter within the visits bears it out.

    Args:
        visits: All of them, in time order.
        plan: The run's.
        config: The rig's.
        so_far: North by the same visits, its sigma by the scatter within them.
    """
    if plan.target_sigma_deg is None or so_far is None:
        return False
    target_rad = plan.target_sigma_deg * DEG
    borne_out = config.gyro.noise_deg_sqrt_h is not None or so_far.sigma_rad <= target_rad
    surrounded = _widest_gap_rad(so_far.gyro) <= _WIDEST_GAP_RAD
    if not borne_out or not surrounded or so_far.gyro.dof < FEWEST_DOF:
        return False
    seek = reduce_visits(visits, plan, config)
    return float(seek.budgets["coordinate_transform"].sigma_rad) <= target_rad


def _widest_gap_rad(fit: HarmonicFit) -> float:
    angles_rad = np.sort(np.mod(fit.design.angle_rad, 2 * np.pi))
    gaps_rad = np.diff(angles_rad, append=angles_rad[0] + 2 * np.pi)
    return float(np.max(gaps_rad))
