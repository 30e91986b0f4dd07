"""The program as it is started: a process of its own, a terminal, Ctrl-C, real sockets."""

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from northfinder.records import Records
from tests.cli.conftest import SHORT

PROGRAM = (sys.executable, "-m", "northfinder")


@contextmanager
def started(folder: Path, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A process that is killed at the end, should it still live."""
    with subprocess.Popen(
        [*PROGRAM, *arguments],
        env={**os.environ, "XDG_DATA_HOME": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def finished(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*PROGRAM, *arguments],
        env={**os.environ, "XDG_DATA_HOME": str(folder)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_a_seek_and_its_records_in_processes_of_their_own(tmp_path: Path) -> None:
    seek = finished(tmp_path, "seek", *SHORT, "--json")
    assert (seek.returncode, seek.stderr) == (0, "")
    result = json.loads(seek.stdout)
    listed = finished(tmp_path, "runs", "list")
    assert result["run_id"] in listed.stdout
    again = finished(tmp_path, "runs", "recompute", result["run_id"], "--json")
    assert json.loads(again.stdout) == result


def test_equal_seeds_give_the_same_json_in_two_processes(tmp_path: Path) -> None:
    first, second = (
        json.loads(finished(tmp_path, "seek", *SHORT, "--seed", "3", "--json").stdout)
        for _ in range(2)
    )
    assert first.pop("run_id") != second.pop("run_id")
    assert first == second


def test_a_mistake_exits_with_2_and_no_traceback(tmp_path: Path) -> None:
    plan = finished(tmp_path, "plan", "--latitude", "nan")
    assert (plan.returncode, plan.stdout) == (2, "")
    assert "Traceback" not in plan.stderr


def state_of_the_run(url: str) -> tuple[str, int]:
    with Records.open(url) as store:
        (run,) = store.page(2).runs
        return run.state, len(store.visits(run.id))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
def test_ctrl_c_aborts_the_run_stops_the_table_and_exits_with_130(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'x.db'}"
    options = ("--sim-speed", "5", "--database", url)
    with started(tmp_path, "seek", *SHORT, *options) as process:
        wait_for_a_visit(url)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=10)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert err.strip() == "northfinder: interrupted; a table that was turning is stopped"
    state, visits = state_of_the_run(url)
    assert state == "aborted"
    assert 1 <= visits < 8


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("--host 0.0.0.0", "set NORTHFINDER_TOKEN"),
        ("--sim-speed inf", "could follow an infinite simulation speed"),
        ("--port 99999", "is not in the range 0<=x<=65535"),
        ("--database mysql://x", "use sqlite or postgresql"),
    ],
)
def test_a_service_that_cannot_be_served_says_why(
    arguments: str, says: str, tmp_path: Path
) -> None:
    answer = finished(tmp_path, "serve", "--port", "0", *arguments.split())
    assert (answer.returncode, answer.stdout) == (2, "")
    (line,) = answer.stderr.splitlines()
    assert says in line


def test_a_killed_run_is_carried_on_by_another_process(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'x.db'}"
    with started(tmp_path, "seek", *SHORT, "--sim-speed", "5", "--database", url) as process:
        wait_for_a_visit(url)
        process.kill()
        process.communicate(timeout=10)
    with Records.open(url) as store:
        (run,) = store.page(2).runs
    resumed = finished(tmp_path, "runs", "resume", run.id[:12], "--json", "--database", url)
    result = json.loads(resumed.stdout)
    assert (resumed.returncode, result["run_id"], result["state"]) == (0, run.id, "completed")
    assert len([visit for visit in result["visits"] if visit["repeats"] is None]) == 8
    again = finished(tmp_path, "runs", "recompute", run.id, "--json", "--database", url)
    assert json.loads(again.stdout) == result


def wait_for_a_visit(url: str) -> None:
    deadline_s = time.monotonic() + 20.0
    while time.monotonic() < deadline_s:
        with Records.open(url) as store:
            if any(store.visits(run.id) for run in store.page(2).runs):
                return
        time.sleep(0.05)
    pytest.fail("no visit within 20 s")


@pytest.mark.parametrize("columns", [80, 120])
def test_on_a_terminal_north_so_far_is_shown_and_then_gone(columns: int, tmp_path: Path) -> None:
    shown = on_a_terminal(columns, tmp_path, "seek", "--positions", "6", "--dwell", "2")
    assert "north so far: azimuth 47." in shown
    assert "measuring at " in shown
    assert "left" in shown
    assert "━" in shown
    assert "Azimuth 47." in shown


def on_a_terminal(columns: int, folder: Path, *arguments: str) -> str:
    if sys.platform == "win32":
        pytest.skip("Windows has no pseudo-terminals")
    near, far = os.openpty()  # noqa: TID251 - a person's terminal, POSIX only
    environ = {**os.environ, "XDG_DATA_HOME": str(folder), "TERM": "xterm-256color"}
    environ |= {"COLUMNS": str(columns), "LINES": "40"}
    with subprocess.Popen([*PROGRAM, *arguments], env=environ, stdout=far, stderr=far) as process:
        os.close(far)
        shown = b""
        while select.select([near], [], [], 60.0)[0]:
            try:
                shown += os.read(near, 1 << 16)
            except OSError:  # how Linux says that the other end has closed
                break
        os.close(near)
    assert process.returncode == 0
    return shown.decode()


def test_real_drivers_find_north_over_the_sockets_of_the_simulated_instruments(
    tmp_path: Path,
) -> None:
    with started(tmp_path, "sim", "--serial", "tcp") as sim:
        assert sim.stdout is not None
        instruments = [json.loads(sim.stdout.readline()) for _ in range(3)]
        rig = tmp_path / "rig.toml"
        sections = [
            f'[{one["role"]}]\ndriver = "{one["driver"]}"\nlink = "{one["link"]}"\n'
            for one in instruments
        ]
        rig.write_text("[site]\nlatitude_deg = 40\n" + "".join(sections))
        plan = ("--positions", "3", "--dwell", "0.2", "--settle", "0.1", "--order", "sequential")
        seek = finished(tmp_path, "seek", *plan, "--config", str(rig), "--json")
        assert seek.returncode == 0, seek.stderr
        sim.send_signal(signal.SIGINT)
        _, err = sim.communicate(timeout=10)
    assert [one["role"] for one in instruments] == ["turntable", "gyro", "accelerometer"]
    assert {one["link"].partition(":")[0] for one in instruments} == {"socket"}
    result = json.loads(seek.stdout)
    assert result["simulation"] is None
    assert sum(visit["lost"] for visit in result["visits"]) == 0
    assert abs(result["azimuth_deg"] - 48.0) < 5 * result["azimuth_sigma_deg"]
    assert sim.returncode == 130
    assert "Traceback" not in err
