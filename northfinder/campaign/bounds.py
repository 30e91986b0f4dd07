"""The Cramer-Rao bound: how well any unbiased estimator could do with these readings."""

import numpy as np

from northfinder.campaign.estimation import Estimates
from northfinder.campaign.settings import Campaign
from northfinder.campaign.simulation import Bench
from northfinder.estimators.arrays import FloatArray, quadratic_form
from northfinder.units import DEG


class Bounds:
    """The bound that the sensors' noise sets, its covariance known.

    Each segment's bias is a nuisance, and so is a linear drift of the gyro where the campaign has
    one. White, level and equally spaced it is ``sigma sqrt(2/n) / (Omega_e cos L)``. Errors that
    averaging does not see are not in it.

    Args:
        bench: Its noise and its visits.
    """

    def __init__(self, bench: Bench) -> None:
        campaign = bench.campaign
        rig, time_s = campaign.rig, campaign.middle_s
        gyro = _model(campaign, rig.gyro.mount_angle_deg)
        if rig.simulation.gyro_drift_deg_h_h:
            gyro = np.column_stack([gyro, (time_s - time_s.mean()) / np.ptp(time_s)])
        self._gyro = bench.gyro.bound(gyro)[:2, :2]
        self._level = np.zeros((2, 2))
        if rig.simulation.accel_noise_g_sqrt_hz > 0.0:
            level = _model(campaign, rig.accelerometer.mount_angle_deg)
            self._level = bench.accelerometer.bound(level)[:2, :2] / rig.site.gravity_g**2

    def sigma_rad(self, estimates: Estimates) -> FloatArray:
        """Return the bound of the azimuth's sigma in each seek, ``(k,)``."""
        jacobian = estimates.jacobian
        gyro = quadratic_form(jacobian[:, 0:2], self._gyro)
        return np.sqrt(gyro + quadratic_form(jacobian[:, 2:4], self._level))


def _model(campaign: Campaign, mount_deg: float) -> FloatArray:
    """Return the two harmonics and each segment's bias, ``(n, 2 + segments)``."""
    angle_rad = campaign.angle_rad + mount_deg * DEG
    biases = np.equal.outer(campaign.segment, np.unique(campaign.segment))
    return np.column_stack(
        [campaign.felt * np.cos(angle_rad), campaign.felt * np.sin(angle_rad), biases]
    )
