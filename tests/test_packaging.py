"""The three packages are this checkout's, and a wheel of them works in a fresh environment."""

import json
import os
import shutil
import subprocess
import sys
import venv
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ["northfinder", "drivers", "sim"]


@pytest.mark.parametrize("name", PACKAGES)
def test_imports_come_from_this_checkout(name: str) -> None:
    """`drivers` and `sim` are common names: a stranger's package must not shadow ours."""
    (location,) = import_module(name).__path__
    assert Path(location).parent == ROOT


def run(*command: str | Path, folder: Path) -> str:
    environ = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        env=environ,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_wheel_finds_north_in_a_fresh_environment(tmp_path: Path) -> None:
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path, folder=ROOT)
    (wheel,) = tmp_path.glob("*.whl")
    venv.create(tmp_path / "fresh", with_pip=True)
    bin_folder = tmp_path / "fresh" / ("Scripts" if sys.platform == "win32" else "bin")
    run(bin_folder / "python", "-m", "pip", "install", "--quiet", wheel, folder=tmp_path)
    where = (
        f"import {', '.join(PACKAGES)}; print({', '.join(f'{p}.__path__[0]' for p in PACKAGES)})"
    )
    printed = run(bin_folder / "python", "-c", where, folder=tmp_path)
    assert all(str(tmp_path) in location for location in printed.split())
    database = f"sqlite:///{(tmp_path / 'records.db').as_posix()}"
    seek = (bin_folder / "northfinder", "seek", "--json", "--positions", "4", "--dwell", "0.5")
    result = json.loads(run(*seek, "--database", database, folder=tmp_path))
    assert result["state"] == "completed"
    assert abs(result["azimuth_deg"] - 48.0) < 4 * result["azimuth_sigma_deg"]


@pytest.mark.alone
@pytest.mark.proof
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("editable", [False, True], ids=["wheel", "editable"])
def test_the_tests_pass_in_a_fresh_environment(tmp_path: Path, *, editable: bool) -> None:
    """The tests are copied away from the checkout, so that the packages are the installed ones."""
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path, folder=ROOT)
    (wheel,) = tmp_path.glob("*.whl")
    what = ["--editable", f"{ROOT}[dev]"] if editable else [f"{wheel}[dev]"]
    venv.create(tmp_path / "fresh", with_pip=True)
    python = tmp_path / "fresh" / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    run(python, "-m", "pip", "install", "--quiet", *what, folder=tmp_path)
    for folder in ("tests", "docs", "web"):  # some tests read what the documents and the page say
        shutil.copytree(ROOT / folder, tmp_path / folder)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    left_out = (
        "tests/test_packaging.py",
        "tests/test_readme.py",
        "tests/page",
        "tests/proof/test_document.py",
    )  # need the checkout
    wanted = [f"--ignore={name}" for name in left_out]
    chosen = ("-m", "not proof and not alone and not slow", *wanted)
    at_once = ("--numprocesses", "logical", "--dist", "worksteal")
    printed = run(python, "-m", "pytest", "-q", *at_once, *chosen, folder=tmp_path)
    assert " passed" in printed
