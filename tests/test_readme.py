"""The README shows what its reader will see."""

import subprocess
import sys
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"


def test_the_pasted_output_is_that_of_a_run(tmp_path: Path) -> None:
    """Equal seeds give equal results, so the default run prints the same for everybody."""
    command = [sys.executable, "-m", "northfinder", "seek"]
    database = f"sqlite:///{(tmp_path / 'records.db').as_posix()}"
    done = subprocess.run(
        [*command, "--database", database], capture_output=True, text=True, check=True
    )
    printed = [line.rstrip() for line in done.stdout.splitlines()]
    pasted = README.read_text(encoding="utf-8").split("$ northfinder seek\n")[1].split("\n[...]")[0]
    assert printed[: len(pasted.splitlines())] == pasted.splitlines()
