"""What a north-seek is asked to measure, and what the configuration adds to it."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from northfinder.config import LatitudeDeg, RigConfig
from northfinder.estimators.uncertainty import SystematicUncertainty
from northfinder.procedures.visits import AnyOrder, Order
from northfinder.units import DEG, DEG_PER_HOUR, PPM

LONGEST_DWELL_S = 3600.0
MOST_VISITS = 2000  # the fit's work per visit grows with their square
FEWEST_THAT_DRIFT = 3  # of two, bias and drift would leave nothing
_DEG_PER_HOUR_CUBED = DEG / 3600.0**3


class Plan(BaseModel):
    """What to measure: ``positions`` distinct angles, ``dwell_s`` at each in all.

    ``target_sigma_deg`` chooses the dwell so that one sigma is predicted to be that;
    ``latitude_deg`` stands in for the site's. Order ``auto`` takes the one that is predicted
    best with the gyro's bias instability.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: Literal["north-seek"] = "north-seek"
    positions: Annotated[int, Field(ge=3, le=720)] = 24
    dwell_s: Annotated[float, Field(gt=0.0, le=LONGEST_DWELL_S)] = 5.0
    order: AnyOrder = "out-and-back"
    settle_s: Annotated[float, Field(ge=0.0, le=600.0)] = 0.5
    revolutions: Annotated[int, Field(ge=1, le=100)] = 1
    latitude_deg: LatitudeDeg | None = None
    target_sigma_deg: Annotated[float, Field(gt=0.0, le=90.0)] | None = None

    @model_validator(mode="after")
    def _feasible(self) -> Self:
        visits = self.positions * self.visits_per_angle
        if visits > MOST_VISITS:
            msg = (
                f"{self.positions} positions and {self.revolutions} revolutions make {visits} "
                f"visits, more than {MOST_VISITS}: lengthen the dwell instead"
            )
            raise ValueError(msg)
        return self

    @property
    def visits_per_angle(self) -> int:
        """Return how often each angle is visited; an open order counts as there and back."""
        return self.revolutions * (1 if self.order == "sequential" else 2)

    def latitude_rad(self, config: RigConfig) -> float:
        """Return the plan's own latitude, or the site's."""
        return config.site.latitude_rad if self.latitude_deg is None else self.latitude_deg * DEG


def chosen_order(plan: Plan) -> Order:
    """Return the order of a plan that leaves nothing open.

    Raises:
        ValueError: It is still ``auto``.
    """
    if plan.order == "auto":
        msg = "the order of visits is still open: predict chooses it"
        raise ValueError(msg)
    return plan.order


def drift_order(order: Order, visits: int) -> int:
    """Return 1 where the order of visits does not cancel a linear drift by itself.

    Going round once aliases a drift into the sine; it has to be fitted, at 2.55 times the
    variance, or the stated uncertainty would be untrue (`docs/theory.md`). With fewer than five
    readings nothing would be left to tell the noise by.
    """
    return 1 if order == "sequential" and visits >= 5 else 0


def drift_orders(order: Order, visits: Sequence[int]) -> tuple[int, ...]:
    """Return the drift to fit in each segment, from the number of visits in each.

    No part of a revolution cancels a drift, whatever the whole would: an interrupted run fits
    one in every segment of three visits or more, whichever the order. Where that would leave no
    reading to tell the noise by, in those of five or more.
    """
    if len(visits) == 1:
        return (drift_order(order, visits[0]),)
    orders = tuple(int(n >= FEWEST_THAT_DRIFT) for n in visits)
    if sum(visits) > 2 + len(visits) + sum(orders):
        return orders
    return tuple(drift_order("sequential", n) for n in visits)


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
    )
