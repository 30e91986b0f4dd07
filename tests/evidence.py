"""How a test tells ``docs/proof.md`` what it measured: pytest's fixture `record_property`."""

from collections.abc import Callable

#: Called with "measured" and the words for the cell of the table.
Record = Callable[[str, object], None]
