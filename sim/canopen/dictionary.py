"""A node's object dictionary, made from its electronic data sheet (CiA 306; CiA 301, 7.4)."""

import contextlib
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from configparser import RawConfigParser
from dataclasses import dataclass

from drivers.codecs.pdo import signed
from drivers.codecs.sdo import Abort, Entry
from drivers.codecs.sdo_server import AccessError

_VISIBLE_STRING = 0x0009
#: Bytes of each kind of number, and whether it has a sign (CiA 301, table 44).
_NUMBERS = {
    0x0001: (1, False),
    0x0002: (1, True),
    0x0003: (2, True),
    0x0004: (4, True),
    0x0005: (1, False),
    0x0006: (2, False),
    0x0007: (4, False),
}
_SECTION = re.compile(r"([0-9A-F]{4})(?:sub([0-9A-F]+))?", re.IGNORECASE)


@dataclass(slots=True)
class Variable:
    """One entry of the dictionary: what its data sheet says, its value, and what it does.

    ``size`` is in bytes; 0 marks text, which stands in ``text`` and can only be read.
    """

    size: int
    signed: bool
    access: str
    mappable: bool
    lowest: int
    highest: int
    default: int
    text: bytes = b""
    number: int = 0
    compute: Callable[[], int] | None = None
    act: Callable[[int], None] | None = None

    @property
    def readable(self) -> bool:
        """Return whether a client may read it."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Return whether a client may write it."""
        return self.access in {"rw", "wo"}

    def encode(self) -> bytes:
        """Return the value as it goes over the wire; a counter too large for it wraps."""
        if not self.size:
            return self.text
        number = self.number if self.compute is None else self.compute()
        return (number % (1 << 8 * self.size)).to_bytes(self.size, "little")

    def checked(self, number: int) -> int:
        """Return a number that a client may set it to.

        Raises:
            AccessError: It is beyond the limits.
        """
        if number > self.highest:
            raise AccessError(Abort.TOO_HIGH)
        if number < self.lowest:
            raise AccessError(Abort.TOO_LOW)
        return number


class ObjectDictionary:
    """What a node's SDO server and its PDOs give access to; implements ``Objects``.

    Args:
        data_sheet: Text of the EDS.
        node: The node's number, for defaults that are relative to it.
        values: Defaults that differ from the data sheet's: the serial number.
        absent: Indexes that this device has not got.
    """

    def __init__(
        self,
        data_sheet: str,
        node: int,
        values: Mapping[Entry, int] | None = None,
        absent: Collection[int] = (),
    ) -> None:
        found = dict(_variables(data_sheet, node))
        self._variables = {at: found[at] for at in found if at.index not in absent}
        self._indexes = {entry.index for entry in self._variables}
        for entry, number in (values or {}).items():
            self._variables[entry].default = number
        self.reset()

    def __contains__(self, entry: Entry) -> bool:
        return entry in self._variables

    def reset(self, first: int = 0x0000, last: int = 0xFFFF) -> None:
        """Put the defaults back between two indexes, both included; nothing acts on that."""
        for entry, variable in self._variables.items():
            if first <= entry.index <= last:
                variable.number = variable.default

    def on_read(self, entry: Entry, compute: Callable[[], int]) -> None:
        """Have a number computed whenever it is read."""
        self._variables[entry].compute = compute

    def on_write(self, entry: Entry, act: Callable[[int], None]) -> None:
        """Have something done when a client has set a number.

        Where ``act`` raises ``AccessError``, the old number is put back.
        """
        self._variables[entry].act = act

    def variable(self, entry: Entry) -> Variable:
        """Return an entry.

        Raises:
            AccessError: There is none.
        """
        try:
            return self._variables[entry]
        except KeyError:
            there = entry.index in self._indexes
            raise AccessError(Abort.NO_SUB_INDEX if there else Abort.NO_OBJECT) from None

    def number(self, entry: Entry) -> int:
        """Return a number, whether or not a client may read it."""
        variable = self._variables[entry]
        return variable.number if variable.compute is None else variable.compute()

    def set_number(self, entry: Entry, number: int) -> None:
        """Set a number by the device's own decision: without limits, and nothing acts on it."""
        self._variables[entry].number = number

    def read(self, entry: Entry) -> bytes:
        """See :meth:`Objects.read`."""
        variable = self.variable(entry)
        if not variable.readable:
            raise AccessError(Abort.WRITE_ONLY)
        return variable.encode()

    def write(self, entry: Entry, value: bytes) -> None:
        """See :meth:`Objects.write`."""
        variable = self.variable(entry)
        if not variable.writable:
            raise AccessError(Abort.READ_ONLY)
        if len(value) != variable.size:
            too_long = len(value) > variable.size
            raise AccessError(Abort.TOO_LONG if too_long else Abort.TOO_SHORT)
        number = int.from_bytes(value, "little", signed=variable.signed)
        _set(variable, variable.checked(number))

    def take(self, values: Mapping[Entry, int]) -> None:
        """Set what a PDO carried, unsigned numbers: all of it first, then act on it in order.

        So a controlword finds the target that came with it. What is refused stays as it was:
        a PDO has no answer.
        """
        before: list[tuple[Variable, int]] = []
        for entry, number in values.items():
            variable = self._variables[entry]
            value = signed(number, 8 * variable.size) if variable.signed else number
            with contextlib.suppress(AccessError):
                variable.number, old = variable.checked(value), variable.number
                before.append((variable, old))
        for variable, old in before:
            with contextlib.suppress(AccessError):
                _act(variable, old)


def _set(variable: Variable, number: int) -> None:
    old, variable.number = variable.number, number
    _act(variable, old)


def _act(variable: Variable, old: int) -> None:
    if variable.act is None:
        return
    try:
        variable.act(variable.number)
    except AccessError:
        variable.number = old
        raise


def _variables(data_sheet: str, node: int) -> Iterator[tuple[Entry, Variable]]:
    eds = RawConfigParser(inline_comment_prefixes=(";",))
    eds.read_string(data_sheet)
    for name in eds.sections():
        match = _SECTION.fullmatch(name)
        section = eds[name]
        if match is None or "DataType" not in section:  # a record: its entries have sections
            continue
        index, sub_index = match.groups()
        yield Entry(int(index, 16), int(sub_index or "0", 16)), _variable(section, node)


def _variable(section: Mapping[str, str], node: int) -> Variable:
    kind, access = int(section["DataType"], 0), section["AccessType"].lower()
    mappable = section.get("PDOMapping", "0") != "0"
    default = section.get("DefaultValue", "")
    if kind == _VISIBLE_STRING:
        return Variable(0, False, access, mappable, 0, 0, 0, default.encode("latin-1"))
    size, has_sign = _NUMBERS[kind]
    bits = 8 * size
    least, most = (-(1 << bits - 1), (1 << bits - 1) - 1) if has_sign else (0, (1 << bits) - 1)
    lowest = int(section.get("LowLimit") or str(least), 0)
    highest = int(section.get("HighLimit") or str(most), 0)
    number = sum(
        node if term.strip().upper() == "$NODEID" else int(term, 0)
        for term in (default or "0").split("+")
    )
    return Variable(size, has_sign, access, mappable, lowest, highest, number)
