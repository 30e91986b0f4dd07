"""What the gyro saw of the table's moves, against what the table said.

The gyro's vertical axes feel every move. They are the only witness to two errors that leave the
fit, the residuals and the Earth rate as they are: a table that turns the other way than is
configured, which mirrors the azimuth, and a plate that slips on a motor whose encoder does not.
"""

import numpy as np
from numpy.typing import ArrayLike

from northfinder.estimators.arrays import FloatArray, as_finite
from northfinder.estimators.checks import Check, Status
from northfinder.units import DEG

_LEAST_MOVE_RAD = 3.0 * DEG
#: Of the move, and besides: a gyro's scale factor, and its noise and bias over the move.
_WARN_SHARE, _WARN_RAD = 0.01, 0.2 * DEG
_FAIL_SHARE, _FAIL_RAD = 0.05, 1.0 * DEG


def check_table(angle_rad: ArrayLike, turned_rad: ArrayLike, segment: ArrayLike) -> Check:
    """Compare the moves between visits with what the gyro saw of them.

    Args:
        angle_rad: The table's angle at each visit, in time order, ``(n,)``.
        turned_rad: How far the gyro saw it turn on the way there, counter-clockwise seen from
            above; NaN where it could not tell; ``(n,)``.
        segment: Label of each visit's segment, ``(n,)``. The way to the first of each is not
            judged: it begins wherever the table was left.
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
    return _agreement(told, seen, visit)


def _agreement(told: FloatArray, seen: FloatArray, visit: np.ndarray) -> Check:
    apart = np.abs(seen - told)
    excess = apart / (_WARN_SHARE * np.abs(told) + _WARN_RAD)
    worst = int(np.argmax(excess))
    text = (
        f"The gyro saw the table turn by {seen[worst] / DEG:.2f} deg on the way to visit "
        f"{visit[worst]}, where it said {told[worst] / DEG:.2f}"
    )
    if excess[worst] <= 1.0:
        return Check("table", "pass", f"{text}: the largest difference of {len(told)} moves.")
    beyond = apart[worst] > _FAIL_SHARE * abs(told[worst]) + _FAIL_RAD
    status: Status = "fail" if beyond else "warn"
    advice = "look for a plate that slips, and check the gyro's scale factor."
    return Check("table", status, f"{text}; {advice}")
