"""What a campaign draws, how often, and what the program is told of it."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from northfinder.config import LEAST_GYRO_NOISE, DatabaseConfig, RigConfig
from northfinder.estimators.arrays import FloatArray, IntArray
from northfinder.procedures.plan import Plan, attenuation_of
from northfinder.procedures.visits import PlannedVisit, legs

#: Of one chunk: few enough that every core has some, enough that handing it over costs nothing.
SEEKS_PER_CHUNK = 10_000
STEEPEST_DEG = 60.0


class PlannedMean(NamedTuple):
    """One visit of the plan, as its mean is taken.

    Attributes:
        angle_rad: The table's, counter-clockwise; of a table that turns, the sector's middle.
        dwell_s: How long.
        middle_s: The middle of that time, from the start of the run.
        segment: The bias is fitted anew in each.
        felt: By how much the mean feels the harmonic; 1 where the table stands.
    """

    angle_rad: float
    dwell_s: float
    middle_s: float
    segment: int = 0
    felt: float = 1.0


class Campaign(BaseModel):
    """All that decides a campaign's numbers; equal campaigns give equal numbers, bit for bit.

    What the sensors do is the simulation's section of ``rig``; what the program knows of it is
    what the other sections state. Every error that they state a sigma of is drawn with it:
    latitude, table angles, scale factor, mountings, curvature of the drift.

    Attributes:
        rig: The bench, its latitude filled in.
        plan: With nothing left open.
        visits: In time order.
        seeks: How many north-seeks.
        seed: Of all random numbers.
        azimuth_deg: Of the index mark; ``uniform``: anew for each seek.
        tilt_deg: The largest; its size and direction are uniform. None: the simulation's pitch
            and roll.
        outliers: Visits of each seek that are spoiled, drawn anew.
        outlier_size_deg_h: By how much, in either direction.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    rig: RigConfig
    plan: Plan
    visits: Annotated[tuple[PlannedMean, ...], Field(min_length=3)]
    seeks: Annotated[int, Field(ge=1, le=1_000_000_000)] = 20_000
    seed: Annotated[int, Field(ge=0)] = 1
    azimuth_deg: Annotated[float, Field(ge=-360.0, le=360.0)] | Literal["uniform"] = "uniform"
    tilt_deg: Annotated[float, Field(ge=0.0, le=STEEPEST_DEG)] | None = None
    outliers: Annotated[int, Field(ge=0)] = 0
    outlier_size_deg_h: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0

    @model_validator(mode="after")
    def _can_be_drawn(self) -> Self:
        noise_deg_sqrt_h = self.rig.simulation.gyro_noise_deg_sqrt_h
        if noise_deg_sqrt_h < LEAST_GYRO_NOISE:
            msg = (
                f"a gyro noise of {noise_deg_sqrt_h:g} deg/sqrt(h) leaves nothing to be counted: "
                f"a campaign needs at least {LEAST_GYRO_NOISE:g}"
            )
            raise ValueError(msg)
        if self.rig.simulation.base != "still":
            msg = (
                f"base {self.rig.simulation.base!r} rocks: a campaign simulates a bench that "
                "stands still"
            )
            raise ValueError(msg)
        if self.outliers > len(self.visits):
            msg = f"{self.outliers} outliers are more than the plan's {len(self.visits)} visits"
            raise ValueError(msg)
        if (self.outliers == 0) != (self.outlier_size_deg_h == 0.0):
            msg = (
                f"{self.outliers} outliers of {self.outlier_size_deg_h:g} deg/h: "
                "give both their number and their size, or neither"
            )
            raise ValueError(msg)
        return self

    @property
    def angle_rad(self) -> FloatArray:
        """Return the table's angle at each visit, ``(n,)``."""
        return np.array([visit.angle_rad for visit in self.visits])

    @property
    def dwell_s(self) -> FloatArray:
        """Return the length of each visit, ``(n,)``."""
        return np.array([visit.dwell_s for visit in self.visits])

    @property
    def middle_s(self) -> FloatArray:
        """Return the middle of each visit, from the start of the run, ``(n,)``."""
        return np.array([visit.middle_s for visit in self.visits])

    @property
    def segment(self) -> IntArray:
        """Return the segment of each visit, ``(n,)``."""
        return np.array([visit.segment for visit in self.visits], dtype=np.int64)

    @property
    def felt(self) -> FloatArray:
        """Return by how much each visit's mean feels the harmonic, ``(n,)``."""
        return np.array([visit.felt for visit in self.visits])

    @property
    def latitude_rad(self) -> float:
        """Return the latitude that the program is told."""
        return self.plan.latitude_rad(self.rig)

    def without_visits(self, left_out: Sequence[int]) -> Self:
        """Return it as if those visits had not been made, and none spoiled.

        Without them no order cancels a drift, as a sequential one.
        """
        kept = tuple(visit for index, visit in enumerate(self.visits) if index not in left_out)
        order = {"order": "sequential", "modulation": "indexed", "target_sigma_deg": None}
        plan = self.plan.model_copy(update=order)
        rest = {"plan": plan, "visits": kept, "outliers": 0, "outlier_size_deg_h": 0.0}
        return self.model_copy(update=rest)

    @property
    def chunks(self) -> int:
        """Return into how many parts it is cut, whoever computes them."""
        return math.ceil(self.seeks / SEEKS_PER_CHUNK)

    def seeks_in(self, chunk: int) -> int:
        """Return how many seeks a chunk has; the last may have fewer."""
        return min(SEEKS_PER_CHUNK, self.seeks - chunk * SEEKS_PER_CHUNK)


def planned_means(
    plan: Plan, visits: Sequence[PlannedVisit], end_s: Sequence[float]
) -> list[PlannedMean]:
    """Return where and when each visit's mean is taken, from a schedule and when each ends."""
    attenuation = attenuation_of(visits, plan)
    felt = [1.0] * len(visits) if attenuation is None else attenuation.tolist()
    segment = legs(visits) if plan.continuous else [0] * len(visits)
    return [
        PlannedMean(visit.angle_rad, visit.dwell_s, end - visit.dwell_s / 2.0, *rest)
        for visit, end, *rest in zip(visits, end_s, segment, felt, strict=True)
    ]


def without_records(rig: RigConfig) -> RigConfig:
    """Leave out what a campaign has nothing to do with: where runs are recorded."""
    return rig.model_copy(update={"database": DatabaseConfig()})
