"""The stated uncertainty against what simulated revolutions do, line by line and as a whole."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import stdtrit

from northfinder.estimators import estimate_tilt, fit_harmonic, solve_azimuth
from northfinder.estimators.azimuth import AzimuthSolution
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.solvers import Method
from northfinder.estimators.tilt import TiltEstimate
from northfinder.estimators.uncertainty import (
    AzimuthBudget,
    BudgetLine,
    SystematicUncertainty,
    azimuth_budget,
)
from tests.estimators.truth import (
    ARCMIN,
    DEG,
    DEG_PER_HOUR,
    OMEGA_RAD_S,
    TWENTY_FOUR_RAD,
    Array,
    angle_between,
    read,
)

OUT_AND_BACK_RAD: Array = np.concatenate([TWENTY_FOUR_RAD, TWENTY_FOUR_RAD[::-1]])
NOTHING = SystematicUncertainty()
GYRO_SIGMA, FORCE_SIGMA_G = 0.01 * DEG_PER_HOUR, 5e-4  # the paper's Table 1
AT = (1.1, 8 * DEG, -12 * DEG, 40 * DEG)  # azimuth, pitch, roll, latitude


class Pipeline(NamedTuple):
    solution: AzimuthSolution
    fit: HarmonicFit
    tilt: TiltEstimate

    def budget(self, systematic: SystematicUncertainty = NOTHING) -> AzimuthBudget:
        return azimuth_budget(self.solution, self.fit, self.tilt, systematic)

    def line(self, source: str, systematic: SystematicUncertainty) -> Array:
        (line,) = [x for x in self.budget(systematic).lines if x.source == source]
        return line.u_rad


def noise_free(angle_rad: Array = OUT_AND_BACK_RAD, method: Method = "two_vector") -> Pipeline:
    rate, force = read(*AT, angle_rad)
    fit = fit_harmonic(angle_rad, rate, GYRO_SIGMA, time_s=np.arange(len(angle_rad)) * 5.0)
    tilt = estimate_tilt(fit_harmonic(angle_rad, force, FORCE_SIGMA_G))
    return Pipeline(solve_azimuth(fit, tilt, AT[3], method), fit, tilt)


def solve_readings(rate: Array, force: Array, latitude_rad: float | Array = AT[3]) -> Array:
    tilt = estimate_tilt(fit_harmonic(OUT_AND_BACK_RAD, force))
    fit = fit_harmonic(OUT_AND_BACK_RAD, rate)
    return solve_azimuth(fit, tilt, latitude_rad).azimuth_rad


def scatter(azimuth_rad: Array) -> float:
    return float(np.sqrt(np.mean(angle_between(azimuth_rad, AT[0]) ** 2)))


def test_revolutions_scatter_as_the_cramer_rao_bound_allows() -> None:
    random = np.random.default_rng(7)
    sigma = 0.02 * DEG_PER_HOUR
    rate, force = read(random.uniform(0, 2 * np.pi, 20_000), 0.0, 0.0, 40 * DEG)
    truth = np.arctan2(rate @ np.sin(TWENTY_FOUR_RAD), rate @ np.cos(TWENTY_FOUR_RAD))
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate + random.normal(0.0, sigma, rate.shape))
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force[0]))
    error = angle_between(solve_azimuth(fit, tilt, 40 * DEG).azimuth_rad, truth)
    bound_rad = sigma * np.sqrt(2 / 24) / (OMEGA_RAD_S * np.cos(40 * DEG))
    assert bound_rad / ARCMIN == pytest.approx(1.7226, abs=5e-5)
    assert 0.98 < error.std() / bound_rad < 1.02


def test_table_1_of_the_paper_follows_from_its_instruments() -> None:
    # 0.01 deg/h, 5e-4 g, tilt 5 deg, n = 24, 40 deg: 0.94..0.98' with the tilt's direction.
    sigmas = []
    for zeta in np.arange(0.0, 360.0, 15.0) * DEG:
        pitch = np.arcsin(-np.sin(5 * DEG) * np.cos(zeta))
        roll = np.arcsin(-np.sin(5 * DEG) * np.sin(zeta) / np.cos(pitch))
        rate, force = read(48 * DEG, pitch, roll, 40 * DEG)
        fit = fit_harmonic(TWENTY_FOUR_RAD, rate, GYRO_SIGMA)
        tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, FORCE_SIGMA_G))
        sigmas.append(float(solve_azimuth(fit, tilt, 40 * DEG).sigma_rad) / ARCMIN)
    assert 0.93 < min(sigmas) < max(sigmas) < 0.99


def covered(runs: int, seed: int, *, sigma_given: bool, method: Method) -> float:
    """Share of stated 95 % intervals that hold the truth, tilts of 0 to 10 deg, any azimuth."""
    random = np.random.default_rng(seed)
    azimuth, direction = random.uniform(0.0, 2 * np.pi, (2, runs))
    epsilon = random.uniform(0.0, 10 * DEG, runs)
    pitch = np.arcsin(-np.sin(epsilon) * np.cos(direction))
    roll = np.arcsin(-np.sin(epsilon) * np.sin(direction) / np.cos(pitch))
    rate, force = read(azimuth, pitch, roll, 40 * DEG)
    rate += random.normal(0.3 * DEG_PER_HOUR, GYRO_SIGMA, rate.shape)
    force += random.normal(0.0, FORCE_SIGMA_G, force.shape)
    sigmas = (GYRO_SIGMA, FORCE_SIGMA_G) if sigma_given else (None, None)
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate, sigmas[0], time_s=np.arange(24.0))
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, sigmas[1]))
    solution = solve_azimuth(fit, tilt, 40 * DEG, method)
    half_width = azimuth_budget(solution, fit, tilt, NOTHING).interval95_rad
    return float(np.mean(np.abs(angle_between(solution.azimuth_rad, azimuth)) <= half_width))


@pytest.mark.parametrize("sigma_given", [True, False], ids=["given-sigma", "estimated-sigma"])
def test_the_stated_interval_holds_the_truth_95_times_in_100(*, sigma_given: bool) -> None:
    share = covered(40_000, 8, sigma_given=sigma_given, method="coordinate_transform")
    assert 0.945 < share < 0.955  # 0.5 % is 4.6 standard errors of 40 000 runs


@pytest.mark.proof
@pytest.mark.parametrize("method", ["coordinate_transform", "vector", "two_vector"])
@pytest.mark.parametrize("sigma_given", [True, False], ids=["given-sigma", "estimated-sigma"])
def test_the_stated_interval_holds_the_truth_in_400_000_runs(
    method: Method, *, sigma_given: bool
) -> None:
    shares = [covered(50_000, k, sigma_given=sigma_given, method=method) for k in range(8)]
    assert 0.948 < np.mean(shares) < 0.952


def test_the_squares_of_the_lines_add_up_and_the_shares_to_one() -> None:
    everything = SystematicUncertainty(1e-4, 2e-5, 1e-3, 3e-5, 4e-5, 1e-13, 0.0)
    budget = noise_free().budget(everything)
    assert [line.source for line in budget.lines] == [
        "gyro noise",
        "accelerometer noise",
        "table angle",
        "latitude",
        "scale factor",
        "mounting",
        "drift curvature",
    ]
    assert all(line.u_rad > 0.0 for line in budget.lines)
    assert budget.sigma_rad**2 == pytest.approx(sum(line.u_rad**2 for line in budget.lines))
    assert sum(budget.shares) == pytest.approx(1.0)
    assert budget.interval95_rad == pytest.approx(1.959964 * budget.sigma_rad, rel=1e-6)


def test_noise_alone_is_the_sigma_of_the_solution() -> None:
    pipeline = noise_free()
    assert_allclose(pipeline.budget().sigma_rad, pipeline.solution.sigma_rad)


def test_degrees_of_freedom_combine_by_welch_and_satterthwaite() -> None:
    # JCGM 100 H.1.6: the end gauge, u = 25, 9.7 and 16.6 nm with 18, 25.6 and 2 degrees.
    lines = [(25.0, 18.0), (9.7, 25.6), (2.9, float("inf")), (16.6, 2.0)]
    budget = AzimuthBudget(tuple(BudgetLine("", np.array(u), dof) for u, dof in lines))
    assert budget.sigma_rad == pytest.approx(32.0, abs=0.5)
    assert budget.dof == pytest.approx(16.7, abs=1.0)
    expected = stdtrit(budget.dof, 0.975) * budget.sigma_rad
    assert budget.interval95_rad == pytest.approx(expected)


def test_the_line_of_the_table_angle_is_what_its_errors_do_to_both_sensors() -> None:
    random = np.random.default_rng(9)
    sigma_rad = 0.02 * DEG
    error = random.normal(0.0, sigma_rad, (20_000, 24))
    there_and_back = np.concatenate([error, error[:, ::-1]], axis=1)
    rate, force = read(*AT, OUT_AND_BACK_RAD + there_and_back)
    u_rad = noise_free().line("table angle", SystematicUncertainty(table_angle_rad=sigma_rad))
    assert scatter(solve_readings(rate, force)) == pytest.approx(u_rad, rel=0.03)


def test_a_second_visit_does_not_average_the_table_angle() -> None:
    once = SystematicUncertainty(table_angle_rad=1e-4)
    single = noise_free(TWENTY_FOUR_RAD).line("table angle", once)
    assert noise_free().line("table angle", once) == pytest.approx(single)


def test_the_line_of_the_mounting_is_what_both_angles_do() -> None:
    random = np.random.default_rng(10)
    gyro, accelerometer = random.normal(0.0, 1.0, (2, 20_000, 1)) * [[[1e-4]], [[8e-4]]]
    rate = read(*AT, OUT_AND_BACK_RAD + gyro).rate_rad_s
    force = read(*AT, OUT_AND_BACK_RAD + accelerometer).force_g
    stated = SystematicUncertainty(gyro_mount_rad=1e-4, accelerometer_mount_rad=8e-4)
    u_rad = noise_free().line("mounting", stated)
    assert scatter(solve_readings(rate, force)) == pytest.approx(u_rad, rel=0.03)


def test_the_line_of_the_scale_factor_is_what_it_does_on_a_tilted_table() -> None:
    random = np.random.default_rng(11)
    rate, force = read(*AT, OUT_AND_BACK_RAD)
    scaled = rate * (1.0 + random.normal(0.0, 1e-3, (20_000, 1)))
    u_rad = noise_free().line("scale factor", SystematicUncertainty(scale_factor=1e-3))
    assert scatter(solve_readings(scaled, force)) == pytest.approx(u_rad, rel=0.03)


def test_one_percent_of_scale_factor_costs_seven_minutes_at_pitch_8_roll_12() -> None:
    rate, force = read(np.arange(0, 360, 2.0) * DEG, *AT[1:])
    fit = fit_harmonic(TWENTY_FOUR_RAD, rate, GYRO_SIGMA)
    tilt = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, force, FORCE_SIGMA_G))
    pipeline = Pipeline(solve_azimuth(fit, tilt, AT[3]), fit, tilt)
    u_rad = pipeline.line("scale factor", SystematicUncertainty(scale_factor=0.01))
    assert u_rad.max() / ARCMIN == pytest.approx(7.0, abs=0.5)


def test_the_line_of_the_latitude_is_what_it_does_on_a_tilted_table() -> None:
    random = np.random.default_rng(12)
    rate, force = read(*AT, OUT_AND_BACK_RAD)
    wrong = AT[3] + random.normal(0.0, 1e-3, 20_000)
    u_rad = noise_free().line("latitude", SystematicUncertainty(latitude_rad=1e-3))
    assert scatter(solve_readings(rate, force, wrong)) == pytest.approx(u_rad, rel=0.03)


def test_a_stated_curvature_enters_as_what_it_does_to_the_azimuth() -> None:
    pipeline = noise_free()
    rate, force = read(*AT, OUT_AND_BACK_RAD)
    curve = 1e-13 * (pipeline.fit.design.centred_time_s()) ** 2
    moved = np.abs(angle_between(solve_readings(rate + curve, force), AT[0]))
    stated = SystematicUncertainty(drift_curvature_rad_s3=1e-13)
    assert pipeline.line("drift curvature", stated) == pytest.approx(moved, rel=1e-3)


def test_a_fitted_curvature_enters_only_where_it_is_significant() -> None:
    random = np.random.default_rng(13)
    pipeline = noise_free()
    noisy = pipeline.fit.reading + random.normal(0.0, GYRO_SIGMA, (4000, 48))
    shape = (pipeline.fit.design.centred_time_s() / 120.0) ** 2

    def curvature(readings: Array, drift_order: int = 0, *, given: bool) -> Array:
        fit = fit_harmonic(
            OUT_AND_BACK_RAD,
            readings,
            GYRO_SIGMA if given else None,
            pipeline.fit.design.time_s,
            drift_order,
        )
        solution = solve_azimuth(fit, pipeline.tilt, AT[3])
        return Pipeline(solution, fit, pipeline.tilt).line("drift curvature", NOTHING)

    for given in (True, False):
        assert np.mean(curvature(noisy, given=given) > 0.0) == pytest.approx(0.0027, abs=0.0025)
        assert np.all(curvature(noisy + 20 * GYRO_SIGMA * shape, given=given) > 0.0)
    assert np.all(curvature(noisy + 20 * GYRO_SIGMA * shape, 2, given=True) == 0.0)


def test_a_curvature_that_moves_the_azimuth_by_4_sigma_hardly_shows() -> None:
    # Out and back at the worst azimuth: it adds 9 to a chi-square of 45 degrees of freedom.
    rate, force = read(155 * DEG, 0.0, 0.0, AT[3], OUT_AND_BACK_RAD)
    fit = fit_harmonic(OUT_AND_BACK_RAD, rate, GYRO_SIGMA, time_s=np.arange(48.0))
    tilt = estimate_tilt(fit_harmonic(OUT_AND_BACK_RAD, force, FORCE_SIGMA_G))
    solution = solve_azimuth(fit, tilt, AT[3])
    noise = solution.jacobian[:2] @ fit.covariance[1:, 1:] @ solution.jacobian[:2]
    squared = fit.design.centred_time_s() ** 2
    curve = 4 * np.sqrt(noise) / (solution.jacobian[:2] @ fit.gain[1:] @ squared)
    drifting = fit_harmonic(OUT_AND_BACK_RAD, rate + curve * squared, GYRO_SIGMA)
    assert drifting.dof == 45
    assert drifting.chi2 == pytest.approx(9.3, abs=0.1)


def test_bias_instability_needs_the_times_of_the_visits() -> None:
    solution, fit, tilt = noise_free()
    flickering = replace(NOTHING, bias_instability_rad_s=0.05 * DEG_PER_HOUR)
    budget = azimuth_budget(solution, fit, tilt, flickering, visit_duration_s=2.5)
    assert budget.lines[-1].source == "bias instability"
    assert budget.lines[-1].u_rad > 0.0
    timeless = fit_harmonic(OUT_AND_BACK_RAD, fit.reading, GYRO_SIGMA)
    assert azimuth_budget(solution, timeless, tilt, NOTHING).sigma_rad > 0.0
    for incomplete, duration_s in ((fit, None), (timeless, 2.5)):
        with pytest.raises(ValueError, match="time and the duration of each visit"):
            azimuth_budget(solution, incomplete, tilt, flickering, duration_s)


def test_table_angles_are_shared_by_paired_visits_only() -> None:
    solution, fit, _ = noise_free()
    other = estimate_tilt(fit_harmonic(TWENTY_FOUR_RAD, read(*AT).force_g, FORCE_SIGMA_G))
    with pytest.raises(ValueError, match="48 gyro and 24 accelerometer readings"):
        azimuth_budget(solution, fit, other, SystematicUncertainty(table_angle_rad=1e-4))
