"""How surely a knock is found between two lives of a run, and an unmoved bench believed."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from northfinder.errors import AcquisitionError
from northfinder.procedures.plan import Plan
from northfinder.procedures.proving import choose_witnesses, require_stillness
from tests.estimators.truth import DEG
from tests.evidence import Record
from tests.procedures.benches import Bench
from tests.procedures.lives import Watch, crash_after, live
from tests.procedures.rigs import config_of
from tests.procedures.test_segments import ANOTHER, knocked

CONFIG = config_of(site={"latitude_deg": 40.0})
PLAN = Plan()
Knock = Callable[[Bench], Bench]


def bench(seed: int, **settings: Any) -> Bench:  # noqa: ANN401 - of Bench
    return Bench(np.random.default_rng(seed), visits=[], **settings)


def still(unmoved: Bench) -> Bench:
    return unmoved


def turned(azimuth_deg: float) -> Knock:
    return lambda before: before.knocked(azimuth_deg=azimuth_deg)


def resumed(before: Bench, knock: Knock = still, plan: Plan = PLAN) -> str:
    """Return what was proved, or the refusal."""
    after = knock(before)
    after.repeat(choose_witnesses(before.visits, plan, CONFIG))
    try:
        return require_stillness(after.visits, after.visits[-1].segment, plan, CONFIG)
    except AcquisitionError as refusal:
        return f"refused: {refusal}"


def refusals(
    runs: int,
    knock: Knock,
    visits: int = 12,
    plan: Plan = PLAN,
    **settings: Any,  # noqa: ANN401 - of Bench
) -> int:
    return sum(
        resumed(bench(seed, **settings).follow(plan, visits), knock, plan).startswith("refused")
        for seed in range(runs)
    )


@pytest.mark.parametrize("visits", [12, 36])
def test_an_unmoved_bench_goes_on_200_times_of_200(visits: int, record_property: Record) -> None:
    """With 0.03 false alarms expected; a new bias of both sensors is none."""

    def next_day(before: Bench) -> Bench:
        return replace(before, bias_deg_h=5.0, force_bias_g=1e-4)

    refused = refusals(200, next_day, visits)
    record_property("measured", f"{refused} of 200 unmoved ones refused")
    assert refused == 0


@pytest.mark.parametrize("visits", [1, 2, 3, 4, 5])
def test_an_unmoved_bench_goes_on_after_few_visits(visits: int) -> None:
    assert refusals(40, still, visits) == 0


@pytest.mark.parametrize("order", ["sequential", "out-and-back", "opposite"])
@pytest.mark.parametrize("turn_deg", [2.0, -2.0, 30.0])
def test_a_turn_after_12_positions_is_refused_20_times_of_20(order: Any, turn_deg: float) -> None:  # noqa: ANN401
    assert refusals(20, turned(turn_deg), plan=Plan(order=order)) == 20


@pytest.mark.parametrize("azimuth_deg", range(0, 360, 60))
def test_after_a_whole_revolution_the_azimuth_does_not_matter(azimuth_deg: int) -> None:
    azimuth_rad = azimuth_deg * DEG
    assert refusals(20, turned(2.0), 24, azimuth_rad=azimuth_rad) == 20


@pytest.mark.parametrize("way_deg", range(0, 360, 60))
@pytest.mark.parametrize("azimuth_deg", [0.0, 48.0])
def test_a_tilt_in_any_direction_is_refused_20_times_of_20(
    way_deg: float, azimuth_deg: float
) -> None:
    def tilted(before: Bench) -> Bench:
        return before.knocked(tilt_deg=0.2, way_deg=way_deg)

    assert refusals(20, tilted, azimuth_rad=azimuth_deg * DEG) == 20


@pytest.mark.parametrize(
    "settings",
    [
        pytest.param({"drift_deg_h_h": 10.0}, id="warming-up"),
        pytest.param({"between_deg_h": 0.1}, id="restless-between-visits"),
        pytest.param({"gyro_noise_deg_sqrt_h": 0.0, "force_noise_g_sqrt_hz": 0.0}, id="noise-free"),
    ],
)
def test_what_a_gyro_does_by_itself_is_no_knock(settings: dict[str, Any]) -> None:
    assert refusals(60, still, 24, **settings) == 0


def test_a_wandering_bias_that_is_stated_is_allowed_for() -> None:
    stated = config_of(site={"latitude_deg": 40.0}, gyro={"bias_instability_deg_h": 0.2})
    before = bench(1).follow(PLAN, 24)
    after = before.knocked(azimuth_deg=2.0)
    after.repeat(choose_witnesses(before.visits, PLAN, CONFIG))
    with pytest.raises(AcquisitionError, match=r"A turn of 0\.75 deg"):
        require_stillness(after.visits, 1, PLAN, CONFIG)
    assert "A turn of 4.2 deg" in require_stillness(after.visits, 1, PLAN, stated)


def test_a_refusal_says_how_far_it_moved_and_what_could_be_seen() -> None:
    refusal = resumed(bench(1).follow(PLAN, 24), turned(20.0))
    assert "the gyro shows a turn of about 20 deg clockwise" in refusal
    assert "A turn of 0.75 deg or a tilt of 0.098 deg would have shown" in refusal
    assert "start a new run" in refusal


@pytest.mark.parametrize(
    ("settings", "visits", "words"),
    [
        ({}, 1, "Measured again at 0 deg: nothing moved. A tilt of 0.023 deg would have shown"),
        ({}, 2, "A tilt of 0.026 deg would have shown, but no turn."),
        ({"order": "opposite"}, 2, "Neither a turn nor a tilt would be sure to have shown."),
        ({"positions": 3}, 2, "but no turn."),
    ],
)
def test_before_north_is_known_a_proof_says_that_it_is_none(
    settings: dict[str, Any], visits: int, words: str
) -> None:
    plan = Plan(**settings)
    assert words in resumed(bench(1).follow(plan, visits), still, plan)


def test_a_noisy_gyro_measures_again_for_longer_and_says_what_it_cannot_see() -> None:
    before = bench(1, gyro_noise_deg_sqrt_h=0.1).follow(PLAN, 24)
    witnesses = choose_witnesses(before.visits, PLAN, CONFIG)
    assert [witness.dwell_s for witness in witnesses] == pytest.approx([7.5, 7.5])
    assert "but no turn" in resumed(before)


def refused_on_rigs(knock: Watch, seeds: Iterable[int]) -> int:
    """Through drivers and bytes: 12 positions of the default plan, then another life."""
    refused = 0
    for seed in seeds:
        first = live(PLAN, watch=crash_after(12), simulation={"seed": seed})
        later = {**ANOTHER, "seed": 1000 + seed}
        refused += (
            "the bench has moved" in live(PLAN, first.visits, knock, simulation=later).refusal
        )
    return refused


@pytest.mark.slow
def test_20_knocks_of_20_are_refused_on_the_default_rig() -> None:
    assert refused_on_rigs(knocked(azimuth_deg=2.0), range(10)) == 10
    assert refused_on_rigs(knocked(pitch_deg=0.2), range(10)) == 10


@pytest.mark.proof
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "knock",
    [
        pytest.param(knocked(azimuth_deg=2.0), id="clockwise"),
        pytest.param(knocked(azimuth_deg=-2.0), id="counter-clockwise"),
        pytest.param(knocked(pitch_deg=0.2), id="tilted"),
    ],
)
def test_20_knocks_of_20_of_each_kind_are_refused_on_the_default_rig(
    knock: Watch, record_property: Record
) -> None:
    refused = refused_on_rigs(knock, range(20))
    record_property("measured", f"{refused} of 20 refused")
    assert refused == 20
