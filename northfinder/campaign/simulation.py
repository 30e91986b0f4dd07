"""The visits' means of many seeks at once, from true attitudes, noise and every stated error."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.random import Generator

from northfinder.campaign.attitudes import Attitudes, draw_attitudes
from northfinder.campaign.noise import VisitNoise, accelerometer_noise, gyro_noise
from northfinder.campaign.settings import Campaign
from northfinder.estimators.arrays import FloatArray, IntArray
from northfinder.estimators.design import distinct_angles
from northfinder.estimators.uncertainty import SystematicUncertainty
from northfinder.procedures.plan import systematic
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_HOUR_PER_HOUR

#: Two values for each of k seeks, such as the components along the table's x and y.
InPlane = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """What both sensors read in k seeks of n visits.

    Attributes:
        rate_rad_s: The gyro's means, ``(k, n)``.
        force_g: The accelerometer's, standard gravities, ``(k, n)``.
    """

    rate_rad_s: FloatArray
    force_g: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """What all seeks of a campaign share, worked out once.

    Attributes:
        campaign: As given.
        position: Number of each visit's table angle, ``(n,)``; visits there share its error.
        gyro: Its noise, rad/s.
        accelerometer: Its noise, standard gravities.
        stated: Sigmas of the errors that are drawn anew for each seek.
    """

    campaign: Campaign
    position: IntArray
    gyro: VisitNoise
    accelerometer: VisitNoise
    stated: SystematicUncertainty

    @classmethod
    def of(cls, campaign: Campaign) -> Self:
        """Prepare a campaign's bench."""
        position = distinct_angles(campaign.angle_rad)
        stated = systematic(campaign.rig)
        return cls(campaign, position, gyro_noise(campaign), accelerometer_noise(campaign), stated)

    def simulate(self, random: Generator, count: int) -> tuple[Attitudes, Readings]:
        """Draw ``count`` seeks: how the table stood, and what the sensors read."""
        attitudes, rig = draw_attitudes(self.campaign, random, count), self.campaign.rig
        turned = self._table_errors(random, count)
        rate = self._along(self._earth_rate(attitudes, random), rig.gyro.mount_angle_deg, turned)
        rate += self.gyro.draw(random, count)
        rate += self._drift(random, count)
        if self.campaign.outliers:
            self._spoil(rate, random)
        plane = attitudes.specific_force(rig.site.gravity_g)
        plane = _turned(plane, _normal(random, self.stated.accelerometer_mount_rad, count))
        force = self._along(plane, rig.accelerometer.mount_angle_deg, turned)
        force += self.accelerometer.draw(random, count)
        return attitudes, Readings(rate, force)

    def _earth_rate(self, attitudes: Attitudes, random: Generator) -> InPlane:
        """Return what the gyro feels of the Earth: latitude, scale and mounting with errors."""
        count, stated = len(attitudes.azimuth_rad), self.stated
        latitude_rad = self.campaign.latitude_rad + _normal(random, stated.latitude_rad, count)
        scale = 1.0 + _normal(random, stated.scale_factor, count)
        x, y = attitudes.earth_rate(latitude_rad)
        return _turned((scale * x, scale * y), _normal(random, stated.gyro_mount_rad, count))

    def _table_errors(self, random: Generator, count: int) -> InPlane | None:
        """Return sine and cosine of the table's error at each visit, ``(k, n)``; None: no error."""
        if self.stated.table_angle_rad == 0.0:
            return None
        error_rad = random.standard_normal((count, int(self.position.max()) + 1))
        error_rad *= self.stated.table_angle_rad
        return np.sin(error_rad)[:, self.position], np.cos(error_rad)[:, self.position]

    def _along(self, plane: InPlane, mount_deg: float, turned: InPlane | None) -> FloatArray:
        """Return the part of vectors along the mark turned to each angle, ``(k, n)``.

        Turned counter-clockwise by T, the mark points to ``cos T y - sin T x``, and a little
        further it is on the way to ``-sin T y - cos T x``.
        """
        angle_rad = self.campaign.angle_rad + mount_deg * DEG
        sine, cosine = self.campaign.felt * np.stack([np.sin(angle_rad), np.cos(angle_rad)])
        xy = np.stack(plane, axis=1)
        along: FloatArray = xy @ np.stack([-sine, cosine])
        if turned is None:
            return along
        sine_off, cosine_off = turned
        along *= cosine_off
        along -= (xy @ np.stack([cosine, sine])) * sine_off
        return along

    def _drift(self, random: Generator, count: int) -> FloatArray:
        """Return bias, drift and, with its sigma stated, a curvature, ``(n,)`` or ``(k, n)``."""
        simulated, time_s = self.campaign.rig.simulation, self.campaign.middle_s
        drift_rad_s2 = simulated.gyro_drift_deg_h_h * DEG_PER_HOUR_PER_HOUR
        course: FloatArray = simulated.gyro_bias_deg_h * DEG_PER_HOUR + drift_rad_s2 * time_s
        if not self.stated.drift_curvature_rad_s3:
            return course
        curvature = self.stated.drift_curvature_rad_s3 * random.standard_normal((count, 1))
        curved: FloatArray = course + curvature * (time_s - time_s.mean()) ** 2
        return curved

    def _spoil(self, rate_rad_s: FloatArray, random: Generator) -> None:
        """Add the outliers: of each seek other visits, up or down. A footstep hits one visit."""
        count, visits = rate_rad_s.shape
        hit = np.argsort(random.random((count, visits)), axis=1)[:, : self.campaign.outliers]
        size_rad_s = self.campaign.outlier_size_deg_h * DEG_PER_HOUR
        sign = random.choice([-1.0, 1.0], hit.shape)
        rate_rad_s[np.arange(count)[:, np.newaxis], hit] += size_rad_s * sign


def _normal(random: Generator, sigma: float, count: int) -> FloatArray | float:
    """Draw ``(k,)``; an error that is not stated takes no random number."""
    return sigma * random.standard_normal(count) if sigma else 0.0


def _turned(plane: InPlane, angle_rad: FloatArray | float) -> InPlane:
    """Return the components along axes that are turned counter-clockwise."""
    (x, y), sine, cosine = plane, np.sin(angle_rad), np.cos(angle_rad)
    return cosine * x + sine * y, cosine * y - sine * x
