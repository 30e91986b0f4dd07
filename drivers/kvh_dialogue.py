"""The command dialogue with a KVH 1750/1775 or DSP-1760: codec, link and deadlines."""

import asyncio
from typing import TypeVar

import numpy as np

from drivers.codecs.kvh import Event, FrameBlock, KvhDecoder, Reply
from drivers.codecs.kvh_bit import BitResult
from drivers.codecs.kvh_commands import Command, encode_command
from drivers.errors import LinkTimeoutError, ProtocolError
from drivers.interfaces import Link

_ATTEMPTS = 4  # a command or its answer may be hit by noise
_ANSWER_S = 0.5  # answers come within milliseconds, BIT typically within 100 (ICD 8.5)
_SLOW_FRAME_S = 1.5  # at 1 Hz the first frame is a second away
_RATE_WINDOW_S = 0.25
_RATE_DEADLINE_S = 4.0
_RATE_TOLERANCE = 0.1  # the neighbouring rates are 25 % and more apart
_RATE_FRAMES = 4  # two invalid ones and two that are measured

_REFUSALS = ("INVALID", "USAGE")

E = TypeVar("E", FrameBlock, BitResult, Reply)


class KvhDialogue:
    """Asks and commands; every wait ends at a deadline.

    Args:
        link: The open link; nobody else reads it meanwhile.
        decoder: Shared with whoever reads the stream afterwards.
    """

    def __init__(self, link: Link, decoder: KvhDecoder) -> None:
        self._link = link
        self._decoder = decoder
        self._arrival_s = 0.0
        self._heard_bytes = 0
        self._heard_frames = 0
        self.configuring = False

    async def enter_configuration(self) -> None:
        """Make the device listen to settings, whichever mode it is in.

        The answer to ``=CONFIG,1`` may be lost amid data, so any answer to ``?IS``, which normal
        mode ignores, will do.

        Raises:
            LinkTimeoutError: Nothing was heard, or frames only.
            ProtocolError: Bytes were heard, but no KVH.
        """
        self._heard_bytes = self._heard_frames = 0
        self.configuring = True  # from here on it may be, heard or not
        for _ in range(_ATTEMPTS):
            for command, answer in (("=CONFIG,1", "CONFIG,1"), ("?IS", "IS,")):
                if await self._exchange(command, answer) is not None:
                    return
        self.configuring = False
        raise self._stranger()

    async def ask(self, name: str) -> str | None:
        """Return what ``?NAME`` is answered with; ``None`` where the device does not know it.

        Raises:
            LinkTimeoutError: No answer.
        """
        text = await self._insist(f"?{name}", f"{name},")
        return None if text.startswith(_REFUSALS) else text.removeprefix(f"{name},")

    async def set(self, name: str, value: str) -> None:
        """Change a setting and have it confirmed.

        Raises:
            LinkTimeoutError: No answer.
            ProtocolError: The device refuses the value.
        """
        command = f"={name},{value}"
        text = await self._insist(command, f"{name},{value}")
        if text.startswith(_REFUSALS):
            msg = f"{self._link.name}: the KVH refuses {command}: it answers {text!r}"
            raise ProtocolError(msg)

    async def leave_configuration(self) -> None:
        """Return to normal mode, whose first frames are the confirmation.

        Raises:
            LinkTimeoutError: No frame came.
        """
        for _ in range(_ATTEMPTS):
            await self._send("=CONFIG,0")
            if await self._next(FrameBlock, self._now_s() + _SLOW_FRAME_S) is not None:
                self.configuring = False
                return
        msg = (
            f"{self._link.name}: the KVH sends no data after =CONFIG,0; "
            "if it waits for an external trigger (?MSYNC), send =MSYNC,IMU"
        )
        raise LinkTimeoutError(msg)

    async def built_in_test(self) -> BitResult:
        """Return the result of ``?BIT``; normal mode only.

        Raises:
            LinkTimeoutError: No answer.
        """
        for _ in range(_ATTEMPTS):
            await self._send("?BIT")
            result = await self._next(BitResult, self._now_s() + _ANSWER_S)
            if result is not None:
                return result
        msg = f"{self._link.name}: the KVH does not answer ?BIT; check the line to its receiver"
        raise LinkTimeoutError(msg)

    async def verify_rate(self, rate_hz: int) -> FrameBlock:
        """Count frames until their rate is the configured one, and return the last of them.

        By then the frames that a change of settings invalidates have passed. A computer that was
        held up gets many at once, so a rate that is off is measured again from there on.

        Raises:
            ProtocolError: The rate is another.
        """
        deadline_s = self._now_s() + _RATE_DEADLINE_S
        counted, measured_hz = 0, 0.0
        last = await self._next(FrameBlock, deadline_s)
        start_s = self._arrival_s
        while (block := await self._next(FrameBlock, deadline_s)) is not None:
            counted += _steps(last, block) if last is not None else 0
            last, elapsed_s = block, self._arrival_s - start_s
            if counted >= _RATE_FRAMES and elapsed_s >= _RATE_WINDOW_S:
                measured_hz = counted / elapsed_s
                if abs(measured_hz / rate_hz - 1.0) <= _RATE_TOLERANCE:
                    return block
                counted, start_s = 0, self._arrival_s
        msg = (
            f"{self._link.name}: the KVH is set to {rate_hz} Hz but sends {measured_hz:.0f} Hz; "
            "check that its baud rate carries the data rate"
        )
        raise ProtocolError(msg)

    async def _insist(self, command: str, answer: str) -> str:
        """Return the answer; the refusal where every attempt is refused or lost."""
        refusal = None
        for _ in range(_ATTEMPTS):
            text = await self._exchange(command, answer)
            if text is not None and _answers(text, answer):
                return text
            refusal = text or refusal
        if refusal is None:
            msg = f"{self._link.name}: the KVH does not answer {command}; check the cable"
            raise LinkTimeoutError(msg)
        return refusal

    async def _exchange(self, command: str, answer: str) -> str | None:
        """Return the answer or the refusal; ``None`` where neither came."""
        await self._send(command)
        deadline_s = self._now_s() + _ANSWER_S
        while (reply := await self._next(Reply, deadline_s)) is not None:
            if _answers(reply.text, answer) or reply.text.startswith(_REFUSALS):
                return reply.text
        return None

    async def _send(self, command: str) -> None:
        await self._link.write(encode_command(Command(command[0], command[1:])))

    async def _next(self, kind: type[E], deadline_s: float) -> E | None:
        while (event := await self._event(deadline_s)) is not None:
            if isinstance(event, kind):
                return event
        return None

    async def _event(self, deadline_s: float) -> Event | None:
        """Return the next event of any kind; ``None`` at the deadline."""
        while (event := self._decoder.next_event()) is None:
            remaining_s = deadline_s - self._now_s()
            if remaining_s <= 0.0:
                return None
            try:
                chunk = await self._link.read(remaining_s)
            except LinkTimeoutError:
                return None
            self._decoder.receive_data(chunk.data)
            self._arrival_s = chunk.arrival_s
            self._heard_bytes += len(chunk.data)
        self._heard_frames += isinstance(event, FrameBlock)
        return event

    def _now_s(self) -> float:
        return asyncio.get_running_loop().time()

    def _stranger(self) -> LinkTimeoutError | ProtocolError:
        name = self._link.name
        if not self._heard_bytes:
            return LinkTimeoutError(
                f"{name} is silent: no KVH data and no answer to =CONFIG,1; "
                "check power, cable and that this is the KVH's port"
            )
        if self._heard_frames:
            return LinkTimeoutError(
                f"{name}: the KVH sends data but does not answer =CONFIG,1; "
                "check the line to its receiver"
            )
        return ProtocolError(
            f"{name} sent {self._heard_bytes} bytes and no KVH frame among them; "
            "check the baud rate (921600 by default) and that no other device is on this port"
        )


def _answers(text: str, answer: str) -> bool:
    """Tell whether a line is the answer; one that ends in a comma is followed by a value."""
    return text.startswith(answer) if answer.endswith(",") else text == answer


def _steps(last: FrameBlock, block: FrameBlock) -> int:
    """Return by how many frames a block goes on from the one before; they count modulo 128."""
    return int((np.diff(block.sequence, prepend=last.sequence[-1]) % 128).sum())
