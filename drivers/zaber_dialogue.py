"""One Zaber ASCII request and its reply at a time, over a link that may lose either."""

import asyncio
import contextlib
from collections.abc import Callable, Iterator

from drivers.codecs.zaber import (
    MESSAGE_IDS,
    REJECTIONS,
    Command,
    Rejection,
    Reply,
    ZaberDecoder,
    encode,
)
from drivers.errors import DeviceFaultError, LinkTimeoutError, ProtocolError, TransportError
from drivers.interfaces import Counters, Link

_REPLY_S = 0.3  # a stage answers within 10 ms, a sleepy USB converter within 50 ms
_ATTEMPTS = 3
_BUSY_S = 2.0
_BUSY_POLL_S = 0.05
_PASSING = {Rejection.AGAIN, Rejection.FULL, Rejection.STATUSBUSY}


class ZaberDialogue:
    """Asks one device on a link; replies are matched by message id, so late ones do no harm.

    A request is repeated where its reply was lost, so only requests that may be obeyed twice
    are made: queries, ``home``, ``stop``, ``move abs``, but never ``move rel``.
    """

    def __init__(self, link: Link) -> None:
        self.counters = Counters()
        self._link = link
        self._lock = asyncio.Lock()
        self._decoder = ZaberDecoder()
        self._device = 0
        self._message_id = 0
        self._received_bytes = 0
        self._checksums_switched_on = False

    async def open(self) -> None:
        """Open the link and find the device: whichever answers first, the nearest of a chain.

        Raises:
            LinkTimeoutError: Nothing came at all.
            ProtocolError: What came is not Zaber ASCII.
        """
        await self._link.open()
        self._decoder, self._device, self._received_bytes = ZaberDecoder(), 0, 0
        try:
            self._device = (await self._answer("", axis=0)).device
        except LinkTimeoutError as silence:
            if not self._received_bytes:
                raise
            msg = (
                f"What answers on {self._link.name} is no Zaber table: {self._received_bytes}"
                " bytes came, but no reply in Zaber ASCII. Check the port, its 115200 baud and"
                " the table's protocol."
            )
            raise ProtocolError(msg) from silence

    async def switch_on_checksums(self) -> None:
        """Have the device protect its replies too, where its firmware can."""
        try:
            _, present = await self.number("get comm.checksum", axis=0)
        except DeviceFaultError as rejection:
            if rejection.code != Rejection.BADCOMMAND:
                raise
            return  # message ids and syntax must do
        if present == 0:
            await self.request("set comm.checksum 1", axis=0)
            self._checksums_switched_on = True

    async def restore_checksums(self) -> None:
        """Leave that setting as it was found."""
        if self._checksums_switched_on:
            await self.request("set comm.checksum 0", axis=0)
            self._checksums_switched_on = False

    async def close(self) -> None:
        """Release the link."""
        await self._link.close()

    async def request(
        self, text: str, *, axis: int = 1, check: Callable[[], None] | None = None
    ) -> Reply:
        """Send a command and return the reply that accepts it.

        Args:
            text: The command, without its address.
            axis: 1, or 0 for the device itself.
            check: Called at the last moment before each sending; raises to prevent it.

        Raises:
            LinkTimeoutError: No reply, however often asked.
            TransportError: The link was cut.
            DeviceFaultError: The command was rejected; carries the reason.
        """
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + _BUSY_S
        while True:
            reply = await self._answer(text, axis=axis, check=check)
            if reply.accepted:
                return reply
            if reply.data not in _PASSING or loop.time() >= deadline_s:
                raise self._rejected(text, reply.data)
            await asyncio.sleep(_BUSY_POLL_S)

    async def urge(self, text: str) -> Reply:
        """Send a command at once, even while another awaits its reply, and then request it.

        The request has to wait for its turn, up to a lost reply's deadline; the bytes have not.
        Their own reply is passed over.

        Raises:
            LinkTimeoutError: No reply, however often asked.
            TransportError: The link was cut.
            DeviceFaultError: The command was rejected; carries the reason.
        """
        if self._lock.locked():
            with self._telling_of(text):
                await self._link.write(encode(self._command(text, axis=1)))
        return await self.request(text)

    async def number(self, text: str, *, axis: int = 1) -> tuple[Reply, int]:
        """Send a query whose reply is an integer.

        Raises:
            ProtocolError: It was none, however often asked.
        """
        answer = ""
        for _ in range(_ATTEMPTS):  # without a checksum, a damaged digit is seen only here
            reply = await self.request(text, axis=axis)
            try:
                return reply, int(reply.data)
            except ValueError:
                answer = reply.data
        msg = (
            f"The table on {self._link.name} answered {_named(text)} with {answer!r}, not a number."
        )
        raise ProtocolError(msg)

    async def _answer(
        self, text: str, *, axis: int, check: Callable[[], None] | None = None
    ) -> Reply:
        """Ask until a reply comes; the lock is held for one exchange, so a stop can get in."""
        for _ in range(_ATTEMPTS):
            async with self._lock:
                if check is not None:
                    check()
                reply = await self._exchange(text, axis)
            if reply is not None:
                return reply
            self.counters.lost += 1
        msg = (
            f"The table on {self._link.name} did not answer {_named(text)} within {_REPLY_S:g}"
            f" s, {_ATTEMPTS} times; check its power and its cable."
        )
        raise LinkTimeoutError(msg)

    async def _exchange(self, text: str, axis: int) -> Reply | None:
        command = self._command(text, axis)
        with self._telling_of(text):
            await self._link.write(encode(command))
            return await self._await_reply(command)

    def _command(self, text: str, axis: int) -> Command:
        self._message_id = (self._message_id + 1) % MESSAGE_IDS
        return Command(text, self._device, axis, self._message_id)

    @contextlib.contextmanager
    def _telling_of(self, text: str) -> Iterator[None]:
        try:
            yield
        except TransportError as error:
            msg = (
                f"The connection to the table was cut during {_named(text)} ({error})."
                " It may still be turning: look, reconnect it, then resume."
            )
            raise TransportError(msg) from error

    async def _await_reply(self, command: Command) -> Reply | None:
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + _REPLY_S
        while (remaining_s := deadline_s - loop.time()) > 0:
            try:
                chunk = await self._link.read(remaining_s)
            except LinkTimeoutError:
                return None
            self._received_bytes += len(chunk.data)
            self._decoder.receive_data(chunk.data)
            reply = self._matching_reply(command)
            self.counters.frames = self._decoder.frames
            self.counters.crc_errors = self._decoder.crc_errors
            if reply is not None:
                return reply
        return None

    def _matching_reply(self, command: Command) -> Reply | None:
        """Drain the decoder; replies to others, infos and alerts are passed over."""
        found = None
        for event in iter(self._decoder.next_event, None):
            if (
                isinstance(event, Reply)
                and event.message_id == command.message_id
                and command.device in (0, event.device)
            ):
                found = found or event
        return found

    def _rejected(self, text: str, reason: str) -> DeviceFaultError:
        words = REJECTIONS.get(reason, "a reason that the manual does not list")
        msg = f"The table on {self._link.name} rejected {_named(text)}: {reason}, {words}."
        return DeviceFaultError(msg, reason)


def _named(text: str) -> str:
    return f"'{text}'" if text else "a status request"
