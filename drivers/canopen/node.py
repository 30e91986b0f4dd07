"""A CANopen node as its master sees it: objects, heartbeat, emergencies, process data."""

import asyncio
import contextlib
from collections.abc import Callable, Sequence

from drivers.canopen.questions import Questions
from drivers.canopen.watch import HEARTBEAT_S, LISTEN_S, NodeWatch
from drivers.codecs.canopen import (
    EMERGENCY,
    HEARTBEAT,
    SDO_ANSWER,
    SDO_REQUEST,
    Emergency,
    NmtCommand,
    decode_emergency,
    decode_heartbeat,
    encode_nmt,
)
from drivers.codecs.sdo import Abort, Aborted, Entry, describe_abort
from drivers.codecs.sdo_client import Transfer
from drivers.errors import DriverError, LinkTimeoutError, RefusedError, TransportError
from drivers.interfaces import CanArrivals, CanFilter, CanFrame, CanLink, Counters
from drivers.links.inbox import FrameInbox

_GATHER_S = 0.05
_STANDARD = 0x7FF
_ALL_HEARTBEATS = CanFilter(HEARTBEAT, 0x780)
_HEARTBEAT_TIME = Entry(0x1017)
#: Abort codes for an object that a node need not have.
_ABSENT = {Abort.NO_OBJECT, Abort.NO_SUB_INDEX, Abort.UNSUPPORTED_ACCESS}


class CanopenNode:
    """One node on a bus: reads and writes its objects one at a time, and watches that it lives.

    Once it has failed (fell silent, restarted, shares its number, lost its bus), every call
    raises the reason until it is opened again.

    Args:
        link: The bus.
        node: Its number, 1 to 127.
        pdos: Identifiers of the process data that :meth:`read` returns.

    Attributes:
        counters: Frames of this node, and answers that did not come.
        emergency: The last that it reported and has not taken back.
    """

    def __init__(self, link: CanLink, node: int, pdos: Sequence[int] = ()) -> None:
        self.counters = Counters()
        self.emergency: Emergency | None = None
        self._link = link
        self._node = node
        self._pdos = pdos
        self._process_data = FrameInbox(self.name)
        self._watch = NodeWatch(self.name, node)
        self._questions = Questions(link, node, self._watch, self.counters)
        self._failure: DriverError | None = None
        self._lock = asyncio.Lock()
        self._listening: asyncio.Task[None] | None = None
        self._found_heartbeat_ms: int | None = None

    @property
    def error_frames(self) -> int:
        """Return how many errors the bus's controller has reported."""
        return self._link.error_frames

    @property
    def name(self) -> str:
        """Return what a message calls it: ``node 5 on socketcan can0``."""
        return f"node {self._node} on {self._link.name}"

    async def open(self) -> None:
        """Open the bus and have the node send its heartbeat, where it can.

        Raises:
            TransportError: The bus cannot be opened, or no such node answers in time.
            ProtocolError: Two nodes answer.
        """
        await self.close()
        self._failure = self.emergency = None
        self._process_data = FrameInbox(self.name)
        self._watch = NodeWatch(self.name, self._node)
        self._questions = Questions(self._link, self._node, self._watch, self.counters)
        own = (SDO_ANSWER + self._node, EMERGENCY + self._node, *self._pdos)
        wanted = [CanFilter(can_id, _STANDARD) for can_id in own]
        self._link.set_filters([*wanted, _ALL_HEARTBEATS])
        await self._link.open()
        self._listening = asyncio.create_task(self._listen(), name=self.name)
        try:
            await self._ask_for_heartbeats()
        except BaseException:
            await self.close()
            raise

    async def close(self) -> None:
        """Leave the heartbeat as it was found and release the bus; never raises DriverError."""
        with contextlib.suppress(DriverError):
            if self._found_heartbeat_ms is not None and self._failure is None:
                await self.write(_HEARTBEAT_TIME, self._found_heartbeat_ms, 2)
        self._found_heartbeat_ms = None
        task, self._listening = self._listening, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])
            if not task.cancelled():
                task.result()  # a defect must not pass in silence
        with contextlib.suppress(DriverError):
            await self._link.close()

    async def read(self, timeout_s: float) -> CanArrivals:
        """Return the process data that came since the last call.

        Raises:
            LinkTimeoutError: None came in time.
            TransportError: The node or its bus has failed.
        """
        return await self._process_data.get(timeout_s, _GATHER_S)

    async def value(self, entry: Entry) -> bytes:
        """Return an object.

        Raises:
            LinkTimeoutError: No answer.
            RefusedError: The node has no such object, or does not let it be read.
            DriverError: The node has failed before.
        """
        return await self._carry_out(Transfer(entry), "read")

    async def number(self, entry: Entry, *, signed: bool = False) -> int:
        """Return an object that holds a number; raises as :meth:`value`."""
        return int.from_bytes(await self.value(entry), "little", signed=signed)

    async def number_if_present(self, entry: Entry) -> int | None:
        """Return a number that a node need not have; None where it has not."""
        try:
            return await self.number(entry)
        except RefusedError as refused:
            if refused.code in _ABSENT:
                return None
            raise

    async def text_if_present(self, entry: Entry) -> str:
        """Return text that a node need not have; empty where it has none."""
        try:
            value = await self.value(entry)
        except RefusedError as refused:
            if refused.code in _ABSENT:
                return ""
            raise
        return value.decode("latin-1").strip("\0 ")

    async def write(
        self, entry: Entry, number: int, size: int, *, check: Callable[[], None] | None = None
    ) -> None:
        """Write a number of so many bytes, a negative one in two's complement.

        Args:
            entry: Where.
            number: What.
            size: Bytes.
            check: Raises where it shall not be written any more; asked just before.

        Raises:
            LinkTimeoutError: No answer.
            RefusedError: The node does not take it.
            DriverError: The node has failed before.
        """
        value = (number % (1 << 8 * size)).to_bytes(size, "little")
        await self._carry_out(Transfer(entry, value), f"write {number} to", check)

    async def urge(self, entry: Entry, number: int, size: int) -> None:
        """Write a number even to a node that has failed: one that cannot be trusted may hear.

        Raises:
            DriverError: As :meth:`write`; of a node that has failed it is not awaited whether it
                takes the number, and the failure is raised again.
        """
        if self._failure is not None:
            value = (number % (1 << 8 * size)).to_bytes(size, "little")
            request = Transfer(entry, value).begin()
            await self._link.write(CanFrame(SDO_REQUEST + self._node, request))
        await self.write(entry, number, size)

    async def command(self, command: NmtCommand) -> None:
        """Tell the node to change its NMT state; it does not answer."""
        await self.send(encode_nmt(command, self._node))

    async def send(self, frame: CanFrame) -> None:
        """Put any frame on the bus.

        Raises:
            TransportError: The bus takes nothing.
            DriverError: The node has failed before.
        """
        self._check()
        await self._link.write(frame)

    def _check(self) -> None:
        if self._failure is not None:
            raise self._failure

    async def _ask_for_heartbeats(self) -> None:
        """Have the heartbeat sent, and miss it from now on; an old node has none."""
        found_ms = await self.number_if_present(_HEARTBEAT_TIME)
        if found_ms is None:
            return
        wanted_ms = round(1000 * HEARTBEAT_S)
        if found_ms != wanted_ms:
            await self.write(_HEARTBEAT_TIME, wanted_ms, 2)
            self._found_heartbeat_ms = found_ms
        self._watch.expect_heartbeats(asyncio.get_running_loop().time())

    async def _carry_out(
        self, transfer: Transfer, verb: str, check: Callable[[], None] | None = None
    ) -> bytes:
        async with self._lock:
            self._check()
            if check is not None:
                check()
            await self._questions.carry_out(transfer)
        if not isinstance(transfer.result, Aborted):
            return transfer.result or b""
        code = transfer.result.code
        why = describe_abort(code)
        msg = f"The {self.name} refuses to {verb} {transfer.entry}: {why}."
        raise RefusedError(msg, code)

    async def _listen(self) -> None:
        loop = asyncio.get_running_loop()
        begun_s = loop.time()
        while self._failure is None:
            heard = await self._heard()
            ended_s = loop.time()
            self._watch.note_listening(ended_s - begun_s)
            begun_s = ended_s
            for frame, time_s in heard:
                self._take(frame, time_s)
            self._fail(self._watch.silence())

    async def _heard(self) -> list[tuple[CanFrame, float]]:
        """Return what came in a moment, and when: perhaps nothing."""
        try:
            return list(zip(*await self._link.read(LISTEN_S), strict=True))
        except LinkTimeoutError:
            pass
        except TransportError as error:
            self._fail(error)
        return []

    def _take(self, frame: CanFrame, time_s: float) -> None:
        beat = decode_heartbeat(frame)
        if beat is not None:
            self._fail(self._watch.note_heartbeat(*beat, time_s))
            return
        self.counters.frames += 1
        self._watch.note_frame(time_s)
        if frame.can_id == SDO_ANSWER + self._node:
            if not self._questions.take_answer(frame.data):
                self._fail(self._watch.doubled())
        elif frame.can_id in self._pdos:
            self._process_data.put(frame, time_s)
        else:
            emergency = decode_emergency(frame, self._node)
            if emergency is not None:
                self.emergency = emergency if emergency.code else None

    def _fail(self, error: DriverError | None) -> None:
        if error is None or self._failure is not None:
            return
        self._failure = error
        self._process_data.fail(TransportError(str(error)))  # no reader shall take it for silence
        self._questions.fail(error)
