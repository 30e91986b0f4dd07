"""KVH 1750/1775 IMU and DSP-1760 fibre-optic gyro on a serial line (ICD 56-0298 Rev. B).

The device stores its settings in flash, so the driver changes only what conversion cannot undo
and puts back what it changed. It has the device send *delta angle*, the default: that is the
integral of the rate over the sample's interval, so nothing between samples is lost and nothing
aliases, and the sum over a dwell is the angle turned. Units are left as found and converted.

Setting the data rate also sets the device's low-pass filters to half of it (ICD 8.8); it is set
only where it differs.
"""

import contextlib
import math
from collections.abc import Mapping
from contextlib import AbstractAsyncContextManager
from typing import ClassVar, Self, TypeVar

import numpy as np

from drivers.codecs.kvh import FrameBlock, KvhDecoder, OutputFormat
from drivers.codecs.kvh_bit import ACCELEROMETER_TESTS, BitResult, describe
from drivers.device_clock import DeviceClock
from drivers.errors import DeviceFaultError, DriverError, ProtocolError, TransportError
from drivers.interfaces import (
    BoolArray,
    Chunk,
    Counters,
    FloatArray,
    Identity,
    IntArray,
    Link,
    Listener,
    NoiseSpecification,
    Role,
    SampleBlock,
    Transport,
)
from drivers.kvh_dialogue import KvhDialogue
from drivers.sample_account import SampleAccount
from drivers.stream import SensorStream

#: Slower ones look dead to the stream; 3600 and 5000 Hz do not fit through 921600 baud.
SAMPLE_RATES_HZ = (5, 10, 25, 50, 100, 250, 500, 750, 1000)

_SEQUENCE_MODULUS = 128
#: A gyro without accelerometers has no LINFMT, an early 1750 format A only.
_OPTIONAL = frozenset({"OUTPUTFMT", "LINFMT"})
_RAD_PER_UNIT = {"RAD": 1.0, "DEG": math.pi / 180.0}
#: Degrees Celsius are ``(raw + offset) * scale``.
_TEMPERATURE_UNITS = {
    "C": (0.0, 1.0),
    "C_100": (0.0, 0.01),
    "F": (-32.0, 5.0 / 9.0),
    "F_100": (-3200.0, 5.0 / 900.0),
}

#: 1750 IMU data sheet: angle random walk 0.012 deg/sqrt(h), bias instability 0.05 deg/h,
#: accelerometer noise 0.12 mg/sqrt(Hz); its limits of the offsets, 2 deg/h and 2 mg, as one sigma.
_NOISE = NoiseSpecification(
    angle_random_walk_rad_sqrt_s=math.radians(0.012) / 60.0,
    bias_instability_rad_s=math.radians(0.05) / 3600.0,
    force_noise_g_sqrt_s=0.12e-3,
    bias_rad_s=math.radians(2.0) / 3600.0,
    force_bias_g=2e-3,
)

T = TypeVar("T")


class Kvh:
    """A KVH gyro, with its accelerometers where it has them.

    Args:
        link: The serial line.
        sample_rate_hz: One of ``SAMPLE_RATES_HZ``.

    Raises:
        ValueError: Another rate.
    """

    roles: ClassVar[frozenset[Role]] = frozenset({"gyro", "accelerometer"})
    transport: ClassVar[Transport] = "serial"
    baudrate: ClassVar[int] = 921_600

    def __init__(self, link: Link, sample_rate_hz: int = 1000) -> None:
        if sample_rate_hz not in SAMPLE_RATES_HZ:
            msg = f"the KVH cannot stream {sample_rate_hz} Hz; choose one of {SAMPLE_RATES_HZ}"
            raise ValueError(msg)
        self._link = link
        self._rate_hz = sample_rate_hz
        self._counters = Counters()
        self._decoder = KvhDecoder()
        self._dialogue = KvhDialogue(link, self._decoder)
        clock = DeviceClock(_SEQUENCE_MODULUS, 1, self.sample_period_s)
        self._account = SampleAccount(clock, self._counters)
        self._stream = SensorStream(
            link, f"KVH on {link.name}", self._decode, self._bring_up, self._counters
        )
        self._wanted = {
            "DR": str(sample_rate_hz),
            "OUTPUTFMT": "A",
            "ROTFMT": "DELTA",
            "LINFMT": "ACCEL",
        }
        self._identity: Identity | None = None
        self._found: dict[str, str] = {}
        self._rad_per_unit = 1.0
        self._temperature_unit = (0.0, 1.0)
        self._streaming = False
        self._after_break = False

    @property
    def link_name(self) -> str:
        """Return the link's name."""
        return self._link.name

    @property
    def identity(self) -> Identity:
        """Return model and serial number; known once open."""
        if self._identity is None:
            msg = f"the KVH on {self._link.name} is not open yet"
            raise RuntimeError(msg)
        return self._identity

    @property
    def counters(self) -> Counters:
        """Return frames delivered, CRC errors, samples lost and reconnections."""
        return self._counters

    @property
    def sample_period_s(self) -> float:
        """Return the time between samples."""
        return 1.0 / self._rate_hz

    @property
    def noise(self) -> NoiseSpecification:
        """Return the 1750 IMU's data sheet."""
        return _NOISE

    def listen(self) -> AbstractAsyncContextManager[Listener]:
        """Begin to listen; samples that came before are not delivered."""
        return self._stream.listen()

    async def open(self) -> Self:
        """Identify the device, configure it and begin to stream.

        Raises:
            TransportError: The port is absent or busy, or nothing answers in time.
            ProtocolError: Something else is on the port, or it refuses a setting.
            DeviceFaultError: The built-in test failed.
        """
        self._identity = None
        self._link.set_baudrate(self.baudrate)
        await self._link.open()
        try:
            await self._bring_up()
        except BaseException:
            await self.close()
            raise
        self._stream.start()
        return self

    async def close(self) -> None:
        """Leave the device as it was found and release the link; never raises DriverError."""
        await self._stream.stop()
        try:
            with contextlib.suppress(DriverError):  # a device that is gone keeps what it has
                await self._restore()
        finally:
            with contextlib.suppress(DriverError):
                await self._link.close()

    async def _bring_up(self) -> None:
        self._streaming = False
        await self._dialogue.enter_configuration()
        serial_number = await self._dialogue.ask("IS") or "unknown"
        self._refuse_replacement(serial_number)
        await self._configure()
        await self._dialogue.leave_configuration()
        self._refuse_fault(await self._dialogue.built_in_test())
        frames = await self._dialogue.verify_rate(self._rate_hz)
        self._identity = Identity("KVH", _model(frames), serial_number)
        self._streaming = self._after_break = True

    async def _configure(self) -> None:
        for name, value in self._wanted.items():
            found = await self._dialogue.ask(name)
            if found is None and name not in _OPTIONAL:
                msg = f"{self._link.name}: the KVH does not know ?{name}; is it a 1750 or a kin?"
                raise ProtocolError(msg)
            if found is not None and found != value:
                self._found.setdefault(name, found)
                await self._dialogue.set(name, value)
        self._rad_per_unit = await self._convertible("ROTUNITS", _RAD_PER_UNIT)
        self._temperature_unit = await self._convertible("TEMPUNITS", _TEMPERATURE_UNITS)

    async def _convertible(self, name: str, conversions: Mapping[str, T]) -> T:
        unit = await self._dialogue.ask(name)
        if unit is None or unit not in conversions:
            msg = f"{self._link.name}: the KVH's {name} is {unit}; set one of {list(conversions)}"
            raise ProtocolError(msg)
        return conversions[unit]

    async def _restore(self) -> None:
        try:
            if self._found:
                await self._dialogue.enter_configuration()
            for name, value in self._found.items():
                await self._dialogue.set(name, value)
            self._found.clear()
        finally:
            if self._dialogue.configuring:
                await self._dialogue.leave_configuration()

    def _refuse_replacement(self, serial_number: str) -> None:
        if self._identity is not None and self._identity.serial_number != serial_number:
            msg = (
                f"{self._link.name}: KVH {serial_number} answers where "
                f"{self._identity.serial_number} was; begin again with the new one"
            )
            self._found.clear()  # these settings are not the new one's to be given
            raise ProtocolError(msg)

    def _refuse_fault(self, result: BitResult) -> None:
        failed = result.failed - ACCELEROMETER_TESTS
        if failed:
            msg = (
                f"{self._link.name}: the KVH's built-in test fails: {describe(failed)}; "
                "let it reach its working temperature, or have it serviced"
            )
            raise DeviceFaultError(msg, result.results.hex().upper())

    def _decode(self, chunk: Chunk) -> SampleBlock | None:
        """Turn a chunk into samples; a power-up BIT frame among them means a restart."""
        frames = self._frames(chunk)
        if frames is None or not self._streaming:
            return None
        tick, time_s = self._place(frames, chunk.arrival_s)
        rate_valid, force_valid = _validity(frames)
        rate_rad_s = frames.gyro * (self._rad_per_unit * self._rate_hz)
        offset, scale = self._temperature_unit
        return SampleBlock(
            tick=tick,
            time_s=time_s,
            rate_rad_s=np.where(rate_valid, rate_rad_s, np.nan),
            specific_force_g=np.where(force_valid, frames.acceleration, np.nan),
            rate_valid=rate_valid,
            force_valid=force_valid,
            temperature_deg_c=(frames.temperature + offset) * scale,
        )

    def _frames(self, chunk: Chunk) -> FrameBlock | None:
        """Return all format A frames that the chunk completes."""
        self._decoder.receive_data(chunk.data)
        events = list(iter(self._decoder.next_event, None))
        self._counters.crc_errors = self._decoder.crc_errors
        if any(isinstance(event, BitResult) for event in events):
            # The stream opens the link again and brings the device up as after a failure.
            msg = f"{self._link.name}: the KVH restarted in mid-stream; check its supply"
            raise TransportError(msg)
        records = [
            event.records
            for event in events
            if isinstance(event, FrameBlock) and event.format is OutputFormat.A
        ]
        return FrameBlock(OutputFormat.A, np.concatenate(records)) if records else None

    def _place(self, frames: FrameBlock, arrival_s: float) -> tuple[IntArray, FloatArray]:
        """Return ticks and times, and count what came and what is missing."""
        discarded_bytes = self._decoder.discarded_bytes
        if self._after_break:
            first_s = arrival_s - (len(frames.records) - 1) * self.sample_period_s
            self._account.restart(first_s, discarded_bytes)
            self._after_break = False
        return self._account.place(frames.sequence, arrival_s, discarded_bytes)


def _model(frames: FrameBlock) -> str:
    """Tell a gyro from an IMU: status bits 4 to 6 are the accelerometers'."""
    return "1750/1775 IMU" if np.any(frames.status & 0x70) else "DSP-1760"


def _validity(frames: FrameBlock) -> tuple[BoolArray, BoolArray]:
    """Return which axes of gyro and accelerometer are valid: so the device says, and finite."""
    bits = frames.status[:, np.newaxis] >> np.arange(7) & 1
    gyro: BoolArray = (bits[:, :3] == 1) & np.isfinite(frames.gyro)
    acceleration: BoolArray = (bits[:, 4:] == 1) & np.isfinite(frames.acceleration)
    return gyro, acceleration
