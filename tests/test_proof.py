"""The short form of what `make proof` measures."""

import json
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

import pytest
from click.testing import CliRunner

from northfinder.cli.bench import MEASUREMENTS, bench
from northfinder.proof import soak
from northfinder.proof.can_load import can_load
from northfinder.proof.document_evidence import read_figures
from northfinder.proof.figure import Figure
from northfinder.proof.serial_load import serial_load
from northfinder.proof.statistics import cramer_rao, linear_drift, solver_agreement

bench_module = import_module("northfinder.cli.bench")  # in its package the name is the command's


@pytest.mark.parametrize("measure", [cramer_rao, linear_drift, solver_agreement])
def test_the_estimators_keep_what_is_promised(measure: Callable[[], Iterator[Figure]]) -> None:
    for figure in measure():
        assert figure.met, figure


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")
def test_both_sensors_at_full_rate_through_real_ptys_lose_nothing() -> None:
    lost, _processor = serial_load(duration_s=3.0)
    assert lost.met, lost


@pytest.mark.slow
def test_both_can_sensors_at_full_rate_on_one_bus_lose_nothing() -> None:
    lost, _processor = can_load(duration_s=3.0)
    assert lost.met, lost


@pytest.mark.parametrize(
    ("least", "most", "met", "words"),
    [
        (0.98, 1.02, True, "0.98 .. 1.02"),
        (1.01, None, False, "at least 1.01"),
        (None, 0.99, False, "at most 0.99"),
    ],
)
def test_a_figure_says_whether_its_promise_is_kept(
    least: float | None, most: float | None, words: str, *, met: bool
) -> None:
    figure = Figure("ratio", 1.0, "", least, most)
    assert (figure.met, figure.required) == (met, words)


def test_a_promise_that_is_not_kept_ends_the_command_with_1(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def unkept() -> Iterator[Figure]:
        yield Figure("decoding", 3.0, "frames/s", 1e6, None)

    monkeypatch.setitem(MEASUREMENTS, "kvh-decoding", unkept)
    done = CliRunner().invoke(bench, ["kvh-decoding", "--require"])
    assert done.exit_code == 1
    assert "NOT MET" in done.output
    assert CliRunner().invoke(bench, ["kvh-decoding"]).exit_code == 0


def test_figures_are_written_to_a_file_though_one_measurement_failed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def measured() -> Iterator[Figure]:
        yield Figure("decoding", 2e6, "frames/s", 1e6, None)

    def broken() -> Iterator[Figure]:
        yield Figure("load", 0.0, "samples", None, 0.0)
        msg = "the rig is not ready"
        raise RuntimeError(msg)

    monkeypatch.setattr(bench_module, "MEASUREMENTS", {"broken": broken, "decoding": measured})
    file = tmp_path / "new" / "bench.json"
    done = CliRunner().invoke(bench, ["--json", str(file)])
    assert done.exit_code == 1
    assert "broken came to no figure: the rig is not ready" in done.output
    assert "2 000 000 frames/s" in done.output
    assert json.loads(file.read_text()) == [
        {
            "measurement": "decoding",
            "name": "decoding",
            "value": 2e6,
            "unit": "frames/s",
            "least": 1e6,
            "most": None,
            "limit": "",
            "met": True,
        }
    ]


def test_a_soaks_figures_are_written_to_a_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file, lost = tmp_path / "soak.json", Figure("soak: lost", 1.0, "samples", None, 0.0)
    monkeypatch.setattr(soak, "soak", lambda _duration_s: iter([lost]))
    monkeypatch.setattr(sys, "argv", ["soak", "--minutes", "2", "--json", str(file)])
    with pytest.raises(SystemExit) as ended:
        soak.main()
    assert ended.value.code == 1
    assert read_figures(file) == {"soak": [lost]}
