"""Whether the bench, or the plate on its motor, turned about the vertical while the run went on.

Such a turn moves the cosine without leaving it: of one turn by 1 deg in the midst of a run the
chi-square of all visits shows next to nothing, and the result is neither the azimuth of before
nor that of after. So it is looked for in person: a column for each turn that could have happened,
held against what the model leaves free (Frisch and Waugh, as for an unfitted drift).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.arrays import FloatArray, as_finite
from northfinder.estimators.checks import WARN_PROBABILITY, Check, Status
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.student import student_quantile
from northfinder.units import DEG

#: Of the stated sigma: beyond it the azimuth is neither that of before nor that of after.
FAIL_SIGMAS = 3.0
_LEAST_DOF = 3
_FREE = 1e-6  # of a column's square: less is the model's own


def check_turned(
    fit: HarmonicFit, slope: ArrayLike, sigma_rad: float, visit: Sequence[int]
) -> Check:
    """Look for a sudden turn before any of the visits, a creep with time, a lag with the motion.

    Args:
        fit: The gyro's; its readings in time order.
        slope: Derivative of each reading by the azimuth, ``(n,)``.
        sigma_rad: Of the azimuth, as stated.
        visit: Which visit each reading is of, counted from 0.
    """
    if fit.dof < _LEAST_DOF:
        return Check("turned", "pass", "The visits are too few to tell whether the bench turned.")
    shapes = _shapes(fit)
    columns = fit.design.whiten(as_finite("slope", slope) * shapes)
    seen = fit.design.free(columns)
    square = np.sum(seen**2, axis=1)
    told = square > _FREE * np.sum(columns**2, axis=1)
    pull = seen @ fit.design.free(fit.design.whiten(fit.reading))
    gain = np.divide(pull**2, square, out=np.zeros(len(shapes)), where=told)
    worst = int(np.argmax(gain))
    if gain[worst] == 0.0:
        return Check("turned", "pass", "The visits cannot tell whether the bench turned.")
    rest = max(float(fit.chi2 - gain[worst]), 0.0) / (fit.dof - 1)
    # A noise that is given tells more than what is left of a few visits, unless that is more.
    rest = max(rest, 1.0) if fit.sigma_known else rest
    times = float(np.sqrt(gain[worst] / rest)) if rest > 0.0 else np.inf
    dof = np.inf if fit.sigma_known else fit.dof - 1
    limit = float(student_quantile(1.0 - WARN_PROBABILITY / (2 * len(shapes)), dof))
    turn_rad = float(pull[worst] / square[worst])
    return _verdict(
        _in_words(worst, len(shapes), turn_rad, visit), times, limit, turn_rad / sigma_rad
    )


def _shapes(fit: HarmonicFit) -> FloatArray:
    """Return the course of each turn over the run: 0 to 1, ``(m, n)``; the last two are slow."""
    n = len(fit.design.angle_rad)
    order = np.arange(n)
    sudden = (order >= order[1:, np.newaxis]).astype(np.float64)
    slow = [order.astype(np.float64), fit.design.angle_rad]
    return np.concatenate([sudden, [(each - each.min()) / (np.ptp(each) or 1.0) for each in slow]])


def _in_words(worst: int, shapes: int, turn_rad: float, visit: Sequence[int]) -> str:
    way = "clockwise" if turn_rad > 0.0 else "counter-clockwise"
    size = f"{abs(turn_rad) / DEG:.2g} deg {way}"
    if worst == shapes - 1:
        return f"a lag of the plate behind the table's angle, by {size} over the turn"
    if worst == shapes - 2:
        return f"a slow turn, by {size} over the run"
    return f"a turn by {size} before about visit {visit[worst + 1] + 1}"


def _verdict(what: str, times: float, limit: float, sigmas: float) -> Check:
    if times <= limit:
        text = f"Nothing turned: {what}, would be {times:.1f} sigma (limit {limit:.1f})."
        return Check("turned", "pass", text)
    status: Status = "fail" if abs(sigmas) > FAIL_SIGMAS else "warn"
    text = (
        f"The readings show {what}: {times:.1f} sigma (limit {limit:.1f}). The azimuth is neither "
        "that of before nor that of after: make the bench and the plate stand firmly, and measure "
        "again."
    )
    return Check("turned", status, text)
