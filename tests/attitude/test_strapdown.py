"""Velocity and position: an hour on a coning base at rest, and pyins over the same increments."""

from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad_vec

from northfinder.attitude import ConingMotion, integrate
from northfinder.attitude.cone_at_rest import LATITUDE_RAD, navigate_cone_at_rest
from northfinder.attitude.strapdown import navigate, velocity_increments
from northfinder.earth import curvature_radii_m
from tests.attitude.motions import DEG, DEG_PER_HOUR, Array, rotation
from tests.evidence import Record

CONE = ConingMotion(1.0 * DEG, 16.0 * np.pi)
DT_S = 0.005


@pytest.mark.parametrize(
    ("method", "options", "expected_m"),
    [
        ("rate-vector", {}, 9009.0),
        ("two-sample", {"kind": "increments"}, 28_080.0),
        ("two-sample", {"extraction": "quadratic"}, 65_237.0),
        ("rate-vector-optimal", {}, 272.0),
    ],
)
def test_an_hour_at_rest_costs_each_method_its_metres(
    method: str, options: dict[str, Any], expected_m: float, record_property: Record
) -> None:
    track = navigate_cone_at_rest(CONE, DT_S, method, **options)
    told = " ".join([method, *options.values()])
    record_property("measured", f"{told}: {track.from_start_m.max():.0f} m")
    assert track.time_s[-1] == pytest.approx(3600.0)
    assert track.from_start_m.max() == pytest.approx(expected_m, rel=0.03)


def test_with_the_true_attitude_a_navigator_at_rest_stays_where_it_is() -> None:
    still = ConingMotion(0.0, CONE.cone_rate_rad_s)
    track = navigate_cone_at_rest(still, DT_S, "rate-vector", duration_s=600.0)
    assert track.from_start_m.max() < 0.01


def test_a_steady_tilt_rate_follows_schulers_pendulum() -> None:
    """0.01 deg/h about East: ``epsilon R (t - sin(nu t) / nu)`` north, nu^2 = g / R."""
    step_s, epsilon = 0.1, 0.01 * DEG_PER_HOUR
    time_s = step_s * np.arange(36_001.0)
    earth = 7.292115e-5 * np.array([0.0, np.cos(LATITUDE_RAD), np.sin(LATITUDE_RAD)])
    gyro = np.tile(step_s * (earth + np.array([epsilon, 0.0, 0.0])), (36_000, 1))
    q = np.vstack([[1.0, 0.0, 0.0, 0.0], integrate(gyro, step_s, "one-sample", kind="increments")])
    gravity = 9.793245  # normal gravity at 30 deg
    gained = np.tile([0.0, 0.0, step_s * gravity], (36_000, 1)) + 0.5 * np.cross(
        gyro, [0.0, 0.0, step_s * gravity]
    )
    track = navigate(q, gained, step_s, LATITUDE_RAD)
    radius_m = curvature_radii_m(LATITUDE_RAD)[0]
    nu = np.sqrt(gravity / radius_m)
    north_m = -epsilon * radius_m * (time_s - np.sin(nu * time_s) / nu)[::10]
    found_m = radius_m * (track.latitude_rad - LATITUDE_RAD)
    assert np.abs(found_m - north_m).max() < 0.02 * np.abs(north_m).max()


def test_velocity_increments_are_integrals_of_the_force_turned_into_the_first_axes() -> None:
    """Against quadrature over scipy's rotations, under the cone and a sway at its rate."""
    edges_s = DT_S * np.arange(3)

    def force(time_s: float) -> Array:
        sway = np.array([0.5, -0.4, 0.3]) * np.sin(40.0 * time_s)
        felt: Array = np.array([0.2, 1.0, 9.8]) + sway
        return felt

    def turned(time_s: float) -> Array:
        to_first = rotation(CONE.attitude(0.0)).inv() * rotation(CONE.attitude(time_s))
        applied: Array = to_first.apply(force(time_s))
        return applied

    true = quad_vec(turned, 0.0, edges_s[-1], epsrel=1e-13)[0]
    pieces = [quad_vec(force, a, b)[0] for a, b in pairwise(edges_s)]
    gained = velocity_increments(CONE.increments(edges_s), pieces)
    assert_allclose(gained[0], true, atol=1e-6)
    assert np.abs(gained[0] - np.sum(pieces, axis=0)).max() > 1e-4  # the correction matters


@pytest.mark.filterwarnings("ignore:The copy keyword is deprecated")
def test_pyins_navigates_to_the_same_place() -> None:
    """With a gyro bias of 3 deg/h and a force to the north-east, for ten minutes."""
    pandas, pyins = import_module("pandas"), import_module("pyins.strapdown")
    step_s, count = 0.1, 6000
    q0 = rotation(np.array([1.0, 0.0, 0.0, 0.0]))
    earth = 7.292115e-5 * np.array([0.0, np.cos(LATITUDE_RAD), np.sin(LATITUDE_RAD)])
    bias = 3.0 * DEG_PER_HOUR * np.array([1.0, -2.0, 0.5])
    theta = np.tile(step_s * (earth + bias), (count, 1))
    force = step_s * np.array([0.02, 0.03, 9.793245])
    gained = np.tile(force, (count, 1)) + 0.5 * np.cross(theta, force)
    q = np.vstack(
        [q0.as_quat(scalar_first=True), integrate(theta, step_s, "one-sample", kind="increments")]
    )
    ours = navigate(q, gained, step_s, LATITUDE_RAD)

    to_frd = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    start = dict.fromkeys(["lat", "lon", "alt", "VN", "VE", "VD", "roll", "pitch", "heading"], 0.0)
    theirs = pyins.Integrator(pandas.Series(start | {"lat": 30.0}), with_altitude=False)
    columns = ["dt", "theta_x", "theta_y", "theta_z", "dv_x", "dv_y", "dv_z"]
    rows = np.hstack([np.full((count, 1), step_s), theta @ to_frd.T, gained @ to_frd.T])
    times = step_s * np.arange(1, count + 1)
    end = theirs.integrate(pandas.DataFrame(rows, index=times, columns=columns)).iloc[-1]
    moved_m = ours.from_start_m[-1]
    apart_rad = [ours.latitude_rad[-1] - end.lat * DEG, ours.longitude_rad[-1] - end.lon * DEG]
    assert moved_m > 5000.0
    assert np.hypot(*apart_rad) * 6.37e6 < 1e-3 * moved_m
    assert_allclose(ours.velocity_n[-1], [end.VE, end.VN], rtol=1e-3, atol=0.01)


def test_what_is_no_record_of_a_navigator_is_refused() -> None:
    still = np.tile([1.0, 0.0, 0.0, 0.0], (11, 1))
    with pytest.raises(ValueError, match=r"10 updates need attitudes \(11, 4\); got \(10, 4\)"):
        navigate(still[1:], np.zeros((10, 3)), 0.1, 0.5)
    with pytest.raises(ValueError, match=r"5 updates of 0.1 s do not fill one step of 10"):
        navigate(still[:6], np.zeros((5, 3)), 0.1, 0.5)
    with pytest.raises(ValueError, match=r"the same shape \(2 m, 3\)"):
        velocity_increments(np.zeros((3, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="does not last two sampling periods"):
        navigate_cone_at_rest(CONE, DT_S, "three-sample", "increments")
