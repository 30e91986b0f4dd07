"""A STIM300 at the byte: what Safran's data sheet TS1524 says it answers and sends."""

import asyncio
import math
from collections.abc import Callable
from enum import Enum, auto
from typing import ClassVar

import numpy as np

from drivers.codecs import stim300 as codec
from drivers.codecs import stim300_service as service
from drivers.codecs.stim300_configuration import RATE_CODES, Configuration, configure
from drivers.codecs.stim300_data import (
    COUNTER_MODULUS,
    COUNTER_RATE_HZ,
    START_UP,
    DataBlock,
    encode_data,
)
from drivers.codecs.stim300_special import (
    BiasTrim,
    ExtendedError,
    PartNumber,
    SerialNumber,
    Special,
    encode_special,
)
from drivers.codecs.stim300_utility import (
    UtilityCommand,
    UtilityReply,
    UtilityStatus,
    decode_command,
    encode_utility,
)
from drivers.interfaces import FloatArray, IntArray, Transport
from sim.interfaces import Felt, Sensing
from sim.pacing import bursts

_LATENCY_US = 506  # of a recorded instrument, at every data rate
_PART = PartNumber("84167-400000-0A1B", "-")
_LONGEST_LINE = 128
_TRIGGER_CODE = 5


class _Mode(Enum):
    INIT = auto()
    NORMAL = auto()
    SERVICE = auto()
    UTILITY = auto()


class SimulatedStim300:
    """The instrument's side of the line; implements ``SimulatedDevice``.

    At power-up it introduces itself and streams; settings hold until the power goes (``run``
    ends), saving is not simulated. A command takes effect at the next burst, a reply takes the
    place of the next datagram. The inclinometers feel the accelerometers' force, unfiltered.

    Args:
        sensing: What it feels.
        serial_number: Fourteen digits.
        configuration: What is saved in it.
        startup_s: How long the status tells of the start-up; a recorded instrument took 0.28 s.
        burst_s: Time between deliveries.
    """

    transport: ClassVar[Transport] = "serial"

    def __init__(
        self,
        sensing: Sensing,
        *,
        serial_number: str = "25581846020020",
        configuration: Configuration | None = None,
        startup_s: float = 0.28,
        burst_s: float = 0.05,
    ) -> None:
        self._sensing = sensing
        self._saved = configuration or configure()
        self._present = self._saved
        self._serial = SerialNumber(serial_number)
        self._startup_s = startup_s
        self._burst_s = burst_s
        self._send: Callable[[bytes], None] = lambda _: None
        self._received = bytearray()
        self._replies: list[bytes] = []
        self._mode = _Mode.INIT
        self._mode_entries = 0
        self._entered = asyncio.Event()
        self._stable_s = math.inf

    def connect(self, send: Callable[[bytes], None]) -> None:
        """Send through ``send`` from now on."""
        self._send = send

    def receive_data(self, data: bytes) -> None:
        """Take commands, cut anywhere; each ends with CR."""
        self._received += data
        *lines, rest = bytes(self._received).split(b"\r")
        self._received = bytearray(rest[-_LONGEST_LINE:])
        for line in lines:
            self._obey(line)

    async def run(self) -> None:
        """Live from power-up until cancelled."""
        self._present = self._saved
        power_up_s = asyncio.get_running_loop().time()
        self._enter(_Mode.INIT)
        while True:
            self._entered.clear()
            if self._mode is _Mode.INIT:
                self._introduce()
            elif self._mode is _Mode.NORMAL and self._present.rate_hz is not None:
                await self._stream(self._present.rate_hz, power_up_s)
            else:
                await self._entered.wait()

    def _enter(self, mode: _Mode) -> None:
        self._mode = mode
        self._mode_entries += 1
        self._entered.set()

    def _introduce(self) -> None:
        self._replies.clear()
        for event in (_PART, self._serial, self._present):
            self._send(encode_special(event, terminated=self._present.terminated))
        self._stable_s = asyncio.get_running_loop().time() + self._startup_s
        self._enter(_Mode.NORMAL)

    async def _stream(self, rate_hz: int, power_up_s: float) -> None:
        step = COUNTER_RATE_HZ // rate_hz
        count = round((asyncio.get_running_loop().time() - power_up_s) * COUNTER_RATE_HZ)
        entries = self._mode_entries
        async for time_s in bursts(rate_hz, self._burst_s):
            if entries != self._mode_entries:
                return
            counter = count + step * np.arange(1, len(time_s) + 1)
            count = int(counter[-1])
            felt = self._sensing.sense(time_s, 1 / rate_hz)
            status = START_UP * (time_s < self._stable_s)
            self._send_samples(self._quantised(felt, counter % COUNTER_MODULUS, status))

    def _send_samples(self, block: DataBlock) -> None:
        datagrams = encode_data(block, terminated=self._present.terminated)
        replies, self._replies = self._replies[: len(datagrams)], self._replies[len(datagrams) :]
        self._send(b"".join([*replies, *datagrams[len(replies) :]]))

    def _quantised(self, felt: Felt, counter: IntArray, status: IntArray) -> DataBlock:
        layout, present = self._present.layout, self._present
        scaled = {
            "gyro": felt.rate_rad_s / present.rate_lsb_rad_s(),
            "accelerometer": felt.specific_force_g / present.force_lsb_g(),
            "inclinometer": felt.specific_force_g / present.inclination_lsb_g(),
        }
        k, c, a = len(counter), len(layout.clusters), int(layout.auxiliary)
        t = c if layout.temperatures else 0
        warmth = np.broadcast_to(felt.temperature_deg_c[:, None, None] * 2**8, (k, t, 3))
        return DataBlock(
            layout,
            values=_rounded(np.stack([scaled[name] for name in layout.clusters], axis=1), 24),
            status=np.repeat(status[:, None], c, axis=1),
            temperatures=_rounded(warmth, 16),
            temperature_status=np.repeat(status[:, None], t, axis=1),
            auxiliary=np.zeros((k, a), np.int64),
            auxiliary_status=np.zeros((k, a), np.int64),
            counter=counter,
            latency_us=np.full(k, _LATENCY_US),
        )

    def _obey(self, line: bytes) -> None:
        match self._mode:
            case _Mode.NORMAL:
                self._obey_normal(line)
            case _Mode.SERVICE:
                self._obey_service(line)
            case _Mode.UTILITY:
                self._obey_utility(line)
            case _Mode.INIT:  # not listening yet
                pass

    def _obey_normal(self, line: bytes) -> None:
        """Obey section 8: upper case, no echo, the unknown ignored."""
        answers: dict[bytes, Special] = {
            codec.ASK_PART_NUMBER: _PART,
            codec.ASK_SERIAL_NUMBER: self._serial,
            codec.ASK_CONFIGURATION: self._present,
            codec.ASK_BIAS_TRIM: BiasTrim((0,) * 9, reference=0, saves_left=1000),
            codec.ASK_EXTENDED_ERROR: ExtendedError(0),
        }
        command = line + b"\r"
        if command in answers:
            reply = encode_special(answers[command], terminated=self._present.terminated)
            self._replies.append(reply)
        elif command == codec.RESET:
            self._present = self._saved
            self._enter(_Mode.INIT)
        elif command == service.ENTER:
            self._enter(_Mode.SERVICE)
            self._send(service.encode_answer(b"", f"STIM300 N{self._serial.digits}"))
        elif command == codec.ENTER_UTILITY_MODE:
            self._enter(_Mode.UTILITY)
            self._send(encode_utility(UtilityReply("UTILITYMODE")))

    def _obey_service(self, line: bytes) -> None:
        """Obey section 9, as far as the data rate and the exit go."""
        match line.split():
            case []:
                self._send(service.PROMPT)
            case [b"m", code]:
                taken = self._set_rate(code.decode("latin-1"))
                self._send(service.encode_answer(line, "" if taken else "E003"))
            case [b"x", b"N" | b"I" as mode]:
                name = "NORMAL" if mode == b"N" else "INIT"
                self._send(line + b"\rSYSTEM RETURNING TO %b MODE\r" % name.encode())
                self._enter(_Mode[name])
            case _:
                self._send(service.encode_answer(line, "E001"))

    def _obey_utility(self, line: bytes) -> None:
        """Obey section 10, as far as the serial number, the data rate and the exit go."""
        reply = self._utility_reply(decode_command(line))
        self._send(encode_utility(reply))
        if reply == UtilityReply("xn", UtilityStatus.OK):
            self._enter(_Mode.NORMAL)

    def _utility_reply(self, command: UtilityCommand | UtilityStatus) -> UtilityReply:
        match command:
            case UtilityStatus():
                return UtilityReply("", command)
            case UtilityCommand("isn", ()):
                return UtilityReply("isn", UtilityStatus.OK, (f"N{self._serial.digits}",))
            case UtilityCommand("sm", (code,)):
                taken = self._set_rate(code)
                return UtilityReply(
                    "sm", UtilityStatus.OK if taken else UtilityStatus.INVALID_PARAMETER
                )
            case UtilityCommand("xn", ()):
                return UtilityReply("xn", UtilityStatus.OK)
            case UtilityCommand("isn" | "sm" | "xn" as name):
                return UtilityReply(name, UtilityStatus.PARAMETER_COUNT)
            case UtilityCommand():
                return UtilityReply("", UtilityStatus.UNKNOWN_COMMAND)

    def _set_rate(self, code: str) -> bool:
        """Take a data rate's code; false where it is none."""
        taken = code in {str(c) for c in (*RATE_CODES.values(), _TRIGGER_CODE)}
        if taken:
            self._present = self._present.with_rate_code(int(code))
        return taken


def _rounded(counts: FloatArray, bits: int) -> IntArray:
    limit = 1 << bits - 1
    return np.clip(np.rint(counts), -limit, limit - 1).astype(np.int64)
