"""A simulated sensor that sends one signal of a DBC file, and takes no command."""

import asyncio
from collections.abc import Callable
from typing import ClassVar, Self

import numpy as np

from drivers.codecs.dbc import DbcDecoder
from drivers.interfaces import CanFrame, CanSettings, FloatArray, Transport
from sim.interfaces import Felt, Sensing
from sim.pacing import bursts

_USUAL_PERIOD_S = 0.01  # of a message whose file does not say
_TOGETHER = 10  # messages: then others come to speak, however many a late computer still owes


class SimulatedDbc:
    """One axis of a gyro or an accelerometer on a CAN bus.

    Args:
        sensing: What it feels.
        decoder: The message and its signals.
        column: 0, 1 or 2: which axis it sends.
        sender: Its address, where the message is of J1939 or NMEA 2000.
        burst_s: Time between the bursts in which messages leave.
    """

    transport: ClassVar[Transport] = "can"

    def __init__(
        self,
        sensing: Sensing,
        decoder: DbcDecoder,
        column: int,
        sender: int = 0,
        burst_s: float = 0.05,
    ) -> None:
        self._sensing = sensing
        self._decoder = decoder
        self._column = column
        self._sender = sender
        self._burst_s = burst_s
        self._period_s = decoder.period_s or _USUAL_PERIOD_S
        self._sent = 0
        self._send: Callable[[CanFrame], None] = lambda _: None

    @classmethod
    def configured(cls, sensing: Sensing, settings: CanSettings) -> Self:
        """Make it as a configuration says."""
        return cls(sensing, DbcDecoder.configured(settings), settings.column, settings.node or 0)

    def connect(self, send: Callable[[CanFrame], None]) -> None:
        """Send every message through ``send`` from now on."""
        self._send = send

    def wants(self, frame: CanFrame) -> bool:  # noqa: ARG002 -- it takes no command
        """Want none."""
        return False

    def receive_frame(self, frame: CanFrame) -> None:
        """Take no notice of anything."""

    async def run(self) -> None:
        """Send for ever, from power-up on."""
        async for time_s in bursts(1.0 / self._period_s, self._burst_s):
            felt = self._sensing.sense(time_s, self._period_s)
            counter = np.arange(self._sent, self._sent + len(time_s))
            self._sent += len(time_s)
            frames = self._decoder.encode(self._axis(felt), counter, self._sender)
            for number, frame in enumerate(frames, 1):
                self._send(frame)
                if number % _TOGETHER == 0:
                    await asyncio.sleep(0.0)

    def _axis(self, felt: Felt) -> FloatArray:
        is_rate = self._decoder.quantity == "rate"
        axes = felt.rate_rad_s if is_rate else felt.specific_force_g
        column: FloatArray = axes[:, self._column]
        return column
