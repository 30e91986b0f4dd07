"""ahrs, pyins and scipy under the same cone, in the same run: 1 deg, 8 Hz, 200 samples/s."""

from importlib import import_module

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from northfinder.attitude import ConingMotion, coning_drift_rad_s, integrate
from tests.attitude.motions import ARCSEC, DEG, DEG_PER_HOUR, Array, angle_between, rotation

CONE = ConingMotion(1.0 * DEG, 16.0 * np.pi)
DT_S = 0.005
TIME_S: Array = DT_S * np.arange(2001.0)


def drift_deg_h(steps: Rotation) -> float:
    """Drift of the last of the steps, as scipy's rotations have it."""
    turn = CONE.cone_rate_rad_s * DT_S
    whole = steps[-1] * Rotation.from_rotvec([turn, 0.0, 0.0])
    return float(whole.magnitude() - turn) / DT_S / DEG_PER_HOUR


def pyins_steps(readings: Array, sensor_type: str) -> Rotation:
    pandas, strapdown = import_module("pandas"), import_module("pyins.strapdown")
    columns = [*import_module("pyins.util").GYRO_COLS, *import_module("pyins.util").ACCEL_COLS]
    rows = np.hstack([readings, np.zeros_like(readings)])
    imu = pandas.DataFrame(rows, index=DT_S * np.arange(len(rows)), columns=columns)
    increments = strapdown.compute_increments_from_imu(imu, sensor_type)
    return Rotation.from_rotvec(increments[["theta_x", "theta_y", "theta_z"]].to_numpy(copy=True))


def test_trailing_1_is_pyins_increments_and_beats_its_rates() -> None:
    increments = CONE.increments(TIME_S)
    ours = coning_drift_rad_s(CONE, DT_S, "trailing-1", "increments") / DEG_PER_HOUR
    assert drift_deg_h(pyins_steps(increments, "increment")) == pytest.approx(ours, rel=1e-4)
    assert ours == pytest.approx(-0.2084, rel=0.01)
    by_rates = drift_deg_h(pyins_steps(CONE.rate(TIME_S), "rate"))
    assert by_rates == pytest.approx(-16.5, rel=0.01)


def test_picard_without_correction_is_ahrs_angular_rate() -> None:
    filters = import_module("ahrs.filters")
    rate, q0 = CONE.rate(TIME_S), CONE.attitude(0.0)
    theirs = filters.AngularRate(gyr=rate, q0=q0, Dt=DT_S, method="closed").Q
    ours = integrate(rate, DT_S, "picard", q0, beta=0.0)
    assert angle_between(ours, rotation(theirs[1:])).max() < 1e-9 * ARCSEC + 1e-12
    steps = rotation(theirs[:-1]).inv() * rotation(theirs[1:])
    assert drift_deg_h(steps) == pytest.approx(-8.3, rel=0.01)


def test_picard_with_correction_is_the_trapezoid_by_scipy() -> None:
    rate = CONE.rate(TIME_S)
    steps = Rotation.from_rotvec(0.5 * DT_S * (rate[1:] + rate[:-1]))
    now, turned = Rotation.identity(), []
    for step in steps[:200]:
        now *= step
        turned.append(now)
    ours = integrate(rate[:201], DT_S, "picard", beta=-0.5)
    assert angle_between(ours, Rotation.concatenate(turned)).max() < 1e-13
    assert drift_deg_h(steps) == pytest.approx(-33.0, rel=0.01)
