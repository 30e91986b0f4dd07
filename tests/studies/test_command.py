"""``northfinder study`` as a reader of the papers meets it."""

import json
from pathlib import Path

import pytest

from northfinder.studies.registry import NAMES
from tests.cli.conftest import Northfinder, data_home, northfinder

__all__ = ["data_home", "northfinder"]


def test_a_study_shows_every_claim_with_both_figures_and_the_reason(
    northfinder: Northfinder,
) -> None:
    answer = northfinder("study", "coning-rk4")
    assert (answer.code, answer.err) == (0, "")
    words = " ".join(answer.out.split())
    for said in ("Wang, Dong 2016", "825 times", "6.67 deg", "misprint", "reproduced"):
        assert said in words
    assert "to the letter a third of every turn is." in words
    assert all(len(line) <= 80 for line in answer.out.splitlines())


def test_json_is_one_object_and_nothing_else(northfinder: Northfinder) -> None:
    answer = northfinder("study", "coning-rk4", "--json")
    assert (answer.code, answer.err) == (0, "")
    found = json.loads(answer.out)
    assert (found["kind"], found["name"]) == ("study", "coning-rk4")
    assert len(answer.out.splitlines()) == 1


def test_figures_are_written_with_the_page(northfinder: Northfinder, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "figures"
    answer = northfinder("study", "coning-rk4", "--figures", str(folder))
    assert answer.code == 0
    written = {path.name for path in folder.iterdir()}
    assert written == {
        "coning-rk4.html",
        "coning-rk4-increments.svg",
        "coning-rk4-rates.svg",
        "coning-rk4-noise.svg",
    }
    assert all(f"wrote {folder / name}" in answer.out for name in written)


def test_figures_beside_json_leave_stdout_to_json(northfinder: Northfinder, tmp_path: Path) -> None:
    answer = northfinder("study", "coning-rk4", "--json", "--figures", str(tmp_path))
    assert json.loads(answer.out)["name"] == "coning-rk4"
    assert (tmp_path / "coning-rk4.html").exists()


@pytest.mark.parametrize("arguments", [["tilting"], ["Levelling"], []])
def test_an_unknown_study_is_one_line_that_names_them_all(
    northfinder: Northfinder, arguments: list[str]
) -> None:
    answer = northfinder("study", *arguments)
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert all(name in answer.err for name in NAMES)


def test_a_folder_that_is_a_file_is_refused(northfinder: Northfinder, tmp_path: Path) -> None:
    file = tmp_path / "taken"
    file.touch()
    answer = northfinder("study", "coning-rk4", "--figures", str(file))
    assert (answer.code, answer.out) == (2, "")
    assert "taken" in answer.err


def test_the_command_explains_itself(northfinder: Northfinder) -> None:
    answer = northfinder("study", "--help")
    assert answer.code == 0
    assert "Usage: northfinder study" in answer.out
    assert all(name in answer.out for name in NAMES)
    assert all(len(line) <= 80 for line in answer.out.splitlines())
