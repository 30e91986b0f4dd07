"""Every command as a technician meets it: words, exit codes, and errors in one line."""

import json
from importlib import import_module
from pathlib import Path

import pytest
from pyarrow import parquet

from tests.cli.conftest import SHORT, Northfinder


def run_id_of(northfinder: Northfinder, *options: str) -> str:
    return str(json.loads(northfinder("seek", *SHORT, "--json", *options).out)["run_id"])


def test_a_result_begins_with_north_and_has_the_digits_it_deserves(
    northfinder: Northfinder,
) -> None:
    lines = northfinder("seek", *SHORT).out.splitlines()
    assert lines[0] == "Azimuth 47.90 ± 0.78 deg (2 sigma), of the table's index mark"
    assert lines[1] == "95 % interval 46.90 to 48.90 deg, clockwise from true north"
    assert lines[2] == "All 12 checks passed"
    assert all(len(line) <= 80 for line in lines)


def test_the_result_shows_solutions_fit_budget_checks_and_where_it_is_kept(
    northfinder: Northfinder,
) -> None:
    out = northfinder("seek", *SHORT).out
    for heading in ("solution", "fit and tilt", "uncertainty from", "check"):
        assert f"\n{heading} " in out
    assert out.splitlines()[-1].startswith("run ")


def test_north_at_the_wrap_is_written_within_the_circle(northfinder: Northfinder) -> None:
    lines = northfinder("seek", *SHORT, "--sim-azimuth", "0").out.splitlines()
    low, high = float(lines[1].split()[3]), float(lines[1].split()[5])
    assert low > 350.0
    assert high < 10.0


def test_a_reference_line_is_shown_beside_the_index_mark(
    northfinder: Northfinder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NORTHFINDER_SITE__REFERENCE_OFFSET_DEG", "10")
    lines = northfinder("seek", *SHORT).out.splitlines()
    assert lines[1] == "Azimuth 57.90 ± 0.78 deg (2 sigma), of the reference line"


def test_a_plan_says_what_it_takes_and_moves_and_records_nothing(
    northfinder: Northfinder, data_home: Path
) -> None:
    out = northfinder("plan").out
    assert out.startswith("Takes 2 min 48 s\nPredicted uncertainty ± 0.077 deg (2 sigma)\n")
    assert "24 angles, 5 s at each in all, order out-and-back" in out
    assert not data_home.exists()


def test_a_plan_warns(northfinder: Northfinder) -> None:
    out = northfinder("plan", "--latitude", "85", "--order", "sequential").out
    assert out.count("warning: ") == 2


def test_the_records_lie_in_the_users_data_folder(
    northfinder: Northfinder, data_home: Path
) -> None:
    run_id_of(northfinder)
    assert (data_home / "northfinder" / "northfinder.db").is_file()


def test_the_database_option_wins_over_the_environment(
    northfinder: Northfinder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NORTHFINDER_DATABASE__URL", f"sqlite:///{tmp_path / 'environment.db'}")
    by_option = ("--database", f"sqlite:///{tmp_path / 'option.db'}")
    run_id_of(northfinder, *by_option)
    assert not (tmp_path / "environment.db").exists()
    assert len(json.loads(northfinder("runs", "list", "--json", *by_option).out)) == 1
    assert json.loads(northfinder("runs", "list", "--json").out) == []
    assert (tmp_path / "environment.db").exists()


def test_runs_are_found_where_a_rig_toml_keeps_them(
    northfinder: Northfinder, tmp_path: Path
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text('[site]\nname = "Lab 3"\n[database]\nurl = "sqlite:///lab.db"\n')
    run_id = run_id_of(northfinder, "--config", str(rig))
    assert (tmp_path / "lab.db").is_file()
    listed = northfinder("runs", "list", "--config", str(rig)).out
    assert run_id in listed
    assert "Lab 3" in listed


def test_an_empty_record_says_so(northfinder: Northfinder) -> None:
    assert northfinder("runs", "list").out == "nothing has been recorded yet\n"


def test_runs_are_listed_shown_and_recomputed(northfinder: Northfinder) -> None:
    first, second = run_id_of(northfinder), run_id_of(northfinder, "--seed", "2")
    listed = northfinder("runs", "list").out
    assert listed.index(second) < listed.index(first)
    assert "47.90 ± 0.78" in listed
    shown = northfinder("runs", "show", first)
    assert shown.out.startswith("Azimuth 47.90 ± 0.78 deg")
    recorded = json.loads(northfinder("runs", "show", first, "--json").out)
    assert json.loads(northfinder("runs", "recompute", first, "--json").out) == recorded
    recomputed = northfinder("runs", "recompute", first)
    assert recomputed.code == 0
    assert recomputed.out.endswith("identical to the recorded result\n")


def test_what_a_run_left_is_exported_and_certified(
    northfinder: Northfinder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_id = run_id_of(northfinder)
    monkeypatch.chdir(tmp_path)
    for kind in ("csv", "parquet", "visits", "json"):
        assert northfinder("runs", "export", run_id[:10], "--format", kind).code == 0
    assert northfinder("runs", "report", run_id).out == (
        f"written to northfinder-{run_id}-certificate.html\n"
    )
    written = {
        path.name.removeprefix(f"northfinder-{run_id}-"): path for path in tmp_path.iterdir()
    }
    shown = json.loads(northfinder("runs", "show", run_id, "--json").out)
    assert json.loads(written["result.json"].read_text()) == shown
    assert len(written["visits.csv"].read_text().splitlines()) == 1 + len(shown["visits"])
    samples = parquet.read_table(written["samples.parquet"])
    assert samples.num_rows == len(written["samples.csv"].read_text().splitlines()) - 1
    assert run_id in written["certificate.html"].read_text(encoding="utf-8")
    elsewhere = northfinder("runs", "export", run_id, "--output", str(tmp_path / "no" / "x.csv"))
    assert (elsewhere.code, "No such file or directory" in elsewhere.err) == (1, True)


def test_a_completed_run_is_not_resumed(northfinder: Northfinder) -> None:
    answer = northfinder("runs", "resume", run_id_of(northfinder))
    assert (answer.code, answer.out) == (1, "")
    assert "completed" in answer.err


def test_a_failed_run_exits_with_1_and_is_shown_with_its_reason(
    northfinder: Northfinder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A table whose moves miss by a degree, so that the driver does not believe them."""
    monkeypatch.setenv("NORTHFINDER_TURNTABLE__ANGLE_SIGMA_DEG", "1")
    failed = northfinder("seek", *SHORT)
    assert (failed.code, failed.out, len(failed.err.splitlines())) == (1, "", 1)
    (listed,) = json.loads(northfinder("runs", "list", "--json").out)
    assert listed["state"] == "failed"
    assert f"northfinder: {listed['error']}\n" == failed.err
    shown = northfinder("runs", "show", listed["run_id"]).out
    assert shown.startswith(f"run {listed['run_id']} is failed, ")
    assert listed["error"] in shown


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        ("seek --bogus", 2, "No such option '--bogus'. See northfinder seek --help."),
        ("seek --dwel 3", 2, "Did you mean"),
        ("seek --positions many", 2, "'many' is not a valid integer"),
        ("seek --positions 2", 2, "plan: positions = 2: should be greater than or equal to 3"),
        ("seek --dwell nan", 2, "plan: dwell_s = nan: should be a finite number"),
        ("seek --dwell inf", 2, "plan: dwell_s = inf"),
        ("seek --dwell 0.001", 2, "lengthen the dwell"),
        ("seek --order backwards", 2, "'backwards' is not one of"),
        ("seek --latitude 91", 2, "latitude_deg = 91.0: should be less than or equal to 90"),
        ("seek --latitude 89.5", 2, "no horizontal part to find north by"),
        ("seek --latitude nan", 2, "latitude_deg = nan"),
        ("seek --sim-speed 0", 2, "speed = 0.0: should be greater than 0"),
        ("seek --target-sigma 1e-9", 2, "cannot be reached"),
        ("seek --config absent.toml", 2, "absent.toml cannot be read: No such file"),
        ("seek --database nowhere", 2, "is no database URL; write sqlite:///FILE"),
        ("seek --database sqlite:///:memory:", 2, "would lose every run"),
        ("runs show nothing", 1, "there is no run 'nothing': nothing has been recorded yet"),
        ("runs recompute", 2, "Missing argument 'RUN_ID'. See northfinder runs recompute --help."),
        ("plan --sim-gyro-noise -1", 2, "gyro_noise_deg_sqrt_h = -1.0: should be greater than"),
        ("sim --sim-speed inf", 2, "could follow an infinite simulation speed"),
        ("nonsense", 2, "No such command 'nonsense'"),
    ],
)
def test_a_mistake_is_one_line_on_stderr(
    arguments: str, code: int, sentence: str, northfinder: Northfinder
) -> None:
    answer = northfinder(*arguments.split())
    assert (answer.code, answer.out) == (code, "")
    assert sentence in answer.err
    (line,) = answer.err.splitlines()
    assert line.startswith("northfinder: ")


def test_hardware_that_is_absent_fails_with_the_port(
    northfinder: Northfinder, tmp_path: Path
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text('[site]\nlatitude_deg = 40\n[gyro]\nlink = "/dev/ttyABSENT7"\n')
    answer = northfinder("seek", "--config", str(rig))
    assert (answer.code, len(answer.err.splitlines())) == (1, 1)
    assert "/dev/ttyABSENT7: there is no such port" in answer.err


def test_nothing_simulated_is_nothing_to_serve(northfinder: Northfinder, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    links = {"turntable": "COM1", "gyro": "COM2", "accelerometer": "COM3"}
    sections = "".join(f'[{role}]\nlink = "{link}"\n' for role, link in links.items())
    rig.write_text(f"[site]\nlatitude_deg = 40\n{sections}")
    answer = northfinder("sim", "--config", str(rig))
    assert (answer.code, "nothing to serve" in answer.err) == (2, True)


def test_a_defect_is_a_sentence_too(
    northfinder: Northfinder, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_: object) -> None:
        msg = "the moon is in the way"
        raise RuntimeError(msg)

    monkeypatch.setattr(import_module("northfinder.cli.carrying_out"), "build_rig", broken)
    answer = northfinder("seek")
    assert answer.code == 1
    assert "a defect of northfinder, please report it: RuntimeError: the moon" in answer.err


@pytest.mark.parametrize("command", ["", "seek", "plan", "sim", "runs", "runs list", "bench"])
def test_every_command_explains_itself(command: str, northfinder: Northfinder) -> None:
    answer = northfinder(*command.split(), "--help")
    assert answer.code == 0
    assert f"Usage: northfinder {command}" in answer.out
    assert all(len(line) <= 80 for line in answer.out.splitlines())
