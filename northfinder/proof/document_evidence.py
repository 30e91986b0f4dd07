"""What runs have shown: figures as JSON, and tests as pytest's junit XML tells of them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree as ET

from northfinder.proof.figure import Figure

Outcome = Literal["passed", "failed", "skipped"]
Figures = Mapping[str, Sequence[Figure]]


@dataclass(frozen=True, slots=True)
class TestResult:
    """One test, with its parameters.

    Attributes:
        node_id: As pytest takes it: ``tests/test_x.py::test_y[1]``.
        outcome: An error in a fixture is a failure.
        measured: What it recorded under that name.
    """

    __test__ = False  # pytest: this is none

    node_id: str
    outcome: Outcome
    measured: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Evidence:
    """All that was run: figures by their measurement, and tests."""

    figures: Figures = field(default_factory=dict)
    tests: Sequence[TestResult] = ()


def write_figures(path: Path, figures: Figures) -> None:
    """Write a list of figures as JSON, each with its measurement and whether it is met."""
    rows = [_row(measurement, each) for measurement, some in figures.items() for each in some]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def read_figures(path: Path) -> dict[str, list[Figure]]:
    """Return the figures of a file by their measurement.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is not what ``write_figures`` writes.
    """
    figures: dict[str, list[Figure]] = {}
    try:
        for row in json.loads(path.read_text(encoding="utf-8")):
            values = (row[key] for key in ("name", "value", "unit", "least", "most", "limit"))
            figures.setdefault(row["measurement"], []).append(Figure(*values))
    except (KeyError, TypeError, ValueError) as error:
        msg = f"{path} holds no figures ({error!r}); northfinder bench --json writes such a file"
        raise ValueError(msg) from error
    return figures


def read_tests(path: Path) -> list[TestResult]:
    """Return the tests of a junit file, written with junit_family xunit1.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is no such XML.
    """
    try:
        # The file is that of our own run of pytest.
        root = ET.parse(path).getroot()  # noqa: S314
    except ET.ParseError as error:
        msg = f"{path} is no XML ({error}); pytest --junitxml writes such a file"
        raise ValueError(msg) from error
    return [_result(case) for case in root.iter("testcase")]


def _row(measurement: str, figure: Figure) -> dict[str, object]:
    return {
        "measurement": measurement,
        "name": figure.name,
        "value": figure.value,
        "unit": figure.unit,
        "least": figure.least,
        "most": figure.most,
        "limit": figure.limit,
        "met": figure.met,
    }


def _result(case: ET.Element) -> TestResult:
    # The module that pytest collected, not the file (a test may be imported from another); one
    # that cannot even be imported stands under its own name.
    module = case.get("classname") or case.get("name") or ""
    file = f"{module.replace('.', '/')}.py"
    recorded = case.iter("property")
    measured = tuple(each.get("value", "") for each in recorded if each.get("name") == "measured")
    return TestResult(f"{file}::{case.get('name')}", _outcome(case), measured)


def _outcome(case: ET.Element) -> Outcome:
    if case.find("failure") is not None or case.find("error") is not None:
        return "failed"
    return "passed" if case.find("skipped") is None else "skipped"
