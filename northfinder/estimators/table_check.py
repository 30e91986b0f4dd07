"""What the gyro saw of the table's moves, against what the table said.

The gyro's vertical axes feel every move, to some thousandths of a degree. They are the only
witness to errors that leave the fit, the residuals and the Earth rate nearly as they are: a table
that turns the other way than is configured, which mirrors the azimuth; a plate that slips on a
motor whose encoder does not, at once or little by little; a bench that is turned meanwhile.
"""

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.arrays import FloatArray, as_finite
from northfinder.estimators.checks import Check, Status
from northfinder.units import DEG

_LEAST_MOVE_RAD = 3.0 * DEG
_WARN_SCALE, _FAIL_SCALE = 0.01, 0.05  # of a gyro's scale factor: no FOG's is so far off
#: What a gyro tells of one move, at best: its noise, and what its bias wanders meanwhile.
_LEAST_SIGMA_RAD = 0.002 * DEG
_TO_SIGMA = 1.4826  # median absolute deviation of normal noise
_SIGMAS = 4.0
_FAIL_SIGMAS = 3.0  # of the azimuth, beyond what is noise


def check_table(
    angle_rad: ArrayLike, turned_rad: ArrayLike, segment: ArrayLike, sigma_rad: float
) -> Check:
    """Compare the moves between visits with what the gyro saw of them.

    Its scale factor is taken from the moves themselves. What is left of each adds up to how far
    the plate came away from the table's angle, and that is what the azimuth is off by.

    Args:
        angle_rad: The table's angle at each visit, in time order, ``(n,)``.
        turned_rad: How far the gyro saw it turn on the way there, counter-clockwise seen from
            above; NaN where it could not tell; ``(n,)``.
        segment: Label of each visit's segment, ``(n,)``. The way to the first of each is not
            judged: it begins wherever the table was left.
        sigma_rad: Of the azimuth, as stated.
    """
    told = np.diff(as_finite("angle_rad", angle_rad))
    seen = np.asarray(turned_rad, dtype=np.float64)[1:]
    together = np.diff(np.asarray(segment)) == 0
    known = together & np.isfinite(seen) & (np.abs(told) > _LEAST_MOVE_RAD)
    if not known.any():
        text = "The gyro could not watch the table turn: which way it turns is as configured."
        return Check("table", "pass", text)
    told, seen, visit = told[known], seen[known], np.flatnonzero(known) + 2
    if float(seen @ told) < 0.0:
        text = (
            "The gyro saw the table turn the other way than it said, so the azimuth is mirrored: "
            "change positive_direction in [turntable] and measure again."
        )
        return Check("table", "fail", text)
    scale = float(seen @ told) / float(told @ told)
    if abs(scale - 1.0) > _WARN_SCALE:
        return _wrong_scale(scale)
    return _agreement(seen - scale * told, visit, sigma_rad)


def _wrong_scale(scale: float) -> Check:
    status: Status = "fail" if abs(scale - 1.0) > _FAIL_SCALE else "warn"
    text = (
        f"The gyro saw {scale:.3f} times the turns that the table said (limit 1 +- "
        f"{_WARN_SCALE:g}): check the gyro's scale factor and the table's, and its plate for slip."
    )
    return Check("table", status, text)


def _agreement(apart: FloatArray, visit: np.ndarray, sigma_rad: float) -> Check:
    course = np.concatenate([[0.0], np.cumsum(apart)])
    away = float(np.ptp(course))
    each = max(_TO_SIGMA * float(np.median(np.abs(apart - np.median(apart)))), _LEAST_SIGMA_RAD)
    noise = _SIGMAS * each * np.sqrt(len(apart))
    worst = int(np.argmax(np.abs(apart)))
    limit = noise + sigma_rad
    text = (
        f"Over {len(apart)} moves the plate came {away / DEG:.3f} deg away from the table's angle, "
        f"as the gyro saw it (limit {limit / DEG:.3f})"
    )
    if away <= limit:
        return Check("table", "pass", f"{text}.")
    text += f", {abs(apart[worst]) / DEG:.3f} deg of it on the way to visit {visit[worst]}"
    status: Status = "fail" if away > noise + _FAIL_SIGMAS * sigma_rad else "warn"
    advice = "the plate slips, or the bench was turned: make both firm, and measure again."
    return Check("table", status, f"{text}: {advice}")
