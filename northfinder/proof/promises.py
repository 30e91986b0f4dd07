"""What is promised, and which measurements and tests show it: ``promises.toml``, read."""

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Final

#: Measurements beside those of ``northfinder bench``, and what carries them out.
COMMANDS: Final = {"soak": "make soak"}
_BENCH = "bench "


@dataclass(frozen=True, slots=True)
class Source:
    """What shows a promise.

    Attributes:
        name: ``bench NAME``, a key of ``COMMANDS``, or a test's folder, file or node id.
    """

    name: str

    @property
    def measurement(self) -> str:
        """Return the measurement's name; empty for a test."""
        return self.name.removeprefix(_BENCH) if not self.is_test else ""

    @property
    def is_bench(self) -> bool:
        """Say whether ``northfinder bench`` carries it out."""
        return self.name.startswith(_BENCH)

    @property
    def is_test(self) -> bool:
        """Say whether pytest carries it out."""
        return not self.is_bench and self.name not in COMMANDS

    @property
    def words(self) -> str:
        """Return what a reader runs to see it."""
        command = f"northfinder {self.name}" if self.is_bench else COMMANDS.get(self.name)
        return f"`{command or self.name}`"

    def covers(self, node_id: str) -> bool:
        """Say whether a test belongs to this folder, file or node id, whatever its parameters."""
        function = node_id.partition("[")[0]
        return function == self.name or function.startswith((f"{self.name}::", f"{self.name}/"))


@dataclass(frozen=True, slots=True)
class Promise:
    """One row.

    Attributes:
        words: The promise, Markdown.
        shown_by: All of these must hold.
        of: Only figures and tests' words that have one of these in them; all, where empty. Each
            of these must be there.
    """

    words: str
    shown_by: tuple[Source, ...]
    of: tuple[str, ...] = ()

    def asks_for(self, words: str) -> bool:
        """Say whether a figure of this name, or what a test measured, belongs into the row."""
        return not self.of or any(part in words for part in self.of)


@dataclass(frozen=True, slots=True)
class Section:
    """A table with its title, and what is said before and after it."""

    title: str
    before: str
    promises: tuple[Promise, ...]
    after: str


def read_promises() -> list[Section]:
    """Return the sections in the order of ``docs/proof.md``.

    Raises:
        KeyError: A row lacks its promise or what shows it.
    """
    text = files("northfinder.proof").joinpath("promises.toml").read_text(encoding="utf-8")
    return [_section(table) for table in tomllib.loads(text)["section"]]


def named_tests(sections: Sequence[Section]) -> list[str]:
    """Return the tests that rows name, each once, none of them within another."""
    named = [source for source in _sources(sections) if source.is_test]
    whole = [s for s in named if not any(o.name != s.name and o.covers(s.name) for o in named)]
    return list(dict.fromkeys(source.name for source in whole))


def _sources(sections: Sequence[Section]) -> Iterator[Source]:
    for section in sections:
        for promise in section.promises:
            yield from promise.shown_by


def _section(table: dict[str, Any]) -> Section:
    promises = tuple(
        Promise(row["promise"], tuple(map(Source, row["shown_by"])), tuple(row.get("of", ())))
        for row in table["row"]
    )
    return Section(table["title"], table.get("before", ""), promises, table.get("after", ""))
