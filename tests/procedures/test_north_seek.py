"""Whole north-seeks through drivers and bytes, against the truth of the simulation."""

import asyncio
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from drivers.interfaces import TableState
from northfinder.procedures.events import Estimate, Event, Progress, VisitCompleted
from northfinder.procedures.north_seek import Plan, run
from northfinder.procedures.north_seek_json import JsonObject
from northfinder.rig import Rig
from northfinder.wiring import build_rig
from sim.world import World
from tests.procedures.rigs import SHORT, config_of, seek, sigmas_off, virtually, world_of

# Where sigma comes from the residuals: Student's t of the 5 degrees of freedom that SHORT leaves,
# as rare as 4 sigma of a known noise.
FOUR_SIGMAS_OF_5_DOF = 12.28


@pytest.mark.parametrize("seed", range(20))
def test_north_is_within_four_stated_sigma(seed: int) -> None:
    plan = Plan(positions=8, dwell_s=0.2, settle_s=0.1)
    result = seek(plan, simulation={"seed": seed}, gyro={"noise_deg_sqrt_h": 0.001}).completed
    assert sigmas_off(result, 48.0) < 4.0


@pytest.mark.parametrize("latitude_deg", [-84.0, -40.0, 0.0, 60.0])
@pytest.mark.parametrize(("pitch_deg", "roll_deg"), [(0.0, 0.0), (5.0, -8.0), (-20.0, 15.0)])
def test_either_hemisphere_and_any_tilt(
    latitude_deg: float, pitch_deg: float, roll_deg: float
) -> None:
    tilted = {"pitch_deg": pitch_deg, "roll_deg": roll_deg, "azimuth_deg": 211.0}
    result = seek(SHORT, simulation=tilted, site={"latitude_deg": latitude_deg}).completed
    assert sigmas_off(result, 211.0) < FOUR_SIGMAS_OF_5_DOF
    tilt = result["tilt"]
    assert [tilt["pitch_deg"], tilt["roll_deg"]] == pytest.approx([pitch_deg, roll_deg], abs=0.02)


@pytest.mark.parametrize("azimuth_deg", [0.0, 0.001, 90.0, 179.9, 180.0, 270.0, 359.999])
def test_azimuths_all_around_the_circle_and_at_its_wrap(azimuth_deg: float) -> None:
    result = seek(SHORT, simulation={"azimuth_deg": azimuth_deg}).completed
    assert sigmas_off(result, azimuth_deg) < FOUR_SIGMAS_OF_5_DOF
    azimuths_deg = [solution["azimuth_deg"] for solution in result["solutions"].values()]
    assert all(0.0 <= azimuth < 360.0 for azimuth in azimuths_deg)
    low_deg, high_deg = result["azimuth_interval95_deg"]
    assert low_deg < result["azimuth_deg"] < high_deg


@pytest.mark.parametrize("order", ["sequential", "out-and-back", "opposite"])
@pytest.mark.parametrize("positions", [3, 7])
def test_every_order_with_few_and_odd_angles(order: Any, positions: int) -> None:  # noqa: ANN401
    plan = Plan(positions=positions, dwell_s=0.4, settle_s=0.1, order=order, revolutions=2)
    result = seek(plan, gyro={"noise_deg_sqrt_h": 0.001}).completed
    assert sigmas_off(result, 48.0) < 4.0
    assert len({visit["angle_deg"] for visit in result["visits"]}) == positions


def test_the_reference_line_is_the_azimuth_and_its_offset_on_the_circle() -> None:
    result = seek(SHORT, site={"reference_offset_deg": -60.0}).completed
    expected_deg = (result["azimuth_deg"] - 60.0) % 360.0
    assert result["reference_azimuth_deg"] == pytest.approx(expected_deg)


def test_equal_seeds_give_the_same_result_bit_for_bit_and_others_another() -> None:
    first, again, other = (seek(simulation={"seed": s}).completed for s in (5, 5, 6))
    assert first == again
    assert first["azimuth_deg"] != other["azimuth_deg"]


def test_north_so_far_narrows_visit_by_visit() -> None:
    events = seek(Plan(positions=12, dwell_s=0.4, settle_s=0.1)).events
    estimates = [event for event in events if isinstance(event, Estimate)]
    sigmas_rad = [estimate.sigma_rad for estimate in estimates]
    assert [estimate.visits for estimate in estimates] == list(range(3, 25))
    assert sigmas_rad[-1] < sigmas_rad[len(sigmas_rad) // 2] < sigmas_rad[0] / 3
    assert all(later < 1.05 * earlier for earlier, later in pairwise(sigmas_rad))


def test_progress_goes_from_nothing_to_all_and_says_what_is_done() -> None:
    events = seek(SHORT).events
    progress = [event for event in events if isinstance(event, Progress)]
    fractions = [event.fraction for event in progress]
    assert fractions == sorted(fractions)
    assert (fractions[0], fractions[-1], progress[-1].left_s) == (0.0, 1.0, 0.0)
    assert progress[0].sentence() == "finding the table's reference"
    assert [event.visit.index for event in events if isinstance(event, VisitCompleted)] == [
        *range(8)
    ]


def bias_by_drift(order: Any) -> tuple[float, JsonObject]:  # noqa: ANN401 - a literal
    """What 0.05 deg/h over the run does to the azimuth, arc minutes, all noise being the same."""
    plan = Plan(positions=8, dwell_s=0.4, settle_s=0.1, order=order)
    steady = seek(plan)
    drift_deg_h_h = 0.05 / (steady.lasted_s / 3600.0)
    drifting = seek(plan, simulation={"gyro_drift_deg_h_h": drift_deg_h_h}).completed
    return 60.0 * (drifting["azimuth_deg"] - steady.completed["azimuth_deg"]), drifting


@pytest.mark.parametrize("order", ["out-and-back", "opposite"])
def test_going_back_cancels_a_linear_drift_unfitted(order: str) -> None:
    bias_arcmin, result = bias_by_drift(order)
    assert abs(bias_arcmin) < 0.05
    assert result["segments"][0]["drift_deg_h_h"] is None


def test_the_sequential_order_fits_a_linear_drift() -> None:
    bias_arcmin, result = bias_by_drift("sequential")
    assert abs(bias_arcmin) < 0.05
    assert result["segments"][0]["drift_deg_h_h"] is not None


def test_a_known_noise_gives_the_normal_interval_and_an_unknown_one_students() -> None:
    gyro, accelerometer = {"noise_deg_sqrt_h": 0.001}, {"noise_g_sqrt_hz": 1e-5}
    known = seek(SHORT, gyro=gyro, accelerometer=accelerometer).completed
    assert half_width_in_sigmas(known) == pytest.approx(1.95996, abs=1e-4)
    estimated = half_width_in_sigmas(seek(SHORT).completed)
    assert estimated == pytest.approx(2.571, abs=0.02)  # Student's t, 97.5 %, 5 dof


def half_width_in_sigmas(result: JsonObject) -> float:
    low_deg, high_deg = result["azimuth_interval95_deg"]
    return float((high_deg - low_deg) / 2 / result["azimuth_sigma_deg"])


def test_sensors_without_any_noise_find_north_too() -> None:
    noise_free = {"gyro_noise_deg_sqrt_h": 0.0, "accel_noise_g_sqrt_hz": 0.0}
    result = seek(SHORT, simulation=noise_free).completed
    assert result["azimuth_deg"] == pytest.approx(48.0, abs=0.005)


def test_the_table_rests_after_a_run() -> None:
    assert seek().at_rest


def test_a_watcher_that_fails_ends_the_run_with_the_table_at_rest() -> None:
    def fail(_: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == 2:
            msg = "the disk is full"
            raise OSError(msg)

    outcome = seek(SHORT, fail)
    assert isinstance(outcome.error, OSError)
    assert outcome.at_rest


async def cancelled_in_mid_move(rig: Rig) -> tuple[bool, bool, TableState]:
    """Return whether the plate turned when the run was cancelled, and how it was afterwards."""
    async with rig:
        plate, loop = world_of(rig).plate, asyncio.get_running_loop()

        async def ignore(_: Event) -> None: ...

        running = asyncio.create_task(run(rig, SHORT, ignore))
        await asyncio.sleep(0.5)
        while plate.end_s < loop.time() + 0.3:  # noqa: ASYNC110 - the plate has no event to wait for
            await asyncio.sleep(0.01)
        turned = abs(float(plate.rate_rad_s(np.array(loop.time())))) > 0.0
        running.cancel()
        with pytest.raises(asyncio.CancelledError):
            await running
        return turned, plate.end_s <= loop.time(), await rig.table_state()


def test_cancelled_in_the_middle_of_a_move_the_table_is_stopped() -> None:
    config = config_of()
    turned, at_rest, state = virtually(config, cancelled_in_mid_move(build_rig(config)))
    assert turned
    assert at_rest
    assert not state.moving


@pytest.mark.parametrize("seed", [1, 2])
def test_a_rig_is_homed_first_wherever_its_table_stands(seed: int) -> None:
    result = seek(SHORT, simulation={"seed": seed}).completed
    angles_deg = [visit["angle_deg"] for visit in result["visits"]]
    assert angles_deg == pytest.approx([0.0, 90.0, 180.0, 270.0, 270.0, 180.0, 90.0, 0.0])
    assert math.isfinite(result["visits"][0]["start_s"])
