"""Safran STIM300 (TS1524 rev 31): three gyros, three accelerometers, three inclinometers."""

import asyncio
import contextlib
import math
from contextlib import AbstractAsyncContextManager
from typing import ClassVar, Self

import numpy as np

from drivers.codecs.stim300 import ASK_CONFIGURATION, ASK_PART_NUMBER, ASK_SERIAL_NUMBER
from drivers.codecs.stim300_configuration import (
    RATE_CODES,
    STANDARD_GRAVITY_M_S2,
    Configuration,
)
from drivers.codecs.stim300_data import (
    COUNTER_MODULUS,
    COUNTER_RATE_HZ,
    DataBlock,
    axes_valid,
    concatenate,
)
from drivers.codecs.stim300_special import PartNumber, SerialNumber
from drivers.device_clock import DeviceClock
from drivers.errors import DriverError, ProtocolError, TransportError
from drivers.interfaces import (
    Chunk,
    Counters,
    FloatArray,
    Identity,
    Link,
    Listener,
    NoiseSpecification,
    Role,
    SampleBlock,
    Transport,
)
from drivers.sample_account import SampleAccount
from drivers.stim300_dialogue import Stim300Dialogue
from drivers.stream import SensorStream

_NOISE = NoiseSpecification(  # tables 6-3 and 6-4, 10 g accelerometers
    angle_random_walk_rad_sqrt_s=math.radians(0.15) / math.sqrt(3600.0),
    bias_instability_rad_s=math.radians(0.3) / 3600.0,
    force_noise_g_sqrt_s=0.07 / math.sqrt(3600.0) / STANDARD_GRAVITY_M_S2,
    bias_rad_s=math.radians(10.0) / 3600.0,  # over temperature; far more than the Earth allows
    force_bias_g=0.75e-3,
)
_TEMPERATURE_LSB_DEG_C = 2.0**-8  # eq. 9


class Stim300:
    """A STIM300 on an RS-422 port, as gyro and as accelerometer.

    The data rate is set without being saved, and put back on close. What the datagrams hold and
    the output units stay as found, for the commands that change them could not be verified: the
    accelerometers must be among them, and the units be rates or increments.

    Args:
        link: Its port.
        sample_rate_hz: 125, 250, 500, 1000 or 2000.
    """

    roles: ClassVar[frozenset[Role]] = frozenset({"gyro", "accelerometer"})
    transport: ClassVar[Transport] = "serial"
    baudrate: ClassVar[int] = 921_600

    def __init__(self, link: Link, sample_rate_hz: int = 500) -> None:
        if sample_rate_hz not in RATE_CODES:
            msg = f"STIM300 samples at {', '.join(map(str, RATE_CODES))} Hz, not {sample_rate_hz}"
            raise ValueError(msg)
        self._link = link
        self._name = f"STIM300 on {link.name}"
        self._rate_hz = sample_rate_hz
        step = COUNTER_RATE_HZ // sample_rate_hz
        self._counters = Counters()
        clock = DeviceClock(COUNTER_MODULUS, step, 1 / sample_rate_hz)
        self._account = SampleAccount(clock, self._counters)
        self._stream = SensorStream(link, self._name, self._decode, self._bring_up, self._counters)
        self._dialogue = Stim300Dialogue(link, self._name, self.baudrate)
        self._identity = Identity("Safran", "STIM300", serial_number="")
        self._found: Configuration | None = None
        self._present: Configuration | None = None

    @property
    def link_name(self) -> str:
        """Return the link's name."""
        return self._link.name

    @property
    def identity(self) -> Identity:
        """Return part number, serial number and firmware."""
        return self._identity

    @property
    def counters(self) -> Counters:
        """Return the counters of datagrams, damage and losses."""
        return self._counters

    @property
    def sample_period_s(self) -> float:
        """Return the time between samples."""
        return 1 / self._rate_hz

    @property
    def noise(self) -> NoiseSpecification:
        """Return the data sheet's noise, with 10 g accelerometers."""
        return _NOISE

    def listen(self) -> AbstractAsyncContextManager[Listener]:
        """Begin to listen."""
        return self._stream.listen()

    async def open(self) -> Self:
        """Open the port, identify the instrument, set its data rate, begin to read.

        Raises:
            TransportError: The port is absent or busy.
            LinkTimeoutError: The instrument is silent or does not answer.
            ProtocolError: Something else answers, or a setting must be changed with the maker's
                tool; the message says which.
            DeviceFaultError: The instrument refused its data rate.
        """
        await self._link.open()
        try:
            await self._bring_up()
        except BaseException:  # cancellation too: the port must not stay taken
            await self.close()
            raise
        self._stream.start()
        return self

    async def close(self) -> None:
        """Put the data rate back and release the port."""
        await self._stream.stop()
        found, self._found = self._found, None
        if found is not None and found != self._present:
            with contextlib.suppress(DriverError):  # gone: it forgets the rate with its power
                await self._dialogue.set_rate(found.rate_code)
        await self._link.close()

    async def _bring_up(self) -> None:
        dialogue = self._dialogue = Stim300Dialogue(self._link, self._name, self.baudrate)
        await dialogue.synchronise()
        part = await dialogue.ask(ASK_PART_NUMBER, PartNumber)
        serial = await dialogue.ask(ASK_SERIAL_NUMBER, SerialNumber)
        self._present = await dialogue.ask(ASK_CONFIGURATION, Configuration)
        self._refuse_unusable(self._present)
        self._found = self._found or self._present
        if self._present.rate_hz != self._rate_hz:
            await self._change_rate()
        model = f"STIM300 {part.number} {part.revision}"
        self._identity = Identity("Safran", model, f"N{serial.digits}", self._present.firmware)
        now_s = asyncio.get_running_loop().time()
        self._account.restart(now_s, dialogue.decoder.discarded_bytes)

    async def _change_rate(self) -> None:
        self._present = None  # until it is known what it is now, close puts the old rate back
        await self._dialogue.set_rate(RATE_CODES[self._rate_hz])
        self._present = await self._dialogue.ask(ASK_CONFIGURATION, Configuration)
        if self._present.rate_hz != self._rate_hz:
            msg = (
                f"{self._name} took the command for {self._rate_hz} Hz but reports "
                f"{self._present.rate_hz} Hz; set the rate in service mode (m) and save it"
            )
            raise ProtocolError(msg)

    def _refuse_unusable(self, configuration: Configuration) -> None:
        if "accelerometer" not in configuration.layout.clusters:
            msg = (
                f"{self._name} sends datagram {configuration.layout.identifier:02X}, which lacks "
                f"the accelerometers; choose 93 or A7 in service mode (d) and save it"
            )
            raise ProtocolError(msg)
        try:
            usual = configuration.with_rate_code(RATE_CODES[self._rate_hz])
            usual.rate_lsb_rad_s(), usual.force_lsb_g()
        except ValueError as error:
            msg = f"{self._name}: {error}; choose those in service mode (u) and save it"
            raise ProtocolError(msg) from error

    def _decode(self, chunk: Chunk) -> SampleBlock | None:
        decoder = self._dialogue.decoder
        errors = decoder.crc_errors
        decoder.receive_data(chunk.data)
        events = list(iter(decoder.next_event, None))
        self._counters.crc_errors += decoder.crc_errors - errors
        blocks = [self._expected(event) for event in events]
        if not blocks:
            return None
        return self._samples(concatenate(blocks), chunk.arrival_s)

    def _expected(self, event: object) -> DataBlock:
        if self._present and isinstance(event, DataBlock) and event.layout == self._present.layout:
            return event
        # It introduces itself after a power-up only, and then has forgotten its data rate.
        msg = f"{self._name} restarted; check its supply"
        raise TransportError(msg)

    def _samples(self, block: DataBlock, arrival_s: float) -> SampleBlock:
        assert self._present is not None  # noqa: S101  # blocks are only expected once it is known
        discarded_bytes = self._dialogue.decoder.discarded_bytes
        tick, time_s = self._account.place(block.counter, arrival_s, discarded_bytes)
        force = block.layout.clusters.index("accelerometer")
        return SampleBlock(
            tick,
            time_s,
            rate_rad_s=block.values[:, 0] * self._present.rate_lsb_rad_s(),
            specific_force_g=block.values[:, force] * self._present.force_lsb_g(),
            rate_valid=axes_valid(block.status[:, 0]),
            force_valid=axes_valid(block.status[:, force]),
            temperature_deg_c=_temperature_deg_c(block),
        )


def _temperature_deg_c(block: DataBlock) -> FloatArray:
    """Return the mean of the gyros' three temperatures; NaN where absent or invalid."""
    if not block.layout.temperatures:
        return np.full(len(block), np.nan)
    valid = axes_valid(block.temperature_status[:, 0]).all(axis=1)
    mean: FloatArray = block.temperatures[:, 0].mean(axis=1) * _TEMPERATURE_LSB_DEG_C
    return np.where(valid, mean, np.nan)
