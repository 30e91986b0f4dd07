"""Visits as a bench would bring them, without the bench: readings by matrices, noise by numpy."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator

from northfinder.procedures.plan import Plan
from northfinder.procedures.proving import Witness
from northfinder.procedures.visits import PlannedVisit, Visit, schedule
from northfinder.samples import Samples
from tests.estimators.truth import DEG, DEG_PER_HOUR, Array, read

SAMPLES = 50
STEP_S = 1.0  # what a move and its settling take


@dataclass(frozen=True)
class Bench:
    """The simulated rig's defaults, and what a test spoils of them."""

    random: Generator
    azimuth_rad: float = 48.0 * DEG
    pitch_rad: float = 0.8 * DEG
    roll_rad: float = -0.5 * DEG
    gyro_noise_deg_sqrt_h: float = 0.001
    bias_deg_h: float = 0.3
    drift_deg_h_h: float = 0.0
    between_deg_h: float = 0.0  # what differs from visit to visit besides
    force_noise_g_sqrt_hz: float = 1e-5
    force_bias_g: float = 0.0
    visits: list[Visit] = field(default_factory=list)

    def knocked(
        self, azimuth_deg: float = 0.0, tilt_deg: float = 0.0, way_deg: float = 0.0
    ) -> "Bench":
        return replace(
            self,
            azimuth_rad=self.azimuth_rad + azimuth_deg * DEG,
            pitch_rad=self.pitch_rad + tilt_deg * DEG * np.cos(way_deg * DEG),
            roll_rad=self.roll_rad + tilt_deg * DEG * np.sin(way_deg * DEG),
        )

    def follow(self, plan: Plan, visits: int) -> "Bench":
        """Make the first visits of a plan."""
        assert plan.order != "auto"
        stops = schedule(plan.positions, plan.dwell_s, plan.order, plan.revolutions)
        for stop in stops[:visits]:
            self._visit(stop, 0, stop.dwell_s, None)
        return self

    def repeat(self, witnesses: list[Witness], after_s: float = 600.0) -> "Bench":
        """Measure the witnesses again, in a new segment."""
        segment = self.visits[-1].segment + 1
        for place, witness in enumerate(witnesses):
            wait_s = after_s if place == 0 else 0.0
            self._visit(witness.visit, segment, witness.dwell_s, witness.visit.index, wait_s)
        return self

    def _visit(
        self,
        at: PlannedVisit | Visit,
        segment: int,
        dwell_s: float,
        repeats: int | None,
        wait_s: float = 0.0,
    ) -> None:
        last = self.visits[-1] if self.visits else None
        start_s = wait_s + STEP_S + (last.start_s + last.duration_s if last else 0.0)
        rate, force = read(
            self.azimuth_rad, self.pitch_rad, self.roll_rad, 40.0 * DEG, np.array([at.angle_rad])
        )
        drift_deg_h = self.drift_deg_h_h * (start_s + dwell_s / 2) / 3600.0
        wander_deg_h = self.random.normal(0.0, self.between_deg_h)
        offset_deg_h = self.bias_deg_h + drift_deg_h + wander_deg_h
        sigma_deg_h = self.gyro_noise_deg_sqrt_h * np.sqrt(3600.0 / dwell_s)
        force_sigma_g = self.force_noise_g_sqrt_hz / np.sqrt(dwell_s)
        self.visits.append(
            Visit(
                index=len(self.visits),
                segment=segment,
                direction=at.direction,
                angle_rad=at.angle_rad,
                start_s=start_s,
                turned_rad=None,
                gyro=self._samples(
                    rate + offset_deg_h * DEG_PER_HOUR, sigma_deg_h * DEG_PER_HOUR, dwell_s
                ),
                accelerometer=self._samples(force * G + self.force_bias_g, force_sigma_g, dwell_s),
                repeats=repeats,
            )
        )

    def _samples(self, mean: Array, sigma_of_mean: float, dwell_s: float) -> Samples:
        tick = np.arange(SAMPLES)
        noise = self.random.normal(0.0, sigma_of_mean * np.sqrt(SAMPLES), SAMPLES)
        valid = np.ones(SAMPLES, dtype=bool)
        return Samples(tick, tick * dwell_s / SAMPLES, mean + noise, valid, SAMPLES)


G = 9.801696 / 9.80665  # WGS 84 at 40 deg, in standard gravities
