"""The short form of the slow faults' statistic."""

import pytest

from northfinder.proof.slow_faults import KINDS, SIZES, ZONES, slow_faults, slow_run, slow_runs


@pytest.mark.slow
def test_what_creeps_is_harmless_or_told() -> None:
    promised, *between = slow_faults(runs=120, processes=1)
    assert promised.value == 0.0, promised
    assert all(figure.most is None for figure in between)


def test_kinds_and_zones_take_turns_and_sizes_keep_to_their_zone() -> None:
    for place in ((seed, kind, zone) for seed, kind in enumerate(KINDS) for zone in ZONES):
        _, kind, zone = place
        run = slow_run(place)
        assert run.kind == kind
        assert (run.size <= SIZES[kind].harmless) == (zone == "harmless")
    assert [run.kind for run in slow_runs(8, ZONES, processes=1)] == [*KINDS, *KINDS]


def test_visible_faults_are_told() -> None:
    """Of a tilt, all but one so late or so early that nothing is wrong by it."""
    for seed in range(5):
        assert slow_run((seed, "table creeps", "visible")).failed
        assert slow_run((seed, "drift that curves", "visible")).failed


@pytest.mark.slow
def test_harmless_faults_leave_the_stated_sigma_true() -> None:
    """The mean square of 60 errors over their sigma: chi-square, its 1e-4 quantiles."""
    squares = [slow_run((seed, "drift that curves", "harmless")).sigmas ** 2 for seed in range(60)]
    assert 0.42 < sum(squares) / 60 < 1.85
