"""The command line within this process: exit code, stdout, stderr."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from northfinder.cli import main


class Answer(NamedTuple):
    code: int
    out: str
    err: str


Northfinder = Callable[..., Answer]

SHORT = ("--positions", "4", "--dwell", "0.2", "--settle", "0.1")


@pytest.fixture
def data_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data folder of the user's that is this test's own; nothing else is configured."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    for name in ("NORTHFINDER_DATABASE__URL", "NORTHFINDER_SITE__LATITUDE_DEG"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path / "data"


@pytest.fixture
def northfinder(
    data_home: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Northfinder:
    def run(*arguments: str) -> Answer:
        monkeypatch.setattr(sys, "argv", ["northfinder", *arguments])
        code = 0
        try:
            main()
        except SystemExit as leave:
            code = int(leave.code or 0)
        return Answer(code, *capsys.readouterr())

    assert not data_home.exists()
    return run
