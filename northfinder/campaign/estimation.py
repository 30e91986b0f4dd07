"""The estimation of a campaign: the one seam through which all of its readings go.

It does to thousands of seeks what a run does to one (`procedures.fits`, `procedures.reduction`),
with the same public estimators.
"""

from dataclasses import dataclass, fields
from functools import partial
from typing import Self

import numpy as np

from northfinder.campaign.settings import Campaign
from northfinder.campaign.simulation import Readings
from northfinder.estimators.arrays import BoolArray, FloatArray, IntArray
from northfinder.estimators.azimuth import solve_azimuth
from northfinder.estimators.design import HarmonicDesign, harmonic_design
from northfinder.estimators.drift import unmodelled_drift
from northfinder.estimators.harmonic import HarmonicFit, fit_design
from northfinder.estimators.outliers import OutlierSearch
from northfinder.estimators.tilt import estimate_tilt
from northfinder.estimators.uncertainty import SystematicUncertainty, azimuth_budget
from northfinder.procedures.plan import chosen_order, drift_orders, systematic
from northfinder.units import DEG, DEG_PER_SQRT_HOUR

_LEAST_SCATTER = 1e-12  # rad/s or g, as of a run
_FEWEST_THAT_DRIFT = 4  # their residuals have one direction, which tells of no drift


@dataclass(frozen=True, slots=True, eq=False)
class Estimates:
    """What the program states of each of k seeks; angles in rad.

    Attributes:
        azimuth_rad: By the coordinate transform, [0, 2 pi), ``(k,)``.
        vector_azimuth_rad: By the exact vector form, ``(k,)``.
        sigma_rad: Of the azimuth, the whole budget, ``(k,)``.
        dof: Effective degrees of freedom behind it, infinite where the noise is given, ``(k,)``.
        interval95_rad: Half width of the stated interval, ``(k,)``.
        pitch_rad: ``(k,)``.
        roll_rad: ``(k,)``.
        jacobian: Derivatives of the azimuth by (a, b, a_A/g, b_A/g, L), ``(k, 5)``.
    """

    azimuth_rad: FloatArray
    vector_azimuth_rad: FloatArray
    sigma_rad: FloatArray
    dof: FloatArray
    interval95_rad: FloatArray
    pitch_rad: FloatArray
    roll_rad: FloatArray
    jacobian: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Reduction:
    """What the estimation of all seeks shares, worked out once.

    Attributes:
        campaign: As given.
        gyro: The fit's geometry.
        drifting: The same with a drift, for seeks whose residuals show one; None where ``gyro``
            has it already, or too few visits could show it.
        accelerometer: Of the accelerometer.
        known: What the program is told of errors that averaging does not see.
    """

    campaign: Campaign
    gyro: HarmonicDesign
    drifting: HarmonicDesign | None
    accelerometer: HarmonicDesign
    known: SystematicUncertainty

    @classmethod
    def of(cls, campaign: Campaign) -> Self:
        """Prepare a campaign's fits, as a run's are.

        Raises:
            EstimationError: The plan's visits do not determine the coefficients.
        """
        orders = drift_orders(chosen_order(campaign.plan), np.bincount(campaign.segment).tolist())
        gyro, known = _gyro_design(campaign, orders), systematic(campaign.rig)
        may_drift = orders == (0,) and len(campaign.visits) > _FEWEST_THAT_DRIFT
        drifting = _gyro_design(campaign, (1,)) if may_drift else None
        return cls(campaign, gyro, drifting, _accelerometer_design(campaign), known)


def estimate(reduction: Reduction, readings: Readings) -> Estimates:
    """Fit both sensors, estimate the tilt, solve by both exact solvers, and state how sure.

    Where the campaign spoils visits, those that are found are left out, as a run does. Without
    any, one seek in some hundreds would lose a visit by chance: no figure shows that.

    Raises:
        EstimationError: North is not observable at the latitude, or a force is beyond gravity.
    """
    gyro = fit_design(reduction.gyro, readings.rate_rad_s)
    stated = _state(reduction, gyro, readings.force_g)
    drifts: BoolArray = np.zeros(len(readings.rate_rad_s), dtype=np.bool_)
    if reduction.drifting is not None:
        # As in a run: left in the residuals a drift would pass for noise.
        drifts = unmodelled_drift(gyro)[0].significant
    rows = np.flatnonzero(drifts)
    if reduction.drifting is not None and rows.size:
        again = fit_design(reduction.drifting, readings.rate_rad_s[rows])
        _put(stated, rows, _state(reduction, again, readings.force_g[rows]))
    if reduction.campaign.outliers:
        for left_out, which in _disturbed(reduction, readings, drifts).items():
            kept = np.delete(np.arange(readings.rate_rad_s.shape[1]), left_out)
            rest = Readings(readings.rate_rad_s[which][:, kept], readings.force_g[which][:, kept])
            shared = Reduction.of(reduction.campaign.without_visits(left_out))
            _put(stated, which, estimate(shared, rest))
    return stated


def _disturbed(
    reduction: Reduction, readings: Readings, drifts: BoolArray
) -> dict[tuple[int, ...], IntArray]:
    """Return the seeks that leave the same visits out, by those visits."""
    left_out: list[set[int]] = [set() for _ in drifts]
    parts = [
        (reduction.gyro, readings.rate_rad_s, ~drifts),
        (reduction.drifting or reduction.gyro, readings.rate_rad_s, drifts),
        (reduction.accelerometer, readings.force_g, np.ones_like(drifts)),
    ]
    for design, rows, part in parts:
        search = OutlierSearch(design)
        if search.possible and part.any():
            for row in np.flatnonzero(part)[search.suspicious(rows[part])].tolist():
                left_out[row].update(search.find(rows[row]).index)
    alike: dict[tuple[int, ...], list[int]] = {}
    for row, visits in enumerate(left_out):
        alike.setdefault(tuple(sorted(visits)), []).append(row)
    return {visits: np.array(rows) for visits, rows in alike.items() if visits}


def _state(reduction: Reduction, gyro: HarmonicFit, force_g: FloatArray) -> Estimates:
    campaign = reduction.campaign
    accelerometer = fit_design(reduction.accelerometer, force_g)
    tilt = estimate_tilt(accelerometer, campaign.rig.site.gravity_g)
    azimuth = solve_azimuth(gyro, tilt, campaign.latitude_rad)
    vector = solve_azimuth(gyro, tilt, campaign.latitude_rad, "vector")
    budget = azimuth_budget(azimuth, gyro, tilt, reduction.known, campaign.dwell_s)
    return Estimates(
        azimuth.azimuth_rad,
        vector.azimuth_rad,
        budget.sigma_rad,
        budget.dof,
        budget.interval95_rad,
        tilt.pitch_rad,
        tilt.roll_rad,
        azimuth.jacobian,
    )


def _put(all_rows: Estimates, rows: IntArray, some: Estimates) -> None:
    for field in fields(Estimates):
        getattr(all_rows, field.name)[rows] = getattr(some, field.name)


def _gyro_design(campaign: Campaign, orders: tuple[int, ...]) -> HarmonicDesign:
    """Weigh the visits as `procedures.fits` does: by what couples them too, where it is stated."""
    rig, dwell_s, middle_s = campaign.rig, campaign.dwell_s, campaign.middle_s
    angle_rad = campaign.angle_rad + rig.gyro.mount_angle_deg * DEG
    white = _seen(rig.simulation.gyro_noise_deg_sqrt_h * DEG_PER_SQRT_HOUR, dwell_s)
    given = rig.gyro.noise_deg_sqrt_h
    stated = None if given is None else given * DEG_PER_SQRT_HOUR / np.sqrt(dwell_s)
    sigma = _told(stated, white, parameters=2 + len(orders) + sum(orders))
    design = partial(
        harmonic_design,
        angle_rad,
        time_s=middle_s,
        drift_order=orders,
        segment=campaign.segment,
        attenuation=campaign.felt,
    )
    slow = systematic(rig).slow_noise
    if not slow.any:
        return design(sigma)
    between = slow.covariances(middle_s - dwell_s / 2.0, dwell_s)
    covariance = np.diag((white if sigma is None else sigma) ** 2) + sum(between.values())
    return design(covariance=covariance, absolute=sigma is not None)


def _accelerometer_design(campaign: Campaign) -> HarmonicDesign:
    rig, dwell_s = campaign.rig, campaign.dwell_s
    given = rig.accelerometer.noise_g_sqrt_hz
    stated = None if given is None else given / np.sqrt(dwell_s)
    white = _seen(rig.simulation.accel_noise_g_sqrt_hz, dwell_s)
    return harmonic_design(
        campaign.angle_rad + rig.accelerometer.mount_angle_deg * DEG,
        _told(stated, white, parameters=2 + len(np.unique(campaign.segment))),
        segment=campaign.segment,
        attenuation=campaign.felt,
    )


def _seen(noise_sqrt_s: float, dwell_s: FloatArray) -> FloatArray:
    """Return the scatter that a run sees within its visits: the white noise, never nothing."""
    sigma: FloatArray = np.maximum(noise_sqrt_s / np.sqrt(dwell_s), _LEAST_SCATTER)
    return sigma


def _told(stated: FloatArray | None, seen: FloatArray, *, parameters: int) -> FloatArray | None:
    """Return the sigma that the fit is given, as `fits.configured_or_seen` does.

    The stated one; without one None, for the residuals to tell it, where any are free.
    """
    return seen if stated is None and len(seen) <= parameters else stated
