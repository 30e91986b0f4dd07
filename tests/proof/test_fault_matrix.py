"""The short form of the fault matrix: every fault once, and what is made of the outcomes."""

import math
from pathlib import Path

import pytest
from rich.console import Console

from northfinder.proof.fault_cells import MOMENTS, Moment, Outcome
from northfinder.proof.fault_kinds import FAULTS
from northfinder.proof.fault_matrix import Place, carry_out, cells, figures, measure, stands
from northfinder.proof.fault_report import markdown, print_matrix
from northfinder.proof.fault_words import word_of

#: When a fault tells most; of all others amid the dwell.
TELLING: dict[str, Moment] = {"turntable": "moving", "table": "moving", "bus": "moving"}


def places() -> list[Place]:
    return [
        (fault.name, rig, TELLING.get(fault.name.split()[0].rstrip(":"), "dwelling"), 1)
        for fault in FAULTS
        for rig in fault.rigs
    ]


@pytest.mark.slow
@pytest.mark.parametrize("place", places(), ids=lambda place: "-".join(map(str, place)))
def test_every_fault_is_harmless_or_told_and_the_table_stands(place: Place) -> None:
    outcome = carry_out(place)
    assert outcome.verdict in ("harmless", "told"), outcome
    assert stands(place[0], outcome), outcome
    assert outcome.lost == 0
    if outcome.verdict == "told":
        assert outcome.said


def test_the_matrix_has_every_kind_of_fault_at_every_moment_on_both_rigs() -> None:
    names = " ".join(fault.name for fault in FAULTS)
    for word in (
        *("dropped", "corrupted", "duplicated", "delayed", "silent", "unplugged"),
        *("stalls", "slips", "overshoots", "frozen", "spikes", "saturated", "drifts"),
        *("tilted", "footstep", "temperature", "latitude", "full disk", "locked database"),
    ):
        assert word in names
    everything = cells(seeds=5)
    assert len(set(everything)) == len(everything) >= 22 * 5 * 2 * 5
    assert {moment for _, _, moment, _ in everything} == set(MOMENTS)


def test_equal_cells_have_equal_outcomes() -> None:
    place: Place = ("gyro: dropped bytes", "serial", "moving", 3)
    assert carry_out(place) == carry_out(place)


def test_a_stroke_acts_at_its_moment_and_not_before() -> None:
    """A silent gyro is told a second after the stroke, whenever that is; never while solving."""
    for moment in ("moving", "settling", "dwelling"):
        outcome = carry_out(("gyro: silent", "serial", moment, 1))
        assert (outcome.verdict, outcome.kept) == ("told", 3)
        assert 0.9 < outcome.noticed_s < 1.6
    assert carry_out(("gyro: silent", "serial", "homing", 1)).kept == 0
    outcome = carry_out(("gyro: silent", "serial", "solving", 1))
    assert (outcome.verdict, outcome.kept, outcome.checks) == ("harmless", 12, ())


HARMLESS = Outcome("harmless", sigmas=1.0, stood_after_s=0.0, kept=12)
REMARKED = Outcome("harmless", "Lost.", ("lost samples warns",), 1.0, 0.0, 12)
CHECKED = Outcome("told", "Drift.", ("drift fails",), 9.0, 0.0, 12)
STOPPED = Outcome("told", "The gyro is silent.", stood_after_s=0.3, kept=3, noticed_s=1.04)
SILENT = Outcome("silent", "", (), 5.2, 0.0, 12)
DEFECT = Outcome("defect", "KeyError: 'x'")


@pytest.mark.parametrize(
    ("group", "word"),
    [
        ([HARMLESS], "·"),
        ([HARMLESS, REMARKED], "○ lost samples warns"),
        ([REMARKED, CHECKED], "▲ drift fails"),
        ([CHECKED, STOPPED], "■ 1.0 s"),
        ([STOPPED, SILENT, SILENT], "✗ 5.2 sigma, 2 times"),
        ([SILENT, DEFECT], "‼ KeyError: 'x'"),
        ([], ""),
    ],
)
def test_a_cell_shows_the_gravest_of_its_seeds(group: list[Outcome], word: str) -> None:
    assert word_of(group) == word


def test_the_figures_count_what_is_silent_unmeant_running_or_lost() -> None:
    sound = {("gyro frozen", "serial", "moving"): [HARMLESS, REMARKED, CHECKED, STOPPED]}
    assert all(figure.met for figure in figures(sound))  # type: ignore[arg-type]
    running = Outcome("told", "Late.", stood_after_s=3.0)
    lossy = Outcome("harmless", stood_after_s=0.0, lost=1)
    spoiled = {("gyro frozen", "serial", "moving"): [SILENT, DEFECT, running, lossy]}
    silent, known, stood, lost = figures(spoiled)  # type: ignore[arg-type]
    assert (silent.value, known.value, stood.value, lost.value) == (1.0, 50.0, 50.0, 1.0)
    assert not any(figure.met for figure in (silent, known, stood, lost))


def test_a_table_out_of_reach_may_end_its_move_and_no_more() -> None:
    assert stands("turntable: silent", Outcome("told", stood_after_s=4.0))
    assert not stands("turntable: silent", Outcome("told", stood_after_s=math.inf))
    assert not stands("table stalls", Outcome("told", stood_after_s=4.0))


def test_the_matrix_is_printed_and_written_with_its_sentences(
    capsys: pytest.CaptureFixture[str],
) -> None:
    matrix = measure([("full disk", "serial", "dwelling", 1)], processes=1)
    print_matrix(Console(width=200), matrix)
    printed, written = capsys.readouterr().out, markdown(matrix)
    for text in (printed, written):
        assert "database or disk is full" in text
        assert "■ 0." in text
        assert "/tmp" not in text  # noqa: S108 -- no place of this computer
    assert "| full disk |" in written


def test_the_document_names_the_command_and_has_room_for_the_tables() -> None:
    document = Path(__file__).parents[2].joinpath("docs", "faults.md").read_text(encoding="utf-8")
    assert "northfinder bench faults" in document
    before, _, measured = document.partition("<!-- measured -->\n")
    assert before
    assert measured.endswith("<!-- end -->\n")
