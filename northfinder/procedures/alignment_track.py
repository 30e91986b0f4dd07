"""An alignment as it goes on: pure, from stretches of samples to the attitude of the table."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from northfinder.alignment import SHORTEST_S, Aligner, Alignment
from northfinder.attitude.quaternion import to_matrix
from northfinder.config import RigConfig
from northfinder.errors import AcquisitionError, EstimationError
from northfinder.procedures.alignment_json import so_far_json
from northfinder.procedures.alignment_plan import Plan, errors_of
from northfinder.procedures.alignment_result import Aligned, Moment
from northfinder.procedures.bridging import BRIDGED_S, Bridge, Increments
from northfinder.procedures.mounting import Mounting
from northfinder.procedures.tracking import Instrument, Second
from northfinder.rig import JsonObject
from northfinder.units import DEG

_MOST_RESTARTS: Final = 5


class AlignmentTrack:
    """Aligns from a stream; implements ``Track``.

    Args:
        plan: With nothing left open.
        config: Of the rig.
        instrument: Where the samples come from.
    """

    def __init__(self, plan: Plan, config: RigConfig, instrument: Instrument) -> None:
        self._errors = errors_of(plan)
        self._plan, self._config = plan, config
        self._period_s = instrument.period_s
        self._angle_rad = config.gyro.mount_angle_deg * DEG + instrument.table_angle_rad
        self._bridge = Bridge(instrument.period_s)
        self._mounting: Mounting | None = None
        self._restarts = 0
        self._begin_anew()

    @property
    def fraction(self) -> float:
        """Return how far it is since it last began."""
        needed_s = self._plan.warm_s + self._plan.duration_s
        return min(1.0, self._ticks * self._period_s / needed_s)

    def take(self, second: Second) -> Iterator[str]:
        """Align on; after a gap that cannot be bridged, from the beginning.

        Raises:
            AcquisitionError: The instrument stands askew, or there are too many gaps.
        """
        for increments in self._bridge.increments(*second):
            if increments.after_gap:
                yield self._restart()
            self._add(increments)
        if self._aligner.duration_s >= SHORTEST_S:
            self._history.append(self._moment(self._aligner.solve()))

    def so_far(self) -> JsonObject | None:
        """Return the newest moment; None in the first ten seconds."""
        return so_far_json(self._history[-1], self._restarts) if self._history else None

    def aligned(self) -> Aligned:
        """Return the result.

        Raises:
            EstimationError: There is too little of it.
        """
        alignment = self._aligner.solve()
        mean_force_g = float(np.linalg.norm(self._gained)) / (self._ticks * self._period_s)
        return Aligned(
            alignment,
            self._moment(alignment).table,
            tuple(self._history),
            self._restarts,
            self._bridge.bridged,
            mean_force_g,
        )

    def _add(self, increments: Increments) -> None:
        if self._mounting is None:
            mean_force_g = increments.velocity_g_s.mean(axis=0) / self._period_s
            axis = self._config.gyro.axis
            self._mounting = Mounting.found(axis, self._angle_rad, mean_force_g)
        self._aligner.add(increments.angle_rad, increments.velocity_g_s)
        self._ticks += len(increments.angle_rad)
        self._gained += increments.velocity_g_s.sum(axis=0)

    def _restart(self) -> str:
        """Begin anew: what the base turned in the gap is not known."""
        self._restarts += 1
        lasted_s = self._ticks * self._period_s
        if self._restarts > _MOST_RESTARTS:
            msg = (
                f"samples were missing for more than {BRIDGED_S:g} s for the "
                f"{self._restarts}th time; check the cable, the baud rate and the sensor's status"
            )
            raise AcquisitionError(msg)
        self._begin_anew()
        return (
            f"After {lasted_s:.1f} s samples were missing for more than {BRIDGED_S:g} s, the most "
            f"that can be bridged: the alignment begins anew."
        )

    def _begin_anew(self) -> None:
        self._aligner = Aligner(
            self._plan.method,
            self._plan.latitude_rad(self._config),
            self._period_s,
            sensors=self._errors,
            gravity=self._config.site.gravity_g,
            warm_s=self._plan.warm_s,
        )
        self._ticks = 0
        self._gained = np.zeros(3)
        self._history: list[Moment] = []

    def _moment(self, alignment: Alignment) -> Moment:
        if self._mounting is None:
            msg = "nothing has been aligned yet"
            raise EstimationError(msg)
        body_to_n = to_matrix(alignment.q_b_n)
        return Moment(
            alignment.time_s,
            self._mounting.table_attitude(body_to_n),
            alignment.heading_sigma_rad,
            alignment.level_sigma_rad,
        )
