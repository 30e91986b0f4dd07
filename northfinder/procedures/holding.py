"""The heading as the gyro carries it on: pure, from increments to azimuth and its uncertainty."""

import math
from dataclasses import dataclass

import numpy as np

from northfinder.attitude.quaternion import to_matrix
from northfinder.attitude.streaming import AttitudeStream, IncrementMethod
from northfinder.earth import earth_rate_n
from northfinder.errors import AcquisitionError
from northfinder.estimators.uncertainty import AzimuthBudget, BudgetLine
from northfinder.procedures.bridging import Increments
from northfinder.procedures.heading_hold_plan import Start
from northfinder.procedures.mounting import Mounting, TableAttitude, earth_turn
from northfinder.procedures.sensor_errors import SensorErrors
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR

_FLAT_ALLAN = 0.664  # of the bias instability: the Allan deviation of a mean of any length
_AT_REST_RAD_S = 0.01 * DEG  # a second: beyond any bias that could pass for one
_MOVED_RAD = 1.0 * DEG  # of tilt, since the run that found the heading


@dataclass(frozen=True, slots=True)
class Held:
    """The heading at one moment.

    Attributes:
        time_s: Since the start, the rest included.
        table: How the table stands.
        budget: Of its azimuth.
    """

    time_s: float
    table: TableAttitude
    budget: AzimuthBudget


def hold_budget(
    start_sigma_rad: float, errors: SensorErrors, rest_s: float, held_s: float
) -> AzimuthBudget:
    """Return how uncertain a heading is after it was held so long.

    The white noise walks; a bias grows with time: what is not known of it, or after a rest what
    its measurement left, and by how much it has wandered since (flicker, IEEE Std 952: the
    variance of the difference of two means grows with the logarithm of their distance).

    Args:
        start_sigma_rad: Of the heading that it starts from.
        errors: Of the gyro.
        rest_s: How long the biases were measured; 0 where they were not.
        held_s: How long it was held since.
    """
    walk = errors.gyro_noise_deg_sqrt_h * DEG_PER_SQRT_HOUR
    flat = _FLAT_ALLAN * errors.gyro_bias_instability_deg_h * DEG_PER_HOUR
    bias, wandering = errors.gyro_bias_deg_h * DEG_PER_HOUR, flat
    if rest_s:
        bias = walk / math.sqrt(rest_s)
        wandering = flat * math.sqrt(2.0 + math.log1p(held_s / rest_s))
    lines = {
        "heading at the start": start_sigma_rad,
        "gyro noise": walk * math.sqrt(held_s),
        "gyro bias": bias * held_s,
        "bias instability": wandering * held_s,
    }
    return AzimuthBudget(
        tuple(BudgetLine(source, np.asarray(u_rad), math.inf) for source, u_rad in lines.items())
    )


class HeadingHold:
    """Carries a heading on from increments.

    The attitude is kept against the stars; n turns away from its beginning with the Earth. While
    it rests, the mean rate less the Earth's is the bias of each gyro.

    Args:
        start: Where the heading comes from.
        method: How increments are integrated.
        errors: Of the gyro.
        rest_s: How long to rest.
        axis: The instrument's sensing axis, ``x`` to ``-z``.
        angle_rad: Of that axis from the index mark, counter-clockwise, the table's included.
        period_s: Between two samples.

    Attributes:
        bias_rad_s: As measured at rest, in body axes, ``(3,)``.
    """

    def __init__(  # noqa: PLR0913, PLR0917 -- a hold is where these meet
        self,
        start: Start,
        method: IncrementMethod,
        errors: SensorErrors,
        rest_s: float,
        axis: str,
        angle_rad: float,
        period_s: float,
    ) -> None:
        self.bias_rad_s = np.zeros(3)
        self._start = start
        self._errors = errors
        self._axis, self._angle_rad = axis, angle_rad
        self._period_s = period_s
        self._rest_ticks = round(rest_s / period_s)
        self._ticks = 0
        self._turned = np.zeros(3)
        self._mounting: Mounting | None = None
        self._attitude = AttitudeStream(method)

    def add(self, increments: Increments) -> None:
        """Take the increments of some periods.

        Raises:
            AcquisitionError: The instrument stands askew, or not as it did at the start, or does
                not rest where it should; or too many samples are missing to carry a heading over.
        """
        if increments.after_gap:
            msg = (
                f"samples are missing after {self._ticks * self._period_s:.1f} s, too many to "
                f"bridge: whatever the base turned meanwhile is not known. Find the heading again"
            )
            raise AcquisitionError(msg)
        if self._mounting is None:
            self._mounting = self._find_mounting(increments)
        resting = max(0, min(len(increments.angle_rad), self._rest_ticks - self._ticks))
        self._turned += increments.angle_rad[:resting].sum(axis=0)
        self._ticks += len(increments.angle_rad)
        if resting and self._ticks >= self._rest_ticks:
            self._measure_bias(self._mounting)
        if resting < len(increments.angle_rad):
            self._attitude.add(increments.angle_rad[resting:] - self.bias_rad_s * self._period_s)

    @property
    def has_begun(self) -> bool:
        """Return whether a heading is held yet."""
        return self._mounting is not None

    def held(self) -> Held:
        """Return the heading now.

        Raises:
            ValueError: Nothing has been added yet.
        """
        if self._mounting is None:
            msg = "no heading is held yet: add increments first"
            raise ValueError(msg)
        held_s = max(0, self._ticks - self._rest_ticks) * self._period_s
        rest_s = self._rest_ticks * self._period_s
        body_to_start = to_matrix(self._attitude.attitude)
        to_n = earth_turn(self._latitude_rad, held_s) @ self._mounting.body_to_n(self._start.table)
        budget = hold_budget(self._start.azimuth_sigma_deg * DEG, self._errors, rest_s, held_s)
        table = self._mounting.table_attitude(to_n @ body_to_start)
        return Held(self._ticks * self._period_s, table, budget)

    @property
    def _latitude_rad(self) -> float:
        return self._start.latitude_deg * DEG

    def _find_mounting(self, increments: Increments) -> Mounting:
        mean_force_g = increments.velocity_g_s.mean(axis=0) / self._period_s
        mounting = Mounting.found(self._axis, self._angle_rad, mean_force_g)
        up_then = self._start.table.axes_n()[:, 2]
        up_now = mounting.table_axes_b @ mean_force_g / np.linalg.norm(mean_force_g)
        tilted_rad = math.acos(min(1.0, float(up_then @ up_now)))
        if tilted_rad > _MOVED_RAD:
            msg = (
                f"the table is tilted by {tilted_rad / DEG:.2f} deg against run "
                f"{self._start.run_id}: it has moved since. Find the heading again"
            )
            raise AcquisitionError(msg)
        return mounting

    def _measure_bias(self, mounting: Mounting) -> None:
        """Take the mean rate less the Earth's, which at rest is along axes that are known."""
        body_to_n = mounting.body_to_n(self._start.table)
        mean_rad_s = self._turned / (self._rest_ticks * self._period_s)
        self.bias_rad_s = mean_rad_s - body_to_n.T @ earth_rate_n(self._latitude_rad)
        fastest = float(np.max(np.abs(self.bias_rad_s)))
        if fastest > _AT_REST_RAD_S:
            msg = (
                f"the base turns at {fastest / DEG:.3f} deg/s while it should rest: hold from an "
                f"alignment, or with rest_s = 0, where it cannot stand still"
            )
            raise AcquisitionError(msg)
