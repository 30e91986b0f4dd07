"""The seams of the simulation: what a simulated device is, and what it feels."""

from collections.abc import Callable
from typing import ClassVar, NamedTuple, Protocol

from drivers.interfaces import CanFrame, FloatArray, Transport


class Felt(NamedTuple):
    """What a sensor feels, its noise included, along its own axes; k samples.

    ``rate_rad_s`` is the mean rate over each sample's interval, shape ``(k, 3)``;
    ``specific_force_g`` in standard gravities, +1 up, shape ``(k, 3)``;
    ``temperature_deg_c`` has shape ``(k,)``.
    """

    rate_rad_s: FloatArray
    specific_force_g: FloatArray
    temperature_deg_c: FloatArray


class Sensing(Protocol):
    """An inertial sensor's place on the bench, with its noise."""

    def sense(self, time_s: FloatArray, period_s: float) -> Felt:
        """Return what is felt over the intervals that end at ``time_s``, each ``period_s`` long.

        Successive calls go forward in time: the noise remembers.
        """


class TableMechanism(Protocol):
    """The turning plate under the motor's control; its angle is what the sensors feel.

    Angles are the motor's, which its encoder sees; a plate that has slipped stands elsewhere.
    """

    @property
    def end_s(self) -> float:
        """Return the loop time at which the present motion ends, or ended."""

    @property
    def stalled(self) -> bool:
        """Return whether the last motion was blocked; the next ``move_to`` clears it."""

    def angle_at(self, time_s: float) -> float:
        """Return the angle in rad, counter-clockwise from above, no wrap."""

    def past_mark_rad(self, time_s: float) -> float:
        """Return how far the plate has turned past its reference mark, within half a turn."""

    def move_to(
        self, angle_rad: float, speed_rad_s: float, acceleration_rad_s2: float, now_s: float
    ) -> None:
        """Begin a trapezoidal move from wherever the plate is."""

    def stop(self, acceleration_rad_s2: float, now_s: float) -> None:
        """Begin to decelerate."""


class SimulatedNode(Protocol):
    """An instrument on a CAN bus: frames in, frames out, on the running loop's time."""

    transport: ClassVar[Transport]

    def connect(self, send: Callable[[CanFrame], None]) -> None:
        """Send every frame through ``send`` from now on."""

    def wants(self, frame: CanFrame) -> bool:
        """Say whether frames of this identifier are for it, now or ever."""

    def receive_frame(self, frame: CanFrame) -> None:
        """Take a frame off the bus, whoever it is for."""

    async def run(self) -> None:
        """Live from power-up until cancelled."""


class Terminal(Protocol):
    """The far side of a serial line: bytes in, bytes out."""

    def connect(self, send: Callable[[bytes], None]) -> None:
        """Send every answer and sample through ``send`` from now on."""

    def receive_data(self, data: bytes) -> None:
        """Take bytes from the client, cut anywhere."""


class SimulatedDevice(Terminal, Protocol):
    """An instrument on a serial line, on the running loop's time."""

    transport: ClassVar[Transport]

    async def run(self) -> None:
        """Live from power-up until cancelled."""
