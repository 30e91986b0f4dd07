"""Interrupted runs go on in a new segment, once two angles show that nothing has moved."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from northfinder.procedures.events import (
    Estimate,
    Event,
    Paused,
    Progress,
    Resumed,
    SegmentOpened,
)
from northfinder.procedures.gate import Gate
from northfinder.procedures.north_seek import Plan
from northfinder.procedures.north_seek_json import north_seek_json
from northfinder.procedures.reduction import reduce_visits
from northfinder.procedures.segments import next_segment, planned_visits, taking_part
from sim.world import World
from tests.procedures.lives import (
    EIGHT,
    Life,
    Watch,
    crash_after,
    live,
    nothing,
    pause,
    pause_after,
)
from tests.procedures.rigs import config_of, sigmas_off

KNOWN = {"noise_deg_sqrt_h": 0.001}
ANOTHER = {"seed": 2, "gyro_bias_deg_h": 1.1}  # the next day: other noise, another bias


def knocked(azimuth_deg: float = 0.0, pitch_deg: float = 0.0) -> Watch:
    def knock(world: World, _: Gate, event: Event) -> None:
        if isinstance(event, Progress) and event.phase == "homing":
            truth = world.bench.truth
            moved = replace(
                truth,
                azimuth_rad=truth.azimuth_rad + math.radians(azimuth_deg),
                pitch_rad=truth.pitch_rad + math.radians(pitch_deg),
            )
            world.bench.set_down(moved, None)

    return knock


@pytest.fixture(scope="module")
def first_life() -> Life:
    return live(watch=crash_after(9), gyro=KNOWN)


def resumed(first: Life, watch: Watch = nothing) -> Life:
    return live(done=first.visits, watch=watch, gyro=KNOWN, simulation=ANOTHER)


@pytest.fixture(scope="module")
def second_life(first_life: Life) -> Life:
    return resumed(first_life)


def test_a_resumed_run_finds_north_with_a_bias_for_each_segment(second_life: Life) -> None:
    result = second_life.completed
    assert sigmas_off(result, 48.0) < 4.0
    biases_deg_h = [segment["R_deg_h"] for segment in result["segments"]]
    assert [segment["segment"] for segment in result["segments"]] == [0, 1]
    assert biases_deg_h == pytest.approx([0.3, 1.1], abs=0.3)
    assert all(segment["drift_deg_h_h"] is not None for segment in result["segments"])


def test_every_visit_of_the_plan_is_made_once_and_two_are_repeated(second_life: Life) -> None:
    visits = second_life.completed["visits"]
    assert [visit["index"] for visit in visits] == list(range(18))
    assert [visit["segment"] for visit in visits] == [0] * 9 + [1] * 9
    repeats = [visit["repeats"] for visit in visits]
    assert [at for at, first in enumerate(repeats) if first is not None] == [9, 10]
    for again in visits[9:11]:
        first = visits[again["repeats"]]
        assert first["segment"] == 0
        assert (first["angle_deg"], first["direction"]) == (again["angle_deg"], again["direction"])
    planned_deg = [visit["angle_deg"] for visit in visits if visit["repeats"] is None]
    assert planned_deg == pytest.approx([*range(0, 360, 45), *range(315, -1, -45)])


def test_time_goes_on_from_where_the_caller_says(second_life: Life) -> None:
    starts_s = [visit["start_s"] for visit in second_life.completed["visits"]]
    assert starts_s == sorted(starts_s)
    assert starts_s[8] < 1000.0 < starts_s[9] < 1030.0
    assert second_life.visits[9].gyro.time_s[0] < 1000.0  # the second process's own clock
    middles_s = [visit.time_s for visit in second_life.visits]
    lengths_s = [visit.duration_s for visit in second_life.visits]
    assert middles_s == pytest.approx(np.array(starts_s) + np.array(lengths_s) / 2, abs=0.01)


def test_a_resumed_run_says_what_it_does_and_what_it_proved(second_life: Life) -> None:
    phases = [event.phase for event in second_life.of(Progress)]
    assert phases == ["homing", "proving", "proving", *["measuring"] * 7, "solving"]
    fractions = [event.fraction for event in second_life.of(Progress)]
    assert fractions == sorted(fractions)
    assert 0.4 < fractions[0] < fractions[-1] == 1.0
    assert [event.visit for event in second_life.of(Progress)] == [10] * 4 + [*range(11, 17), 16]
    left_s = [event.left_s for event in second_life.of(Progress)]
    assert left_s == sorted(left_s, reverse=True)
    (opened,) = second_life.of(SegmentOpened)
    assert opened.segment == 1
    assert "nothing moved" in opened.sentence()
    (check,) = [c for c in second_life.completed["checks"] if c["name"] == "interruptions"]
    assert check["status"] == "pass"
    assert "would have shown" in check["detail"]


def test_north_so_far_goes_on_with_the_first_visit_of_the_plan(second_life: Life) -> None:
    assert [estimate.visits for estimate in second_life.of(Estimate)] == list(range(12, 19))
    proof = second_life.kinds().index("SegmentOpened")
    assert "Estimate" not in second_life.kinds()[:proof]


def test_the_same_visits_give_the_identical_result(second_life: Life) -> None:
    config = config_of(gyro=KNOWN, site={"latitude_deg": 40.0}, simulation=ANOTHER)
    again = north_seek_json(reduce_visits(second_life.visits, EIGHT, config))
    assert json.dumps(again) == json.dumps(second_life.completed)


@pytest.mark.parametrize(
    ("knock", "words"),
    [
        pytest.param(knocked(azimuth_deg=15.0), "deg clockwise", id="clockwise"),
        pytest.param(knocked(azimuth_deg=-15.0), "deg counter-clockwise", id="counter-clockwise"),
        pytest.param(knocked(pitch_deg=0.2), "a tilt of about 0.2 deg", id="tilted"),
    ],
)
def test_a_bench_that_was_knocked_is_refused_with_the_reason(
    first_life: Life, knock: Watch, words: str
) -> None:
    life = resumed(first_life, knock)
    assert words in life.refusal
    assert "would have shown" in life.refusal
    assert len(life.visits) == 11


def test_a_refused_segment_takes_no_part_and_the_bench_put_back_is_believed(
    first_life: Life, second_life: Life
) -> None:
    refused = resumed(first_life, knocked(azimuth_deg=15.0))
    assert resumed(refused, knocked(azimuth_deg=15.0)).refusal
    put_back = resumed(refused)
    segments = [visit.segment for visit in put_back.visits]
    assert segments == [0] * 9 + [1] * 2 + [2] * 9
    assert [part["segment"] for part in put_back.completed["segments"]] == [0, 2]
    assert len(put_back.completed["visits"]) == 20
    assert put_back.completed["azimuth_deg"] == pytest.approx(
        second_life.completed["azimuth_deg"], abs=0.1
    )


def test_a_pause_no_longer_than_a_dwell_changes_nothing() -> None:
    life = live(watch=pause_after(5, 0.9), gyro=KNOWN)
    kinds = life.kinds()
    at = kinds.index("Paused")
    assert kinds[at - 2 : at + 3] == ["VisitCompleted", "Estimate", "Paused", "Resumed", "Progress"]
    assert [visit["segment"] for visit in life.completed["visits"]] == [0] * 16
    assert life.of(Resumed)[0].paused_s == pytest.approx(0.9)


def test_a_longer_pause_opens_a_segment() -> None:
    life = live(watch=pause_after(5, 60.0), gyro=KNOWN)
    assert sigmas_off(life.completed, 48.0) < 4.0
    visits = life.completed["visits"]
    assert [visit["segment"] for visit in visits] == [0] * 5 + [1] * 13
    assert visits[5]["start_s"] - visits[4]["start_s"] > 60.0
    assert len(life.of(Paused)) == 1


def test_a_bench_knocked_in_a_long_pause_is_found_out() -> None:
    wait, knock = pause_after(10, 60.0), knocked(azimuth_deg=15.0)

    def watch(world: World, gate: Gate, event: Event) -> None:
        wait(world, gate, event)
        if isinstance(event, Progress) and event.visit > 1:  # its first homing is not the pause's
            knock(world, gate, event)

    assert "shows a turn" in live(watch=watch, gyro=KNOWN).refusal


def test_a_long_pause_within_the_proof_begins_it_anew(first_life: Life) -> None:
    life = resumed(first_life, pause_after(1, 60.0))
    repeated = [(visit.segment, visit.repeats is not None) for visit in life.visits[9:13]]
    assert repeated == [(1, True), (2, True), (2, True), (2, False)]
    assert [part["segment"] for part in life.completed["segments"]] == [0, 2]


def test_a_pause_before_the_first_visit_has_nothing_to_prove() -> None:
    def watch(_: World, gate: Gate, event: Event) -> None:
        if isinstance(event, Progress) and event.phase == "homing":
            pause(gate, 60.0)

    life = live(watch=watch, gyro=KNOWN)
    assert len(life.of(Paused)) == 1
    assert [visit["segment"] for visit in life.completed["visits"]] == [0] * 16


@pytest.mark.parametrize("visits", [1, 2, 3])
def test_after_the_first_few_visits_what_can_be_proved_is(visits: int) -> None:
    first = live(watch=crash_after(visits), gyro=KNOWN)
    life = resumed(first)
    repeats = [visit["repeats"] for visit in life.completed["visits"] if visit["segment"] == 1]
    assert sum(first is not None for first in repeats) == min(visits, 2)
    assert sigmas_off(life.completed, 48.0) < 4.0
    assert "tilt" in resumed(first, knocked(pitch_deg=0.2)).refusal


def test_a_run_that_only_lacks_its_result_moves_nothing() -> None:
    whole = live(gyro=KNOWN)
    again = live(done=whole.visits, gyro=KNOWN)
    assert again.kinds() == ["Progress"]
    assert again.completed == whole.completed


def test_visits_that_only_proved_take_no_part_unless_the_plan_went_on(second_life: Life) -> None:
    visits = second_life.visits
    assert taking_part(visits[:11]) == visits[:9]
    assert taking_part(visits[:12]) == visits[:12]
    assert len(planned_visits(visits)) == 16
    assert (next_segment(()), next_segment(visits)) == (0, 2)


def test_of_hundreds_of_visits_not_each_is_worth_an_estimate() -> None:
    life = live(Plan(positions=55, dwell_s=0.04, settle_s=0.0))
    visits = [estimate.visits for estimate in life.of(Estimate)]
    assert visits == [*range(3, 100), *range(100, 111, 2)]
