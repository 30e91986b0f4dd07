"""Writes ``docs/proof.md`` from what runs have shown.

``python -m northfinder.proof.document --bench FILE... --tests FILE... --machine``; ends with 1
where a promise is not kept, or with ``--require`` where one was not measured either.
"""

import argparse
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import psutil

from northfinder.proof.document_evidence import Evidence, TestResult, read_figures, read_tests
from northfinder.proof.document_page import page
from northfinder.proof.document_verdicts import judge
from northfinder.proof.figure import Figure
from northfinder.proof.promises import Section, named_tests, read_promises
from northfinder.software import description

_T = TypeVar("_T")


def main(arguments: Sequence[str] | None = None) -> None:
    """Merge files of figures and of tests into the page; a file that is absent is told."""
    parser = _parser()
    asked = parser.parse_args(arguments)
    sections = read_promises()
    if asked.named_tests:
        sys.stdout.write("".join(f"{name}\n" for name in named_tests(sections)))
        return
    try:
        evidence = Evidence(_figures_of(asked.bench), _tests_of(asked.tests))
        circumstances = " ".join(_circumstances(of_this_machine=asked.machine))
        asked.output.write_text(page(sections, evidence, circumstances), encoding="utf-8")
    except (OSError, ValueError) as error:
        parser.error(str(error))
    broken = {"NOT MET", "not measured"} if asked.require else {"NOT MET"}
    sys.exit(int(_tell(sections, evidence, broken)))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m northfinder.proof.document", description=__doc__
    )
    files: dict[str, Any] = {"nargs": "*", "type": Path, "default": [], "metavar": "FILE"}
    parser.add_argument("--bench", **files, help="figures, as northfinder bench --json writes them")
    parser.add_argument("--tests", **files, help="tests, as pytest --junitxml writes them")
    parser.add_argument("--machine", action="store_true", help="they were measured on this one")
    parser.add_argument("--require", action="store_true", help="1 also where not all was measured")
    parser.add_argument("--output", type=Path, default=Path("docs/proof.md"), metavar="FILE")
    parser.add_argument("--named-tests", action="store_true", help="print which tests rows name")
    return parser


def _figures_of(paths: Sequence[Path]) -> dict[str, list[Figure]]:
    figures: dict[str, list[Figure]] = {}
    for found in _those_there(read_figures, paths):
        figures |= found
    return figures


def _tests_of(paths: Sequence[Path]) -> list[TestResult]:
    return [test for tests in _those_there(read_tests, paths) for test in tests]


def _those_there(read: Callable[[Path], _T], paths: Sequence[Path]) -> Iterator[_T]:
    """Read those files that exist: a step that failed has written none, and its rows say so."""
    for path in paths:
        if path.exists():
            yield read(path)
        else:
            sys.stderr.write(f"{path} is absent: what it would show counts as not measured\n")


def _tell(sections: Sequence[Section], evidence: Evidence, broken: set[str]) -> bool:
    """Print the promises that are not kept; returns whether there is one."""
    verdicts = [(p.words, judge(p, evidence)) for section in sections for p in section.promises]
    missed = [(words, verdict) for words, verdict in verdicts if verdict.state in broken]
    for words, verdict in missed:
        sys.stdout.write(f"{verdict.state}: {words}: {verdict.words or 'no run shows it'}\n")
    return bool(missed)


def _circumstances(*, of_this_machine: bool) -> Iterator[str]:
    software, commit = description(), _commit()
    version = f"northfinder {software['version']}{f' ({commit})' if commit else ''}"
    yield f"Written on {datetime.now(UTC):%Y-%m-%d} by {version}."
    if of_this_machine:
        memory_gb = psutil.virtual_memory().total / 1e9
        yield (
            f"Measured on {psutil.cpu_count()} cores ({platform.machine()}, {memory_gb:.0f} GB of"
            f" memory, {platform.system()}), Python {software['python']},"
            f" NumPy {software['numpy']}."
        )


def _commit() -> str:
    """Return which commit of the checkout this is, and whether it was changed; else nothing."""
    checkout = Path(__file__).parents[2]
    if not (checkout / ".git").exists():
        return ""  # installed from a wheel: the version says what can be said
    command = ["git", "-C", str(checkout), "describe", "--always", "--dirty"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    except (OSError, subprocess.CalledProcessError):
        return ""  # without git
    return done.stdout.strip()


if __name__ == "__main__":
    main()
