"""`docs/proof.md` says what runs have shown, and names what shows it as it is."""

import ast
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from northfinder.cli.bench import MEASUREMENTS
from northfinder.proof.document import main
from northfinder.proof.document_evidence import (
    Evidence,
    TestResult,
    read_figures,
    read_tests,
    write_figures,
)
from northfinder.proof.document_page import cell, page
from northfinder.proof.document_verdicts import judge, together
from northfinder.proof.figure import Figure, readable
from northfinder.proof.promises import (
    COMMANDS,
    Promise,
    Section,
    Source,
    named_tests,
    read_promises,
)

ROOT = Path(__file__).parents[2]
SECTIONS = read_promises()
SOURCES = {source for section in SECTIONS for row in section.promises for source in row.shown_by}

SPEED = Figure("decoding: speed", 3812345.6, "frames/s", 1e6, None, "the wire: 1 280")
SLOW = Figure("decoding: speed", 3.0, "frames/s", 1e6, None)
LOST = Figure("decoding: lost", 0.0, "frames", None, 0.0)


def promise(*shown_by: str, of: tuple[str, ...] = ()) -> Promise:
    return Promise("it is so", tuple(map(Source, shown_by)), of)


def told(shown: Promise, figures: Sequence[Figure] = (), tests: Sequence[TestResult] = ()) -> str:
    """The cell, where `figures` are what `bench decode` measured."""
    return cell(judge(shown, Evidence({"decode": figures}, tests)))


@pytest.mark.parametrize("source", sorted(SOURCES, key=str), ids=lambda source: source.name)
def test_whatever_shows_a_promise_exists(source: Source) -> None:
    if source.is_bench:
        assert source.measurement in MEASUREMENTS
    elif not source.is_test:
        target = COMMANDS[source.name].removeprefix("make ")
        assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
    else:
        file, _, function = source.name.partition("::")
        assert (ROOT / file).exists()
        assert not function or function in functions_of(ROOT / file)


def functions_of(file: Path) -> set[str]:
    body = ast.parse(file.read_text(encoding="utf-8")).body
    return {each.name for each in body if isinstance(each, ast.FunctionDef)}


def test_the_page_has_every_promise_and_what_shows_it() -> None:
    """Else the page is another table's: `python -m northfinder.proof.document` writes it anew."""
    written = (ROOT / "docs" / "proof.md").read_text(encoding="utf-8")
    assert unmeasured(written) == unmeasured(page(SECTIONS, Evidence(), ""))


def unmeasured(text: str) -> list[str]:
    """The page without what depends on its runs."""
    promised = text.partition("## Every figure")[0]
    lines = [line for line in promised.splitlines() if line]
    rows = [re.sub(r"^(\| .* \|) .* (\| .* \|)$", r"\1 \2", line) for line in lines]
    return [line for line in rows if not re.match(r"Written on |\d+ promises: ", line)]


def test_a_measured_figure_stands_in_its_row() -> None:
    assert told(promise("bench decode"), [SPEED]) == "3 812 346 frames/s"
    assert told(promise("bench decode"), [LOST]) == "0 frames"


def test_a_figure_below_what_is_promised_is_called_so() -> None:
    words = "**NOT MET**: 3 frames/s where at least 1 000 000 is promised"
    assert told(promise("bench decode"), [SLOW]) == words


def test_a_row_that_nothing_was_run_for_says_so() -> None:
    assert told(promise("bench encode"), [SPEED]) == "not measured"
    assert told(promise("tests/test_x.py")) == "not measured"
    skipped = TestResult("tests/test_x.py::test_y", "skipped")
    assert told(promise("tests/test_x.py"), tests=[skipped]) == "not measured"


def test_a_row_is_met_where_all_that_shows_it_was_run() -> None:
    both = promise("bench decode", "tests/test_x.py")
    passed = TestResult("tests/test_x.py::test_y[1]", "passed", ("40 of 40",))
    assert told(both, [SPEED]) == "3 812 346 frames/s; `tests/test_x.py`: not measured"
    assert judge(both, Evidence({"decode": [SPEED]})).state == "not measured"
    assert told(both, [SPEED], [passed]) == "3 812 346 frames/s; 40 of 40"
    assert judge(both, Evidence({"decode": [SPEED]}, [passed])).state == "met"


def test_a_test_without_a_number_passes_and_one_that_failed_is_named() -> None:
    passed, failed = (TestResult(f"tests/test_x.py::test_y[{o}]", o) for o in ("passed", "failed"))
    shown = promise("tests/test_x.py::test_y")
    assert told(shown, tests=[passed]) == "pass"
    words = "**NOT MET**: `tests/test_x.py::test_y[failed]` failed"
    assert told(shown, tests=[passed, failed]) == words


@pytest.mark.parametrize(
    ("name", "covers"),
    [
        ("tests/can/test_x.py::test_y", True),
        ("tests/can/test_x.py", True),
        ("tests/can", True),
        ("tests/can/test_x.py::test_", False),
        ("tests/can/test", False),
        ("tests/ca", False),
    ],
)
def test_a_test_belongs_to_its_function_file_and_folder(name: str, *, covers: bool) -> None:
    assert Source(name).covers("tests/can/test_x.py::test_y[a::b/c]") is covers


def test_figures_that_end_alike_are_told_as_a_range_and_others_by_name() -> None:
    shown = promise("bench decode")
    mixes = [Figure(f"{n}: over the bound", v, "", None, 1.05) for n, v in (("a", 1.0), ("b", 1.2))]
    assert told(shown, [SPEED, LOST]) == "speed: 3 812 346 frames/s; lost: 0 frames"
    assert told(shown, mixes) == "**NOT MET**: 1 .. 1.2 where at most 1.05 is promised"
    noises = [Figure(f"interval holds, noise {n}", 95.0, "%", 94.0, 96.0) for n in ("on", "off")]
    assert told(shown, noises) == "on: 95 %; off: 95 %"


def test_a_row_takes_of_many_figures_and_tests_those_that_it_asks_for() -> None:
    tests = [TestResult(f"tests/test_x.py::test_y[{n}]", "passed", (f"{n}: 1",)) for n in "ab"]
    assert told(promise("bench decode", of=("lost",)), [SPEED, LOST]) == "0 frames"
    assert told(promise("tests/test_x.py", of=("b:",)), tests=tests) == "b: 1"
    assert told(promise("bench decode", of=("found",)), [SPEED, LOST]) == "not measured"
    some = promise("bench decode", of=("lost", "found"))
    assert told(some, [SPEED, LOST]) == "0 frames; found: not measured"
    assert judge(some, Evidence({"decode": [SPEED, LOST]})).state == "not measured"
    either = promise("bench decode", "tests/test_x.py", of=("lost", "b:"))
    assert told(either, [LOST], tests) == "0 frames; b: 1"


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (3812345.6, "3 812 346"),
        (9999.4, "9999"),
        (0.99708, "0.9971"),
        (1.332e-15, "1.332e-15"),
        (0.0, "0"),
        (-0.2083912, "-0.2084"),
        (-28080.4, "-28 080"),
        (126.0, "126"),
    ],
)
def test_numbers_are_readable(value: float, words: str) -> None:
    assert readable(value) == words


def test_what_many_runs_of_a_test_measured_is_a_range() -> None:
    some = ["a: 1.5 s", "a: 0.5 s", "b: 3 s", "a: 1.5 s"]
    assert together(some) == ["a: 1.5 s", "a: 0.5 s", "b: 3 s"]
    many = [f'level {n}e-9", of {m} runs' for n, m in zip((3, 1, 20, 4, 5), [20] * 5, strict=True)]
    assert together(many) == ['level 1e-9 .. 20e-9", of 20 runs (5 values)']


def test_the_page_has_tables_counts_and_every_figure() -> None:
    rows = (promise("bench decode"), promise("soak"), promise("tests/test_x.py"))
    evidence = Evidence({"decode": [SPEED, SLOW], "soak": [LOST]})
    lines = page([Section("Load", "Before.", rows, "After.")], evidence, "Today.").splitlines()
    assert "3 promises: 1 met, 1 NOT MET, 1 not measured." in lines
    begin = lines.index("## Load")
    assert lines[begin + 2 : begin + 6] == [
        "Before.",
        "",
        "| promise | measured | shown by |",
        "|---|---|---|",
    ]
    assert lines[begin + 7 : begin + 11] == [
        "| it is so | 0 frames | `make soak` |",
        "| it is so | not measured | `tests/test_x.py` |",
        "",
        "After.",
    ]
    assert lines[-1] == "| decoding: lost | 0 frames | at most 0 |  | `make soak` |"
    speed = "| at least 1 000 000 | the wire: 1 280 | `northfinder bench decode` |"
    assert lines[-3] == f"| decoding: speed | 3 812 346 frames/s {speed}"
    assert "| **NOT MET**: 3 frames/s |" in lines[-2]


def test_a_bar_in_a_cell_ends_no_cell() -> None:
    bar = Promise("|a|", (Source("soak"),))
    assert "| /a/ | not measured | `make soak` |" in page(
        [Section("", "", (bar,), "")], Evidence(), ""
    )


def test_figures_survive_their_file(tmp_path: Path) -> None:
    figures = {"decode": [SPEED, LOST], "soak": [SLOW]}
    write_figures(tmp_path / "new" / "bench.json", figures)
    assert read_figures(tmp_path / "new" / "bench.json") == figures


def test_a_figure_of_numpy_that_is_not_met_survives_its_file_too(tmp_path: Path) -> None:
    slow = Figure("dask", np.float64(1.4), "times", 1.5, None)
    write_figures(tmp_path / "bench.json", {"campaign-dask": [slow]})
    assert read_figures(tmp_path / "bench.json") == {"campaign-dask": [slow]}
    assert not slow.met


TESTS = """
import pytest
@pytest.mark.parametrize("n", [1, 2])
def test_passes(n, record_property):
    record_property("seed", n)
    record_property("measured", f"{n} <of> 2")
def test_fails(record_property):
    record_property("measured", "0.9")
    assert False
@pytest.mark.skip(reason="not here")
def test_is_skipped(): ...
@pytest.fixture
def broken(): raise OSError
def test_has_no_fixture(broken): ...
"""


def test_tests_are_read_as_pytest_tells_of_them(tmp_path: Path) -> None:
    (tmp_path / "test_some.py").write_text(TESTS)
    (tmp_path / "test_other.py").write_text("import nothing_of_that_name")
    family = ("-o", "junit_family=xunit1", "-p", "no:cacheprovider")
    command = [sys.executable, "-m", "pytest", ".", "--junitxml", "found.xml", *family]
    whole = ["--continue-on-collection-errors"]
    subprocess.run([*command, *whole], cwd=tmp_path, capture_output=True, check=False)
    assert read_tests(tmp_path / "found.xml") == [
        TestResult("test_other.py::test_other", "failed"),
        TestResult("test_some.py::test_passes[1]", "passed", ("1 <of> 2",)),
        TestResult("test_some.py::test_passes[2]", "passed", ("2 <of> 2",)),
        TestResult("test_some.py::test_fails", "failed", ("0.9",)),
        TestResult("test_some.py::test_is_skipped", "skipped"),
        TestResult("test_some.py::test_has_no_fixture", "failed"),
    ]


def document(folder: Path, *arguments: str) -> tuple[int, str]:
    """Carry out the command; return its exit status and the page."""
    output = folder / "proof.md"
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--output", str(output)])
    return int(ended.value.code or 0), output.read_text(encoding="utf-8")


def test_the_command_merges_files_and_ends_with_1_where_a_promise_is_not_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("cramer-rao", "linear-drift")
    files = [str(tmp_path / name) for name in names]
    for name, file in zip(names, files, strict=True):
        write_figures(Path(file), {name: [Figure(name, 0.99, "", 0.98, 1.02)]})
    code, text = document(tmp_path, "--bench", *files, "--machine")
    assert code == 0
    assert "| 0.99 | `northfinder bench cramer-rao` |" in text
    assert "| 0.99 | `northfinder bench linear-drift` |" in text
    assert re.search(r"Written on \d{4}-\d\d-\d\d by northfinder \d", text)
    assert re.search(r"Measured on \d+ cores .* Python 3\.\d+\.\d+", text)
    write_figures(Path(files[0]), {names[0]: [Figure(names[0], 1.1, "", 0.98, 1.02)]})
    code, text = document(tmp_path, "--bench", *files)
    assert code == 1
    assert "| **NOT MET**: 1.1 where 0.98 .. 1.02 is promised |" in text
    assert "Measured on" not in text
    assert re.match(r"NOT MET: scatter of .*: 1\.1 where", capsys.readouterr().out)


def test_what_was_not_measured_breaks_only_a_page_that_must_be_whole(tmp_path: Path) -> None:
    assert document(tmp_path)[0] == 0
    assert document(tmp_path, "--require")[0] == 1


def test_a_file_that_a_failed_step_has_not_written_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _ = document(tmp_path, "--bench", "none.json", "--tests", str(tmp_path / "none.xml"))
    assert code == 0
    assert re.findall(r"none\.\w+ is absent", capsys.readouterr().err) == [
        "none.json is absent",
        "none.xml is absent",
    ]


@pytest.mark.parametrize("text", ["", "[1]", "{", '[{"name": "x"}]', "<testsuites>"])
@pytest.mark.parametrize(("option", "says"), [("--bench", "no figures"), ("--tests", "no XML")])
def test_a_file_that_is_none_is_refused_in_words(
    tmp_path: Path, option: str, says: str, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_text(text)
    with pytest.raises(SystemExit) as ended:
        main([option, str(file), "--output", str(tmp_path / "proof.md")])
    assert ended.value.code == 2
    assert f"{file} " in (said := capsys.readouterr().err)
    assert says in said


def test_a_page_that_cannot_be_written_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--output", str(tmp_path / "absent" / "proof.md")])
    assert ended.value.code == 2
    assert "No such file or directory" in capsys.readouterr().err


def test_the_tests_that_rows_name_are_listed_once(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [
        promise("bench x", "tests/a.py::test_b"),
        promise("tests/a.py", "tests/c"),
        promise("soak"),
    ]
    again = [promise("tests/a.py", "tests/c/d.py::test_e", "tests/f.py")]
    sections = [Section("", "", tuple(some), "") for some in (rows, again)]
    assert named_tests(sections) == ["tests/a.py", "tests/c", "tests/f.py"]
    main(["--named-tests"])
    assert capsys.readouterr().out.splitlines() == named_tests(SECTIONS)
