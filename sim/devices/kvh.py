"""A simulated KVH 1750/1775 IMU or DSP-1760 gyro: the device's side of ICD 56-0298 Rev. B."""

import asyncio
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np

from drivers.codecs.kvh import FrameBlock, OutputFormat, encode_bit, encode_frames
from drivers.codecs.kvh_bit import BitResult
from drivers.codecs.kvh_commands import CommandDecoder, encode_reply
from drivers.interfaces import FloatArray, Transport
from sim.devices.kvh_settings import KvhSettings
from sim.interfaces import Sensing
from sim.pacing import bursts

_STANDARD_GRAVITY_M_S2 = 9.80665
_SEQUENCE_MODULUS = 128
_INVALID_FRAMES = 2  # after a change of data rate or format

_ROTATION_PER_RAD = {"RAD": 1.0, "DEG": 180.0 / np.pi}
_METRES_PER_UNIT = {"METERS": 1.0, "FEET": 0.3048}
#: Raw temperature is ``deg_c * scale + offset``.
_TEMPERATURE_UNITS = {
    "C": (1.0, 0.0),
    "C_100": (100.0, 0.0),
    "F": (1.8, 32.0),
    "F_100": (180.0, 3200.0),
}


class SimulatedKvh:
    """The instrument at the byte; :meth:`run` is its life from power-up until power is cut.

    Settings survive a power cycle, as they do in the instrument's flash memory.

    Args:
        sensing: What the sensors feel.
        serial_number: Answer to ``?IS``.
        burst_s: Time between the bursts in which the bytes arrive.
        settings: Those that differ from the factory's, by the name of their command.
        accelerometers: Whether it is an IMU; a DSP-1760 has gyros only.

    Attributes:
        settings: What is stored now.
        failed_tests: What the built-in test finds, by the ICD's numbers.
    """

    transport: ClassVar[Transport] = "serial"

    def __init__(
        self,
        sensing: Sensing,
        *,
        serial_number: str = "170042",
        burst_s: float = 0.05,
        settings: Mapping[str, str] | None = None,
        accelerometers: bool = True,
    ) -> None:
        self.settings = KvhSettings(serial_number, settings or {}, accelerometers=accelerometers)
        self.failed_tests: frozenset[int] = frozenset()
        self._sensing = sensing
        self._burst_s = burst_s
        self._status = 0x77 if accelerometers else 0x07
        self._send: Callable[[bytes], None] = lambda _: None
        self._power_up()

    def connect(self, send: Callable[[bytes], None]) -> None:
        """Send every answer and frame through ``send`` from now on."""
        self._send = send

    def receive_data(self, data: bytes) -> None:
        """Take bytes from the client, cut anywhere."""
        self._commands.receive_data(data)
        while (command := self._commands.next_command()) is not None:
            match str(command):
                case "=CONFIG,1" | "=CONFIG,0":
                    self._configure(configuring=command.text.endswith("1"))
                case "?BIT" | "?BIT,2" if not self._configuring:
                    self._pending_bits.append(8 if command.text.endswith("2") else 6)
                case _ if self._configuring:
                    for line in self.settings.answer(command):
                        self._send(encode_reply(line))

    async def run(self) -> None:
        """Send the power-up BIT frame, then live in normal and configuration mode by turns."""
        self._power_up()
        self._send(self._bit(6))
        while True:
            self._mode_changed.clear()
            async with asyncio.TaskGroup() as group:
                stream = group.create_task(self._stream())
                await self._mode_changed.wait()
                stream.cancel()

    def _power_up(self) -> None:
        self._commands = CommandDecoder()
        self._configuring = False
        self._mode_changed = asyncio.Event()
        self._pending_bits: list[int] = []
        self._sequence = 0
        self._invalid = 0
        self._streamed_as = self.settings.stream

    def _configure(self, *, configuring: bool) -> None:
        """Change mode; in normal mode ``=CONFIG,0`` is not permitted and is ignored."""
        if not (configuring or self._configuring):
            return
        self._send(encode_reply(f"CONFIG,{int(configuring)}"))
        if self.settings.stream != self._streamed_as:
            self._invalid, self._streamed_as = _INVALID_FRAMES, self.settings.stream
        self._configuring = configuring
        self._mode_changed.set()

    async def _stream(self) -> None:
        if self._configuring or self.settings["MSYNC"] == "EXT":
            return
        start_s = asyncio.get_running_loop().time()
        rate_hz = float(self.settings["DR"])
        async for time_s in bursts(rate_hz, self._burst_s):
            if self._configuring:  # since this burst came due
                return
            self._send(self._frames(time_s, 1.0 / rate_hz, start_s))
            for result_bytes in self._pending_bits:
                self._send(self._bit(result_bytes))
            self._pending_bits.clear()

    def _frames(self, time_s: FloatArray, period_s: float, start_s: float) -> bytes:
        felt = self._sensing.sense(time_s, period_s)
        count = len(time_s)
        form = OutputFormat[self.settings["OUTPUTFMT"]]
        records = np.zeros(count, form.dtype)
        records["gyro"] = self._rotation(felt.rate_rad_s, period_s)
        records["acceleration"] = self._acceleration(felt.specific_force_g, period_s)
        records["sequence"] = (self._sequence + np.arange(count)) % _SEQUENCE_MODULUS
        records["status"] = np.where(np.arange(count) < self._invalid, 0, self._status)
        scale, offset = _TEMPERATURE_UNITS[self.settings["TEMPUNITS"]]
        temperature = np.rint(felt.temperature_deg_c * scale + offset)
        if form is OutputFormat.C:  # the simulated magnetometer feels no field
            records["cycling"] = np.where(records["sequence"] % 4 == 0, temperature, 0.0)
        else:
            records["temperature"] = temperature
        if form is OutputFormat.B:
            records["timestamp_us"] = np.rint((time_s - start_s) * 1e6).astype(np.int64) % 2**32
        self._sequence = (self._sequence + count) % _SEQUENCE_MODULUS
        self._invalid = max(0, self._invalid - count)
        return encode_frames(FrameBlock(form, records))

    def _rotation(self, rate_rad_s: FloatArray, period_s: float) -> FloatArray:
        interval = period_s if self.settings["ROTFMT"] == "DELTA" else 1.0
        unit = _ROTATION_PER_RAD[self.settings["ROTUNITS"]]
        return rate_rad_s @ self.settings.axes.T * (interval * unit)

    def _acceleration(self, specific_force_g: FloatArray, period_s: float) -> FloatArray:
        scale = 1.0 if self._status & 0x70 else 0.0
        if self.settings["LINFMT"] == "DELTA":
            unit_m = _METRES_PER_UNIT[self.settings["LINUNITS"]]
            scale *= _STANDARD_GRAVITY_M_S2 * period_s / unit_m
        return specific_force_g @ self.settings.axes.T * scale

    def _bit(self, result_bytes: int) -> bytes:
        results = bytearray(b"\x7f" * result_bytes)
        for test in self.failed_tests:
            if test // 8 < result_bytes:
                results[test // 8] &= ~(1 << test % 8)
        return encode_bit(BitResult(bytes(results)))
