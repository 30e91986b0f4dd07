"""Alignment at rest and on the rocking base, against the truth and the shared-bias equilibrium."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from northfinder.alignment import METHODS, Aligner, Alignment, Limits
from northfinder.errors import EstimationError
from northfinder.units import ARCMIN, DEG
from sim.rocking_base import RockingBase
from tests.alignment.bases import (
    ARCSEC,
    EARTH_RATE_RAD_S,
    LATITUDE_RAD,
    PERFECT,
    PERIOD_S,
    SENSORS,
    Array,
    Preset,
    at_rest,
    nominal,
    paper_like,
    stream,
)
from tests.evidence import Record

SEEDS = 8
EVERY_METHOD = pytest.mark.parametrize(
    ("method", "warm_s"), [*((name, 0.0) for name in METHODS), ("quest", 15.0)]
)


def still_increments(
    attitude: Rotation, latitude_rad: float, seconds: float
) -> tuple[Array, Array]:
    """Perfect increments on a base at rest, 50 a second: constant in b; velocity in g s."""
    north_up = [0.0, np.cos(latitude_rad), np.sin(latitude_rad)]
    rate = attitude.inv().apply(EARTH_RATE_RAD_S * np.array(north_up))
    force = attitude.inv().apply([0.0, 0.0, 1.0])
    ones = np.ones((round(50.0 * seconds), 1))
    return 0.02 * rate * ones, 0.02 * force * ones


@EVERY_METHOD
@pytest.mark.parametrize("latitude_deg", [-60.0, 0.0, 39.1, 85.0])
def test_at_rest_without_errors_every_method_finds_the_attitude(
    method: str, warm_s: float, latitude_deg: float
) -> None:
    for seed in range(3):
        truth = Rotation.random(rng=np.random.default_rng(seed))
        latitude_rad = latitude_deg * DEG
        aligner = Aligner(method, latitude_rad, 0.02, sensors=PERFECT, warm_s=warm_s)
        aligner.add(*still_increments(truth, latitude_rad, 45.0))
        found = aligner.solve()
        error = (Rotation.from_quat(found.q_b_n, scalar_first=True) * truth.inv()).as_rotvec()
        assert np.abs(error[:2]).max() < 1e-3 * ARCSEC
        assert abs(error[2]) < 0.2 * ARCSEC
        assert (found.time_s, found.duration_s) == pytest.approx((45.0, 45.0 - warm_s))


@EVERY_METHOD
@settings(max_examples=12)
@given(st.lists(st.integers(1, 1800), min_size=1, max_size=5))
def test_how_the_stream_is_cut_changes_nothing(method: str, warm_s: float, cuts: list[int]) -> None:
    rng = np.random.default_rng(3)
    angle, velocity = still_increments(Rotation.random(rng=rng), LATITUDE_RAD, 40.0)
    angle, velocity = (x + 1e-6 * rng.normal(size=x.shape) for x in (angle, velocity))
    whole, parts = (
        Aligner(method, LATITUDE_RAD, 0.008, sensors=SENSORS, gravity=2.5, warm_s=warm_s / 5.0)
        for _ in range(2)
    )
    whole.add(angle, velocity)
    for first, last in zip([0, *sorted(cuts)], [*sorted(cuts), len(angle)], strict=True):
        parts.add(angle[first:last], velocity[first:last])
    one, other = whole.solve(), parts.solve()
    assert_allclose(other.q_b_n, one.q_b_n, atol=1e-8)
    assert (other.time_s, other.duration_s) == (one.time_s, one.duration_s)
    assert other.heading_sigma_rad == pytest.approx(one.heading_sigma_rad, rel=1e-4)


def test_the_attitude_is_that_of_the_streams_end_while_the_base_turns() -> None:
    """It yaws by 20 deg/s: the half observation at the end counts in the attitude too."""
    yawing = replace(nominal(LATITUDE_RAD, 0).yaw, amplitude_rad=0.5)
    base_settings = replace(at_rest(LATITUDE_RAD, 0), yaw=yawing, lever_arm_m=(0.0, 0.0, 0.0))
    base = RockingBase(base_settings)
    time_s = PERIOD_S * np.arange(1.0, 4002.0)
    rate, force = base.felt(time_s, PERIOD_S)
    gravity = base_settings.gravity() / 9.80665
    aligner = Aligner("quest-taper", LATITUDE_RAD, PERIOD_S, sensors=PERFECT, gravity=gravity)
    for count in (3998, 1, 1, 1):
        begin = round(aligner.time_s / PERIOD_S)
        aligner.add(PERIOD_S * rate[begin:][:count], PERIOD_S * force[begin:][:count])
        found = aligner.solve()
        truth = base.attitude(np.array([found.time_s]))[0]
        q = Rotation.from_quat(found.q_b_n, scalar_first=True)
        assert (q * Rotation.from_matrix(truth).inv()).magnitude() < 0.01 * ARCSEC


@pytest.mark.parametrize(("preset", "limit_arcmin"), [(nominal, 1.8), (paper_like, 2.0)])
def test_the_taper_needs_no_warm_up(
    preset: Preset, limit_arcmin: float, record_property: Record
) -> None:
    """Cold, 120 s, 20 seeds, against the equilibrium that shares the biases."""
    records = [stream(preset, seed) for seed in range(20)]
    errors = np.array([x.from_shared_equilibrium(x.align("quest-taper")) for x in records])
    heading_rad, level_rad = np.abs(errors[:, 2]), np.hypot(errors[:, 0], errors[:, 1])
    told = f"heading {heading_rad.mean() / ARCMIN:.2f}' (at most {heading_rad.max() / ARCMIN:.1f}')"
    name = preset.__name__.replace("_", "-")
    record_property("measured", f'{name}: {told}, level {level_rad.mean() / ARCSEC:.1f}"')
    assert heading_rad.mean() < limit_arcmin * ARCMIN
    assert level_rad.mean() < 4.0 * ARCSEC
    published = [x.from_shared_equilibrium(x.align("quest"))[2] for x in records]
    assert np.abs(published).mean() > 4.0 * np.abs(errors[:, 2]).mean()


def test_warm_the_papers_quest_is_good() -> None:
    """Paper-like, the filter warm for 120 s before the fit of 120 s; 100 seeds in the proof."""
    errors = [
        record.from_shared_equilibrium(record.align("quest", 120.0))[2]
        for record in (stream(paper_like, seed, 240.0) for seed in range(SEEDS))
    ]
    assert np.abs(errors).mean() < 1.5 * ARCMIN


def test_warm_the_base_shakes_optimized_triad_more_than_quest(record_property: Record) -> None:
    """Perfect sensors leave what the base does to each: measured 6 times as much."""
    records = [stream(paper_like, seed, 240.0, PERFECT) for seed in range(SEEDS)]
    quest, triad = (
        np.mean([abs(x.error(x.align(method, 120.0))[2]) for x in records])
        for method in ("quest", "optimized-triad")
    )
    record_property("measured", f"{triad / quest:.1f} times with perfect sensors")
    assert triad > 2.5 * quest


@pytest.mark.proof
def test_warm_optimized_triad_errs_several_times_as_much_as_quest(
    record_property: Record,
) -> None:
    """With the sensors' noise, which both share; of 20 seeds the ratio is 2.4 to 3.7."""
    records = [stream(paper_like, seed, 240.0) for seed in range(100)]
    quest, triad = (
        np.mean([abs(x.from_shared_equilibrium(x.align(method, 120.0))[2]) for x in records])
        for method in ("quest", "optimized-triad")
    )
    told = f"{quest / ARCMIN:.2f}'; {triad / quest:.2f} times over 100 seeds"
    record_property("measured", told)
    assert triad > 2.5 * quest
    assert quest < 1.5 * ARCMIN


def pointing(yaw_deg: float, pitch_deg: float, roll_deg: float) -> Alignment:
    """ZXY, yaw counter-clockwise, by scipy."""
    turn = Rotation.from_euler("ZXY", [yaw_deg, pitch_deg, roll_deg], degrees=True)
    return Alignment("quest", turn.as_quat(scalar_first=True), 0.0, 0.0, Limits(()))


@given(st.floats(-180.0, 180.0), st.floats(-80.0, 80.0), st.floats(-179.0, 179.0))
def test_heading_pitch_and_roll_are_scipys_angles(
    yaw_deg: float, pitch_deg: float, roll_deg: float
) -> None:
    found = pointing(yaw_deg, pitch_deg, roll_deg)
    assert 0.0 <= found.heading_rad() < 2.0 * np.pi
    assert np.cos(found.heading_rad() + yaw_deg * DEG) == pytest.approx(1.0, abs=1e-12)
    assert found.pitch_rad / DEG == pytest.approx(pitch_deg, abs=1e-9)
    assert found.roll_rad / DEG == pytest.approx(roll_deg, abs=1e-9)


def test_heading_is_of_any_body_direction_and_never_a_whole_turn() -> None:
    found = pointing(-30.0, 0.0, 0.0)
    assert found.heading_rad([1.0, 0.0, 0.0]) == pytest.approx(120.0 * DEG)
    assert found.heading_rad([0.0, -7.0, 0.0]) == pytest.approx(210.0 * DEG)
    assert pointing(1e-15, 0.0, 0.0).heading_rad() == 0.0
    assert pointing(0.0, 90.0, 0.0).pitch_rad == pytest.approx(90.0 * DEG)


def test_the_interval_is_196_sigma_either_way() -> None:
    found = stream(at_rest, 0).align("quest-taper")
    low, high = found.heading_interval95_rad()
    assert high - low == pytest.approx(2.0 * 1.959964 * found.heading_sigma_rad)
    assert (low + high) / 2.0 == pytest.approx(found.heading_rad())
    assert found.heading_sigma_rad / ARCMIN == pytest.approx(np.hypot(1.556, 2.95), rel=0.01)
    assert found.level_sigma_rad / ARCSEC == pytest.approx(10.3, rel=0.01)


@pytest.mark.parametrize(
    ("axis_b", "complaint"),
    [
        ([0.0, 0.0, 1.0], "points 90 deg up: it has no heading"),
        ([0.01, 0.0, -1.0], r"points -89\.4 deg up"),
        ([0.0, 0.0, 0.0], "give three finite numbers, not all zero"),
        ([0.0, np.nan, 0.0], "give three finite numbers"),
        ([0.0, 1.0], "give three finite numbers"),
    ],
)
def test_an_axis_without_heading_is_refused_in_words(axis_b: list[float], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        pointing(0.0, 0.0, 0.0).heading_rad(axis_b)


@pytest.mark.parametrize(
    ("bad", "error", "complaint"),
    [
        ({"method": "quest-rwa"}, ValueError, "unknown method 'quest-rwa'; did you mean"),
        ({"latitude_rad": 89.01 * DEG}, EstimationError, "heading cannot be observed beyond 89"),
        ({"latitude_rad": 40.0}, ValueError, "latitude_rad is 40; .* convert degrees"),
        ({"dt": 0.0}, ValueError, "dt is 0; it must be a positive"),
        ({"gravity": 0.0}, ValueError, "gravity is 0; give local gravity in the increments' unit"),
        ({"gravity": np.nan}, ValueError, "gravity is nan"),
        ({"warm_s": 60.0}, ValueError, "quest-taper has no filter to warm; leave it 0"),
        ({"warm_s": np.inf, "method": "quest"}, ValueError, "warm_s is inf"),
    ],
)
def test_what_cannot_be_aligned_is_refused_in_words(
    bad: dict[str, Any], error: type[Exception], complaint: str
) -> None:
    plain: dict[str, Any] = {"method": "quest-taper", "latitude_rad": 0.7, "dt": 0.01}
    with pytest.raises(error, match=complaint):
        Aligner(**(plain | bad), sensors=SENSORS)


@EVERY_METHOD
def test_too_short_a_time_is_refused_in_words(method: str, warm_s: float) -> None:
    aligner = Aligner(method, LATITUDE_RAD, 0.02, sensors=SENSORS, warm_s=warm_s)
    with pytest.raises(EstimationError, match="the fit has 0 s of data; the Earth must turn for"):
        aligner.solve()
    angle, velocity = still_increments(Rotation.identity(), LATITUDE_RAD, 40.0)
    count = round(50.0 * (warm_s + 9.9))
    aligner.add(angle[:count], velocity[:count])
    with pytest.raises(EstimationError, match=r"the fit has 9\.9 s of data; .* at least 10 s"):
        aligner.solve()
    aligner.add(angle[:10], velocity[:10])
    assert aligner.solve().duration_s == pytest.approx(10.1)


def test_a_gap_in_the_stream_is_refused_and_leaves_the_alignment_as_it_was() -> None:
    aligner = Aligner("quest", LATITUDE_RAD, 0.02, sensors=SENSORS)
    angle, velocity = still_increments(Rotation.identity(), LATITUDE_RAD, 12.0)
    aligner.add(angle, velocity)
    before = aligner.solve()
    with pytest.raises(ValueError, match="sample 2 holds nan on axis 0; bridge such gaps first"):
        aligner.add(np.where(np.arange(5)[:, np.newaxis] == 2, np.nan, angle[:5]), velocity[:5])
    assert_allclose(aligner.solve().q_b_n, before.q_b_n, atol=0.0)


def test_a_base_without_gravity_is_refused_in_words() -> None:
    for method in METHODS:
        aligner = Aligner(method, LATITUDE_RAD, 0.02, sensors=SENSORS)
        aligner.add(np.zeros((600, 3)), np.zeros((600, 3)))
        with pytest.raises(EstimationError, match=r"parallel|cancel|is zero"):
            aligner.solve()
