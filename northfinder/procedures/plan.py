"""What a north-seek is asked to measure, and what the configuration adds to it."""

import math
from collections.abc import Sequence
from typing import Annotated, Final, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from northfinder.config import LatitudeDeg, RigConfig
from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.uncertainty import SystematicUncertainty
from northfinder.procedures.visits import AnyOrder, Order, PlannedVisit, Visit
from northfinder.units import DEG, DEG_PER_HOUR, HOUR, PPM

LONGEST_DWELL_S = 3600.0
MOST_VISITS = 2000  # the fit's work per visit grows with their square
FEWEST_FOR_TARGET = 12  # 8 degrees of freedom: docs/theory.md has the coverage with fewer
FEWEST_SECTORS = 12  # of 30 deg; a mean over more of the circle loses what it is to measure
FEWEST_THAT_DRIFT = 3  # of two, bias and drift would leave nothing
_FITS_A_DRIFT: Final = frozenset[Order]({"sequential", "spread", "rotation"})
_DEG_PER_HOUR_CUBED = DEG / 3600.0**3


class Plan(BaseModel):
    """What to measure: ``positions`` distinct angles, ``dwell_s`` at each in all.

    With ``target_sigma_deg`` the run ends as soon as its stated sigma is no larger, at the latest
    after ``most_visits``; while those are open, a prediction chooses the dwell so that the
    planned revolutions bring it. Order ``auto`` leaves positions, dwell, order and revolutions
    open: they are chosen for the smallest sigma within ``allowed_s``, by default as long as the
    positions and the dwell given would take out and back. With ``modulation`` ``continuous`` the
    table does not stop: it turns steadily, out and back, and the positions are sectors;
    ``auto``, with that order, leaves this open too. ``latitude_deg`` stands in for the site's.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: Literal["north-seek"] = "north-seek"
    positions: Annotated[int, Field(ge=3, le=720)] = 24
    dwell_s: Annotated[float, Field(gt=0.0, le=LONGEST_DWELL_S)] = 5.0
    order: AnyOrder = "out-and-back"
    modulation: Literal["indexed", "continuous", "auto"] = "indexed"
    settle_s: Annotated[float, Field(ge=0.0, le=600.0)] = 0.5
    revolutions: Annotated[int, Field(ge=1, le=100)] = 1
    latitude_deg: LatitudeDeg | None = None
    target_sigma_deg: Annotated[float, Field(gt=0.0, le=90.0)] | None = None
    allowed_s: Annotated[float, Field(gt=0.0, le=1e6)] | None = None
    most_visits: Annotated[int, Field(ge=FEWEST_FOR_TARGET, le=MOST_VISITS)] | None = None

    @model_validator(mode="after")
    def _feasible(self) -> Self:
        visits = self.positions * self.visits_per_angle
        if visits > MOST_VISITS:
            msg = (
                f"{self.positions} positions and {self.revolutions} revolutions make {visits} "
                f"visits, more than {MOST_VISITS}: lengthen the dwell instead"
            )
            raise ValueError(msg)
        self._check_modulation()
        if self.allowed_s is not None and self.order != "auto":
            msg = (
                f"allowed_s = {self.allowed_s:g} is what order 'auto' fills, but the order is "
                f"'{self.order}': leave one of them out"
            )
            raise ValueError(msg)
        if self.most_visits is not None and self.target_sigma_deg is None:
            msg = (
                f"most_visits = {self.most_visits} bounds a run that ends at its target: give "
                f"target_sigma_deg too, or leave it out"
            )
            raise ValueError(msg)
        return self

    def _check_modulation(self) -> None:
        if self.modulation == "auto" and self.order != "auto":
            msg = f"modulation 'auto' goes with order 'auto', but the order is '{self.order}'"
            raise ValueError(msg)
        if self.continuous and self.order not in {"out-and-back", "auto"}:
            msg = (
                f"a table that turns steadily goes out and back: order '{self.order}' needs "
                f"modulation 'indexed'"
            )
            raise ValueError(msg)
        if self.continuous and self.positions < FEWEST_SECTORS:
            msg = (
                f"{self.positions} sectors are too wide for a table that turns steadily: take "
                f"{FEWEST_SECTORS} positions or more"
            )
            raise ValueError(msg)

    @property
    def continuous(self) -> bool:
        """Return whether the table turns steadily instead of stopping at each angle."""
        return self.modulation == "continuous"

    @property
    def visits_per_look(self) -> int:
        """Return after how many visits a run looks whether it has reached its target."""
        return 2 * self.positions if self.continuous else 2

    @property
    def visits_per_angle(self) -> int:
        """Return how often each angle is visited; an open order counts as there and back."""
        once = self.order == "sequential" and not self.ends_at_target
        return self.revolutions * (1 if once else 2)

    @property
    def ends_at_target(self) -> bool:
        """Return whether its run ends as soon as the target is reached; a prediction bounds it."""
        return self.target_sigma_deg is not None and self.most_visits is not None

    def latitude_rad(self, config: RigConfig) -> float:
        """Return the plan's own latitude, or the site's."""
        return config.site.latitude_rad if self.latitude_deg is None else self.latitude_deg * DEG


def chosen_order(plan: Plan) -> Order:
    """Return the order of a plan that leaves nothing open, of whatever makes one of its own.

    Raises:
        ValueError: It is still ``auto``.
    """
    if plan.continuous:
        return "rotation"
    if plan.ends_at_target:
        return "spread"
    if plan.order == "auto":
        msg = "the order of visits is still open: predict chooses it"
        raise ValueError(msg)
    return plan.order


def drift_order(order: Order, visits: int) -> int:
    """Return 1 where the order of visits does not cancel a linear drift by itself.

    Going round once aliases a drift into the sine; it has to be fitted, at 2.55 times the
    variance, or the stated uncertainty would be untrue (`docs/theory.md`). So it has where the
    run may end anywhere, at next to no cost. With fewer than five readings nothing would be left
    to tell the noise by.
    """
    return 1 if order in _FITS_A_DRIFT and visits >= 5 else 0


def drift_orders(order: Order, visits: Sequence[int]) -> tuple[int, ...]:
    """Return the drift to fit in each segment, from the number of visits in each.

    No part of a revolution cancels a drift, whatever the whole would: an interrupted run fits
    one in every segment of three visits or more, whichever the order. Where that would leave no
    reading to tell the noise by, in those of five or more. A table that turns steadily opens a
    segment with each passage: as long as passages come in equal pairs, out and back, they do.
    """
    if order == "rotation" and len(visits) % 2 == 0 and len(set(visits)) == 1:
        return (0,) * len(visits)
    if len(visits) == 1:
        return (drift_order(order, visits[0]),)
    orders = tuple(int(n >= FEWEST_THAT_DRIFT) for n in visits)
    if sum(visits) > 2 + len(visits) + sum(orders):
        return orders
    return tuple(drift_order("sequential", n) for n in visits)


def attenuation_of(visits: Sequence[Visit | PlannedVisit], plan: Plan) -> FloatArray | None:
    """Return by how much each reading feels the harmonic; None where the table stands.

    The mean of ``cos T`` over a sector of width w is ``cos`` of its middle times
    ``sin(w/2)/(w/2)``.
    """
    if not plan.continuous:
        return None
    half_width_rad = math.pi / plan.positions
    return np.full(len(visits), math.sin(half_width_rad) / half_width_rad)


def systematic(config: RigConfig) -> SystematicUncertainty:
    """Return what the configuration says of errors that averaging does not see."""
    curvature = config.gyro.drift_curvature_sigma_deg_h3
    return SystematicUncertainty(
        latitude_rad=config.site.latitude_sigma_deg * DEG,
        table_angle_rad=config.turntable.angle_sigma_deg * DEG,
        scale_factor=config.gyro.scale_factor_sigma_ppm * PPM,
        gyro_mount_rad=config.gyro.mount_angle_sigma_deg * DEG,
        accelerometer_mount_rad=config.accelerometer.mount_angle_sigma_deg * DEG,
        drift_curvature_rad_s3=None if curvature is None else curvature * _DEG_PER_HOUR_CUBED,
        bias_instability_rad_s=config.gyro.bias_instability_deg_h * DEG_PER_HOUR,
        rate_random_walk_rad_s_sqrt_s=(
            config.gyro.rate_random_walk_deg_h_sqrt_h * DEG_PER_HOUR / math.sqrt(HOUR)
        ),
    )
