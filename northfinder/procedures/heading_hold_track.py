"""A heading hold as it goes on: pure, from stretches of samples to the azimuth of the mark."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from northfinder.config import RigConfig
from northfinder.errors import ConfigError
from northfinder.estimators.checks import Check
from northfinder.procedures.bridging import Bridge
from northfinder.procedures.heading_hold_plan import Plan, Start
from northfinder.procedures.holding import HeadingHold, Held
from northfinder.procedures.plain_json import wrapped_deg
from northfinder.procedures.tracking import Instrument, Second
from northfinder.rig import JsonObject
from northfinder.units import DEG


@dataclass(frozen=True, slots=True)
class HoldRun:
    """Everything that a heading hold tells.

    Attributes:
        plan: With its start.
        history: Second by second; the last is the result.
        bias_rad_s: Of the gyros, as measured at rest; zeros without a rest. ``(3,)``.
        bridged: Samples that a straight line stands for.
        visits: What was kept, five seconds each, as the record lists it.
        checks: Verdicts in words.
        reference_offset_rad: From the index mark to the line whose azimuth is wanted.
    """

    plan: Plan
    history: Sequence[Held]
    bias_rad_s: np.ndarray
    bridged: int
    visits: Sequence[JsonObject]
    checks: list[Check]
    reference_offset_rad: float


class HoldTrack:
    """Holds a heading over a stream; implements ``Track``.

    Args:
        plan: With nothing left open.
        config: Of the rig.
        instrument: Where the samples come from.

    Attributes:
        history: Second by second.
        hold: What carries the heading.
    """

    def __init__(self, plan: Plan, config: RigConfig, instrument: Instrument) -> None:
        start, errors, rest_s = start_of(plan), plan.sensors, plan.rest_s
        if errors is None or rest_s is None:
            msg = "the sensors' errors and the rest are still open: predict fills them in"
            raise ConfigError(msg)
        self._needed_s = rest_s + plan.duration_s
        angle_rad = config.gyro.mount_angle_deg * DEG + instrument.table_angle_rad
        self.hold = HeadingHold(
            start, plan.method, errors, rest_s, config.gyro.axis, angle_rad, instrument.period_s
        )
        self._bridge = Bridge(instrument.period_s)
        self.history: list[Held] = []

    @property
    def bridged(self) -> int:
        """Return how many samples a straight line stands for."""
        return self._bridge.bridged

    @property
    def fraction(self) -> float:
        """Return how far it is."""
        return min(1.0, self.history[-1].time_s / self._needed_s) if self.history else 0.0

    def take(self, second: Second) -> Iterator[str]:
        """Carry the heading on.

        Raises:
            AcquisitionError: A gap that no heading can be carried over, a base that does not rest
                where it should, an instrument that stands askew or has moved since the start.
        """
        for increments in self._bridge.increments(*second):
            self.hold.add(increments)
        if self.hold.has_begun:
            self.history.append(self.hold.held())
        yield from ()

    def so_far(self) -> JsonObject | None:
        """Return the newest moment."""
        return held_json(self.history[-1]) if self.history else None


def start_of(plan: Plan) -> Start:
    """Return where the heading comes from.

    Raises:
        ConfigError: It is still open.
    """
    if plan.start is None:
        msg = (
            "there is no heading to hold: find north or align first, or name a completed run in "
            "from_run"
        )
        raise ConfigError(msg)
    return plan.start


def held_json(held: Held) -> JsonObject:
    """Return one moment, in the result's own names."""
    return {
        "time_s": held.time_s,
        "azimuth_deg": wrapped_deg(held.table.azimuth_rad / DEG),
        "azimuth_sigma_deg": float(held.budget.sigma_rad) / DEG,
        "pitch_deg": held.table.pitch_rad / DEG,
        "roll_deg": held.table.roll_rad / DEG,
        "checks": [],
    }
