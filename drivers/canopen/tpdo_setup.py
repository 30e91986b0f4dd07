"""Setting a node's first transmit PDO up, and putting back what was found (CiA 301, 7.5.2.37)."""

from collections.abc import Sequence

from drivers.canopen.node import CanopenNode
from drivers.codecs.canopen import NmtCommand
from drivers.codecs.pdo import INVALID, Mapped
from drivers.codecs.sdo import Entry
from drivers.errors import RefusedError

_COB_ID, _TYPE, _TIMER = Entry(0x1800, 1), Entry(0x1800, 2), Entry(0x1800, 5)
_COUNT = Entry(0x1A00)
_Parameters = tuple[list[int], int, int | None]


class TpdoSetup:
    """The first TPDO of a node; it is changed only where it differs.

    Args:
        node: The open node.
    """

    def __init__(self, node: CanopenNode) -> None:
        self._node = node
        self._found: _Parameters | None = None

    async def apply(self, mapping: Sequence[Mapped], kind: int, timer_ms: int | None) -> None:
        """Have the node send these objects, so triggered; it is pre-operational after this.

        Args:
            mapping: What is sent.
            kind: The transmission type.
            timer_ms: Of the event timer; None leaves it, and it need not be there.

        Raises:
            RefusedError: The node cannot; what was found is put back.
            DriverError: It does not answer.
        """
        await self._node.command(NmtCommand.ENTER_PRE_OPERATIONAL)
        wanted: _Parameters = [one.to_number() for one in mapping], kind, timer_ms
        found = await self._read()
        if found[:2] == wanted[:2] and timer_ms in {None, found[2]}:
            return
        if self._found is None:
            self._found = found
        try:
            await self._write(wanted)
        except RefusedError:
            await self.restore()
            raise

    async def restore(self) -> None:
        """Put back what was found."""
        if self._found is not None:
            await self._node.command(NmtCommand.ENTER_PRE_OPERATIONAL)
            await self._write(self._found)
            self._found = None

    async def _read(self) -> _Parameters:
        count = await self._node.number(_COUNT)
        entries = [Entry(_COUNT.index, place) for place in range(1, count + 1)]
        mapped = [await self._node.number(entry) for entry in entries]
        kind = await self._node.number(_TYPE)
        return mapped, kind, await self._node.number_if_present(_TIMER)

    async def _write(self, parameters: _Parameters) -> None:
        """Change it in the order that CiA 301 asks for: off, emptied, filled, on."""
        mapped, kind, timer_ms = parameters
        cob_id = await self._node.number(_COB_ID)
        await self._node.write(_COB_ID, cob_id | INVALID, 4)
        await self._node.write(_COUNT, 0, 1)
        for place, number in enumerate(mapped, 1):
            await self._node.write(Entry(_COUNT.index, place), number, 4)
        await self._node.write(_COUNT, len(mapped), 1)
        await self._node.write(_TYPE, kind, 1)
        if timer_ms is not None:
            await self._node.write(_TIMER, timer_ms, 2)
        await self._node.write(_COB_ID, cob_id & ~INVALID, 4)
