"""Asking a STIM300 and setting its data rate, each with a deadline."""

import asyncio
import contextlib
from typing import TypeVar

from drivers.codecs import stim300_service as service
from drivers.codecs.stim300 import Event, Stim300Decoder
from drivers.codecs.stim300_data import DataBlock
from drivers.codecs.stim300_utility import UtilityCommand, encode_utility
from drivers.errors import DeviceFaultError, LinkTimeoutError, ProtocolError
from drivers.interfaces import Link

_SYNCHRONISE_S = 2.0  # powered up a moment ago, it first checks itself
_ANSWER_S = 0.5
_ATTEMPTS = 3  # noise may hit a command, and nothing is echoed in normal mode
_PROMPT_QUIET_S = 0.1  # nothing follows a prompt; in a datagram's tail those bytes mean nothing

E = TypeVar("E", bound=Event)


class Stim300Dialogue:
    """The talk with one instrument before and after its samples are read.

    Args:
        link: Its open port; nobody else reads it meanwhile.
        name: What messages call the instrument.
        baudrate: The line speed, for messages.

    Attributes:
        decoder: What has come and was not asked for; the stream goes on from it.
    """

    def __init__(self, link: Link, name: str, baudrate: int) -> None:
        self._link = link
        self._name = name
        self._baudrate = baudrate
        self.decoder = Stim300Decoder()

    async def synchronise(self) -> None:
        """Wait for a good datagram, calling the instrument back from a mode without any.

        A program that was killed may have left it in service or utility mode, silent.

        Raises:
            LinkTimeoutError: Silence.
            ProtocolError: Something else is connected, or talks at another speed.
        """
        with contextlib.suppress(LinkTimeoutError):
            await self._next(DataBlock, _SYNCHRONISE_S)
            return
        self._refuse_gibberish()
        await self._link.write(service.EXIT)
        await self._link.write(encode_utility(UtilityCommand("xn")))
        with contextlib.suppress(LinkTimeoutError):
            await self._next(DataBlock, _SYNCHRONISE_S)
            return
        self._refuse_gibberish()
        msg = (
            f"{self._name} sent nothing for {2 * _SYNCHRONISE_S:g} s, and it should by itself; "
            f"check power, cable and external trigger"
        )
        raise LinkTimeoutError(msg)

    async def ask(self, command: bytes, kind: type[E]) -> E:
        """Return the datagram that answers a normal-mode command.

        Raises:
            LinkTimeoutError: It never came.
        """
        for _ in range(_ATTEMPTS):
            await self._link.write(command)
            with contextlib.suppress(LinkTimeoutError):
                return await self._next(kind, _ANSWER_S)
        asked = command.decode("ascii").strip()
        msg = f"{self._name} sends data but does not answer {asked}; check the line towards it"
        raise LinkTimeoutError(msg)

    async def set_rate(self, code: int) -> None:
        """Set the data rate until the power goes, and come back to normal mode.

        Raises:
            LinkTimeoutError: It does not enter service mode, or does not come back.
            DeviceFaultError: It refused the rate.
        """
        await self._serve(service.ENTER)
        error = service.error_of(await self._serve(service.encode_set_rate(code)))
        self.decoder = Stim300Decoder()
        await self._link.write(service.EXIT)
        await self._next(DataBlock, _SYNCHRONISE_S)
        if error is not None:
            msg = f"{self._name} refused data rate code {code}: {error}; set it in service mode"
            raise DeviceFaultError(msg, error[:4])

    async def _next(self, kind: type[E], timeout_s: float) -> E:
        """Return the next event of a kind; others pass."""
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + timeout_s
        while True:
            while (event := self.decoder.next_event()) is not None:
                if isinstance(event, kind):
                    return event
            remaining_s = deadline_s - loop.time()
            if remaining_s <= 0:
                msg = f"{self._name} sent no {kind.__name__} for {timeout_s:g} s"
                raise LinkTimeoutError(msg)
            self.decoder.receive_data((await self._link.read(remaining_s)).data)

    async def _serve(self, command: bytes) -> bytes:
        """Return the answer to a service-mode command."""
        for _ in range(_ATTEMPTS):
            await self._link.write(command)
            answer = await self._read_answer()
            if answer.endswith(service.PROMPT):
                return answer
        asked = command.decode("ascii").strip()
        msg = f"{self._name} does not prompt after {asked}; check the line towards it"
        raise LinkTimeoutError(msg)

    async def _read_answer(self) -> bytes:
        """Read until a prompt and the silence after it, or the deadline."""
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + _ANSWER_S
        answer = b""
        with contextlib.suppress(LinkTimeoutError):
            while (remaining_s := deadline_s - loop.time()) > 0:
                prompted = answer.endswith(service.PROMPT)
                timeout_s = _PROMPT_QUIET_S if prompted else remaining_s
                answer += (await self._link.read(timeout_s)).data
        return answer

    def _refuse_gibberish(self) -> None:
        if self.decoder.discarded_bytes:
            msg = (
                f"what comes from {self._link.name} is no STIM300 at {self._baudrate} bit/s: set "
                f"the instrument to that speed, or check what is connected"
            )
            raise ProtocolError(msg)
