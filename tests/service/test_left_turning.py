"""A table that a killed service left turning is stopped by the next one before anything else."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
import serial

from tests.service.process import JsonObject, serving, wait_until_ready

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")

DRIVERS = {"turntable": "zaber", "gyro": "kvh", "accelerometer": "stim300"}
FAR_MOVES: JsonObject = {"kind": "north-seek", "positions": 3, "order": "sequential"}


@contextmanager
def instruments() -> Iterator[dict[str, str]]:
    """Simulated instruments that live on when the service dies; yields link by role."""
    command = [sys.executable, "-m", "northfinder", "sim", "--serial", "pty"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            announced = [json.loads(process.stdout.readline()) for _ in DRIVERS]
            yield {each["role"]: each["link"] for each in announced}
        finally:
            process.terminate()


def write_config(path: Path, links: dict[str, str]) -> None:
    sections = [f'[{role}]\ndriver = "{DRIVERS[role]}"\nlink = "{links[role]}"' for role in links]
    path.write_text("\n".join(["[site]\nlatitude_deg = 40.0", *sections]), encoding="utf-8")


def ask_table(link: str, command: str) -> str:
    """Ask the table itself (Zaber ASCII protocol, version 3) and return its reply."""
    with serial.Serial(link, 115_200, timeout=1.0) as port:
        port.reset_input_buffer()
        port.write(f"/1 1 {command}\n".encode())
        while not (line := port.readline().decode()).startswith("@"):
            assert line, f"the table does not answer to {command!r}"
        return line


def wait_until_moving(api: httpx.Client) -> None:
    """Wait until the table is on its way, far enough from where it is going to."""
    end_s = time.monotonic() + 30.0
    while True:
        table = api.get("/rig").json()["table"]
        target_deg = table["target_deg"]
        if table["moving"] and abs((target_deg or table["angle_deg"]) - table["angle_deg"]) > 60.0:
            return
        assert time.monotonic() < end_s, table


@pytest.mark.slow
def test_a_table_that_a_killed_service_left_turning_is_stopped_at_the_next_start(
    tmp_path: Path,
) -> None:
    with instruments() as links:
        config = tmp_path / "rig.toml"
        write_config(config, links)
        with serving(tmp_path, "--config", str(config)) as service:
            wait_until_ready(service)
            run_id = service.start(FAR_MOVES)
            wait_until_moving(service.api)
            service.kill()
        assert " BUSY " in ask_table(links["turntable"], ""), "nobody told it to stop"
        # Its last move would be over before a service has started: it gets one without an end.
        ask_table(links["turntable"], "move vel 50000")
        with serving(tmp_path, "--config", str(config)) as service:
            wait_until_ready(service)
            rig = service.api.get("/rig").json()
            assert (rig["state"], rig["table"]["moving"]) == ("ready", False)
            assert service.run(run_id)["state"] == "interrupted"
            still = service.api.get("/rig").json()["table"]["angle_deg"]
            assert still == rig["table"]["angle_deg"]
