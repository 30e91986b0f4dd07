"""What one CANopen node is asked, and which answer belongs to which question."""

import asyncio
import copy
from collections import deque
from typing import Final

from drivers.canopen.watch import NodeWatch
from drivers.codecs.canopen import SDO_REQUEST
from drivers.codecs.sdo_client import Transfer
from drivers.errors import DriverError
from drivers.interfaces import CanFrame, CanLink, Counters

_ANSWER_S: Final = 0.5  # CiA 301 names no limit; a drive answers within 20 ms
_READ_ATTEMPTS: Final = 2  # one lost frame, or one moment of a busy computer, ends no run
_MOST_OWED: Final = 4  # answers that may yet come late; older ones will not


class Questions:
    """Puts the requests of transfers, one transfer at a time, and takes what answers them.

    Args:
        link: The bus.
        node: The node's number.
        watch: Words a question that was not answered.
        counters: Counts the answers that did not come.
    """

    def __init__(self, link: CanLink, node: int, watch: NodeWatch, counters: Counters) -> None:
        self._link = link
        self._node = node
        self._watch = watch
        self._counters = counters
        self._asked: tuple[Transfer, asyncio.Future[bytes]] | None = None
        self._owed: deque[Transfer] = deque(maxlen=_MOST_OWED)

    async def carry_out(self, transfer: Transfer) -> None:
        """Carry a transfer to its result.

        Raises:
            LinkTimeoutError: No answer.
            TransportError: The bus takes nothing.
            DriverError: Whatever :meth:`fail` was told meanwhile.
        """
        request: bytes | None = transfer.begin()
        while request is not None and transfer.result is None:
            request = transfer.answer(await self._ask(transfer, request))
        if request is not None:  # the transfer ends with an abort of ours
            await self._put(request)

    def take_answer(self, data: bytes) -> bool:
        """Take an answer; say whether it was owed: one that was not comes from a second node."""
        owed = next((transfer for transfer in self._owed if transfer.belongs(data)), None)
        if owed is None:
            return False
        self._owed.remove(owed)
        if self._asked is not None:
            transfer, answer = self._asked
            if not answer.done() and transfer.belongs(data):
                answer.set_result(data)
        return True

    def fail(self, error: DriverError) -> None:
        """Let whoever awaits an answer have the error instead."""
        if self._asked is not None and not self._asked[1].done():
            self._asked[1].set_exception(error)

    async def _ask(self, transfer: Transfer, request: bytes) -> bytes:
        answer: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        self._asked = transfer, answer
        attempts = _READ_ATTEMPTS if transfer.repeatable else 1
        try:
            for _ in range(attempts):
                self._owed.append(copy.copy(transfer))  # as it stands now: it goes on and changes
                await self._put(request)
                await asyncio.wait([answer], timeout=_ANSWER_S)
                if answer.done():
                    return answer.result()
                self._counters.lost += 1
        finally:
            self._asked = None
        raise self._watch.unanswered(str(transfer.entry), _ANSWER_S, attempts)

    async def _put(self, request: bytes) -> None:
        await self._link.write(CanFrame(SDO_REQUEST + self._node, request))
