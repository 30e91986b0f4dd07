"""Any gyro or accelerometer that a DBC file describes: one signal of one message is one axis.

Nothing is asked of the instrument: it sends, and this listens.
"""

import contextlib
from contextlib import AbstractAsyncContextManager
from typing import ClassVar, Self

import numpy as np

from drivers.arrival_account import ArrivalAccount
from drivers.codecs.dbc import DbcDecoder, Readings
from drivers.errors import DriverError, LinkTimeoutError, ProtocolError
from drivers.interfaces import (
    BoolArray,
    CanArrivals,
    CanLink,
    CanSettings,
    Counters,
    FloatArray,
    Identity,
    Listener,
    NoiseSpecification,
    Role,
    SampleBlock,
    Transport,
)
from drivers.stream import SensorStream

_PATIENCE_S = 1.0
_MEASURED_S = 0.5
_FEWEST = 4
_TOLERANCE = 0.1  # of the period, by which the file may be wrong
_GRACE_S = 0.5  # a bus that is off stays so; whoever measures shall know soon
_NOISE = NoiseSpecification(
    angle_random_walk_rad_sqrt_s=np.radians(0.02) / 60.0,
    bias_instability_rad_s=np.radians(0.1) / 3600.0,
    force_noise_g_sqrt_s=1e-4,
)


class Dbc:
    """One axis; its quantity, rate or specific force, is the signal's.

    With a counter every lost message is counted. Without one the messages are taken to follow
    each other, but for pauses of more than a tenth of a second: shorter losses stay unseen.

    Args:
        link: The bus.
        decoder: What to read.
        column: 0, 1 or 2: the axis x, y or z that the signal is.
        sender: With J1939 and NMEA 2000, whose message; by default anybody's.
    """

    roles: ClassVar[frozenset[Role]] = frozenset({"gyro", "accelerometer"})
    transport: ClassVar[Transport] = "can"

    def __init__(
        self, link: CanLink, decoder: DbcDecoder, column: int, sender: int | None = None
    ) -> None:
        self._link = link
        self._decoder = decoder
        self._column = column
        self._sender = sender
        self._counters = Counters()
        self._period_s = decoder.period_s
        self._account: ArrivalAccount | None = None
        name = f"{decoder.name} on {link.name}"
        self._stream = SensorStream(
            link, name, self._decode, self._bring_up, self._counters, _GRACE_S
        )

    @classmethod
    def configured(cls, link: CanLink, settings: CanSettings) -> Self:
        """Make it as a configuration says.

        Raises:
            ValueError: The DBC file is not as it must be.
        """
        return cls(link, DbcDecoder.configured(settings), settings.column, settings.node)

    @property
    def link_name(self) -> str:
        """Return the bus's name."""
        return self._link.name

    @property
    def identity(self) -> Identity:
        """Return the message that is heard: a DBC instrument does not say who it is."""
        known = self._decoder.is_j1939 and self._sender is not None
        sender = f"address {self._sender}" if known else "unknown"
        return Identity("DBC", self._decoder.name, sender)

    @property
    def counters(self) -> Counters:
        """Return messages, those that were damaged, samples lost and reconnections."""
        self._counters.crc_errors = self._decoder.malformed + self._link.error_frames
        return self._counters

    @property
    def sample_period_s(self) -> float:
        """Return the time between messages: as the file says, or as measured when opened."""
        if self._period_s is None:
            msg = f"{self._decoder.name} on {self._link.name} is not open yet"
            raise RuntimeError(msg)
        return self._period_s

    @property
    def noise(self) -> NoiseSpecification:
        """Return a middling fibre-optic gyro's and MEMS accelerometer's: DBC files have none."""
        return _NOISE

    def listen(self) -> AbstractAsyncContextManager[Listener]:
        """Begin to listen; samples that came before are not delivered."""
        return self._stream.listen()

    async def open(self) -> Self:
        """Open the bus and hear the message.

        Raises:
            TransportError: The interface is absent or down, or the message does not come.
            ProtocolError: It comes, but not as the file says.
        """
        self._link.set_filters([self._decoder.filter(self._sender)])
        await self._link.open()
        try:
            await self._bring_up()
        except BaseException:
            await self.close()
            raise
        self._stream.start()
        return self

    async def close(self) -> None:
        """Release the bus; never raises DriverError."""
        await self._stream.stop()
        with contextlib.suppress(DriverError):
            await self._link.close()

    async def _bring_up(self) -> None:
        """Listen for long enough to know how often the message comes."""
        times_s: list[float] = []
        heard = 0
        while len(times_s) < _FEWEST or times_s[-1] - times_s[0] < _MEASURED_S:
            arrivals = await self._read()
            heard += len(arrivals.frames)
            readings = self._decoder.decode(arrivals.frames)
            times_s += [arrivals.times_s[place] for place in readings.index]
            if heard > 100 and not times_s:
                msg = (
                    f"{self._decoder.name} comes on {self._link.name}, but never intact and with"
                    " this signal. Check length, checksum and multiplexer in the DBC file."
                )
                raise ProtocolError(msg)
        self._settle_period((times_s[-1] - times_s[0]) / (len(times_s) - 1))
        if self._account is None:
            modulus = self._decoder.counter_modulus
            self._account = ArrivalAccount(modulus, self.sample_period_s, self._counters)
        self._account.restart()

    async def _read(self) -> CanArrivals:
        try:
            return await self._link.read(_PATIENCE_S)
        except LinkTimeoutError:
            msg = (
                f"{self._decoder.name} does not come on {self._link.name}: nothing for"
                f" {_PATIENCE_S:g} s. Check the instrument's power, the bit rate, and the message."
            )
            raise LinkTimeoutError(msg) from None

    def _settle_period(self, measured_s: float) -> None:
        """Take the file's period where the messages keep it, else what was measured.

        Raises:
            ProtocolError: They do not.
        """
        declared_s = self._decoder.period_s
        if declared_s is None:
            self._period_s = self._period_s or measured_s
        elif abs(measured_s / declared_s - 1.0) > _TOLERANCE:
            msg = (
                f"{self._decoder.name} comes every {1000 * measured_s:.3g} ms on {self._link.name},"
                f" not every {1000 * declared_s:.3g} ms as its DBC file says (GenMsgCycleTime)."
                " Correct the file, or the instrument's rate. Do two instruments send it?"
            )
            raise ProtocolError(msg)

    def _decode(self, arrivals: CanArrivals) -> SampleBlock | None:
        readings = self._decoder.decode(arrivals.frames)
        if len(readings.index) == 0:
            return None
        if self._account is None:
            return None
        times_s = np.array(arrivals.times_s)[readings.index]
        tick, time_s = self._account.place(readings.counter, times_s, self._decoder.malformed)
        rate, rate_valid = self._axis(readings, "rate")
        force, force_valid = self._axis(readings, "force")
        return SampleBlock(
            tick=tick,
            time_s=time_s,
            rate_rad_s=rate,
            specific_force_g=force,
            rate_valid=rate_valid,
            force_valid=force_valid,
            temperature_deg_c=np.full(len(tick), np.nan),
        )

    def _axis(self, readings: Readings, quantity: str) -> tuple[FloatArray, BoolArray]:
        """Return three columns, the signal in its own, for its quantity; the rest is absent."""
        values = np.full((len(readings.index), 3), np.nan)
        valid = np.zeros(values.shape, np.bool_)
        if quantity == self._decoder.quantity:
            values[:, self._column] = np.where(readings.valid, readings.value, np.nan)
            valid[:, self._column] = readings.valid
        return values, valid
