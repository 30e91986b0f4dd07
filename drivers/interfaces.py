"""The seams of the hardware: links, instruments, and the sample blocks that they yield.

A link carries bytes or CAN frames; an instrument is a codec, a link and deadlines. One instrument
may fill two roles: a KVH 1750 is gyro and accelerometer at once, on one link that is opened once.
"""

import math
from collections.abc import Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass, fields
from typing import ClassVar, Literal, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

Role = Literal["gyro", "accelerometer", "turntable"]
Transport = Literal["serial", "can", "none"]


class Chunk(NamedTuple):
    """Bytes as they came, with the loop time at which the last of them arrived."""

    data: bytes
    arrival_s: float


class Link(Protocol):
    """A byte stream to one instrument; reads never wait without a deadline."""

    @property
    def name(self) -> str:
        """Return what an error message calls this link: ``/dev/ttyUSB0``, ``sim:gyro``."""

    async def open(self) -> None:
        """Open, or open again after a failure.

        Raises:
            TransportError: The port is absent, busy or gone.
        """

    async def close(self) -> None:
        """Release the port; closing twice is harmless."""

    async def write(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            TransportError: The port is gone or takes nothing.
        """

    async def read(self, timeout_s: float) -> Chunk:
        """Return what has arrived, waiting for the first byte at most ``timeout_s``.

        Raises:
            LinkTimeoutError: Nothing came in time.
            TransportError: The port is gone.
        """

    def set_baudrate(self, baudrate: int) -> None:
        """Change the line speed; a link without one (memory, TCP) ignores it."""


class CanFrame(NamedTuple):
    """One frame of a CAN bus; of CAN FD, up to 64 bytes of data."""

    can_id: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False


class CanFilter(NamedTuple):
    """Frames of interest: those whose identifier is this one wherever the mask has a bit."""

    can_id: int
    mask: int
    extended: bool = False

    def passes(self, frame: CanFrame) -> bool:
        """Say whether a frame is of interest."""
        alike = (frame.can_id ^ self.can_id) & self.mask == 0
        return alike and frame.extended == self.extended


class CanArrivals(NamedTuple):
    """Frames as they came, at least one, each with the loop time at which it arrived."""

    frames: list[CanFrame]
    times_s: list[float]

    @property
    def arrival_s(self) -> float:
        """Return the loop time at which the last of them arrived."""
        return self.times_s[-1]


class CanLink(Protocol):
    """One instrument's part of a CAN bus; other instruments may share the bus."""

    @property
    def name(self) -> str:
        """Return what an error message calls this bus: ``socketcan can0``, ``sim:can``."""

    @property
    def error_frames(self) -> int:
        """Return how many errors the controller has reported since the bus was opened."""

    async def open(self) -> None:
        """Open, or open again after a failure.

        Raises:
            TransportError: The interface is absent, down or busy.
        """

    async def close(self) -> None:
        """Release it; closing twice is harmless."""

    async def write(self, frame: CanFrame) -> None:
        """Send a frame.

        Raises:
            TransportError: The bus is off or gone, or takes nothing.
        """

    async def read(self, timeout_s: float) -> CanArrivals:
        """Return what has arrived, waiting for the first frame at most ``timeout_s``.

        Raises:
            LinkTimeoutError: Nothing came in time.
            TransportError: The bus is off or gone.
        """

    def set_filters(self, filters: Sequence[CanFilter]) -> None:
        """Let only these frames through, from the next opening on; without any call, all."""


@dataclass(frozen=True, slots=True)
class CanSettings:
    """What a configuration says of an instrument on a CAN bus; each takes what concerns it.

    Attributes:
        node: Its CANopen node number, or its J1939 address.
        column: 0, 1 or 2: its sensing axis x, y or z.
        gravity_g: Local gravity, standard gravities.
        units_per_turn: A drive's position units per turn of the table.
        dbc: The text of the DBC file, and the names in it that are read, by what they are.
    """

    node: int | None = None
    column: int = 0
    gravity_g: float = 1.0
    units_per_turn: float | None = None
    dbc: tuple[str, dict[str, str]] | None = None


@dataclass(frozen=True, slots=True)
class Identity:
    """Who answered: model and serial number as the device reports them."""

    vendor: str
    model: str
    serial_number: str
    firmware: str = ""


@dataclass(slots=True)
class Counters:
    """What has come over a link since it was opened."""

    frames: int = 0
    crc_errors: int = 0
    lost: int = 0
    reconnects: int = 0


@dataclass(frozen=True, slots=True)
class SampleBlock:
    """Consecutive samples of one inertial instrument, k of them.

    An axis that the instrument does not have, or did not send, is NaN and not valid.

    Attributes:
        tick: Sample number in the device's own count, wraps resolved; a step of more than one
            is lost samples. ``tick * sample_period_s`` is device time. Shape ``(k,)``.
        time_s: The same instants in loop time, shape ``(k,)``.
        rate_rad_s: Angular rate x, y, z, rad/s, shape ``(k, 3)``.
        specific_force_g: Specific force x, y, z in standard gravities (9.80665 m/s^2), +1 on
            the axis that points up, shape ``(k, 3)``.
        rate_valid: The device's own validity of each rate, shape ``(k, 3)``.
        force_valid: The same for the specific force, shape ``(k, 3)``.
        temperature_deg_c: Shape ``(k,)``, NaN where the device sends none.
    """

    tick: IntArray
    time_s: FloatArray
    rate_rad_s: FloatArray
    specific_force_g: FloatArray
    rate_valid: BoolArray
    force_valid: BoolArray
    temperature_deg_c: FloatArray

    def __len__(self) -> int:
        return len(self.tick)

    def those(self, chosen: BoolArray) -> "SampleBlock":
        """Return some of the samples, by a mask of shape ``(k,)``."""
        return SampleBlock(*(getattr(self, part.name)[chosen] for part in fields(self)))


class Listener(Protocol):
    """One reader of an instrument's samples, from the moment it began to listen."""

    async def next(self, timeout_s: float) -> SampleBlock:
        """Return the next block.

        Raises:
            LinkTimeoutError: The instrument fell silent.
            TransportError: The link is gone and did not come back.
        """


class Instrument(Protocol):
    """What every instrument has; the roles below add to it."""

    roles: ClassVar[frozenset[Role]]
    transport: ClassVar[Transport]

    @property
    def link_name(self) -> str:
        """Return the link's name, for messages and for the record."""

    @property
    def identity(self) -> Identity:
        """Return who answered; known once open."""

    @property
    def counters(self) -> Counters:
        """Return the counters of frames and losses."""

    async def open(self) -> Self:
        """Open the link, identify the device, configure it; refuse another device.

        Raises:
            TransportError: The port is absent or busy, or nothing answers in time.
            ProtocolError: Something else answers.
            DeviceFaultError: The device reports that it is broken.
        """

    async def close(self) -> None:
        """Leave the device as it was found and release the link; never raises DriverError."""


@dataclass(frozen=True, slots=True)
class NoiseSpecification:
    """What the data sheet promises; a prediction uses it where nothing better is known.

    The mean of the rate over T seconds has sigma ``angle_random_walk_rad_sqrt_s / sqrt(T)``,
    that of the specific force ``force_noise_g_sqrt_s / sqrt(T)``. The biases are what may be left
    of either after switching on, one sigma; None where it is not stated.
    """

    angle_random_walk_rad_sqrt_s: float
    bias_instability_rad_s: float
    force_noise_g_sqrt_s: float
    bias_rad_s: float | None = None
    force_bias_g: float | None = None


class InertialSensor(Instrument, Protocol):
    """A gyro, an accelerometer, or both: a steady stream of sample blocks."""

    @property
    def sample_period_s(self) -> float:
        """Return the time between samples by the device's own clock; known once open."""

    @property
    def noise(self) -> NoiseSpecification:
        """Return the data sheet's noise."""

    def listen(self) -> AbstractAsyncContextManager[Listener]:
        """Begin to listen; samples that came before are not delivered."""


@dataclass(frozen=True, slots=True)
class TableState:
    """The table at one moment; the angle is counter-clockwise seen from above.

    ``fault`` is what it complains of, as a sentence: only ``observe`` reports it, all others
    raise it.
    """

    angle_rad: float
    moving: bool
    homed: bool
    fault: str | None = None


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """How fast the table turns; known once open."""

    speed_rad_s: float
    acceleration_rad_s2: float

    def move_s(self, distance_rad: float, speed_rad_s: float | None = None) -> float:
        """Return how long a move takes: a trapezoid, or a triangle that is too short for it.

        Args:
            distance_rad: How far, not negative.
            speed_rad_s: Of this move alone; by default that of the limits.
        """
        highest_rad_s = self.speed_rad_s if speed_rad_s is None else speed_rad_s
        if distance_rad < highest_rad_s**2 / self.acceleration_rad_s2:
            return 2 * math.sqrt(distance_rad / self.acceleration_rad_s2)
        return distance_rad / highest_rad_s + highest_rad_s / self.acceleration_rad_s2


class Turntable(Instrument, Protocol):
    """An indexing table. ``stop`` may be called at any time, also while a move is awaited."""

    @property
    def limits(self) -> MotionLimits:
        """Return the speed and acceleration of moves."""

    async def state(self) -> TableState:
        """Ask where the table is.

        Raises:
            LinkTimeoutError: No answer.
            DeviceFaultError: It reports a fault.
        """

    async def observe(self) -> TableState:
        """Look where the table is, at any time, also while a move is awaited.

        A fault is reported, and neither raised nor acknowledged: it is the move's to tell.

        Raises:
            LinkTimeoutError: No answer.
            TransportError: The link was cut.
        """

    async def home(self) -> TableState:
        """Find the reference; returns when at rest.

        Raises:
            DeviceFaultError: The table stalled or did not find it.
        """

    async def move_to(self, angle_rad: float, speed_rad_s: float | None = None) -> TableState:
        """Turn to an absolute angle, no wrap; returns when at rest there.

        Args:
            angle_rad: Counter-clockwise from the reference.
            speed_rad_s: Of this move alone, at most that of the limits; by default the latter.

        Raises:
            DeviceFaultError: The table stalled, was stopped, lost its reference or stopped
                short; the message says where. Or it cannot turn at a speed given.
            ValueError: The speed is not positive, or above the limit.
        """

    async def stop(self) -> None:
        """Stop now.

        Raises:
            LinkTimeoutError: The table did not confirm that it stands.
        """
