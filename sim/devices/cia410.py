"""A simulated CiA 410 inclinometer (CANopen) on the turning plate."""

import asyncio
import math
from collections.abc import Callable
from pathlib import Path
from typing import Self

import numpy as np

from drivers.codecs.cia410 import (
    LATERAL_16,
    LATERAL_32,
    LONGITUDINAL_16,
    LONGITUDINAL_32,
    RESOLUTION,
    RESOLUTIONS,
    slopes,
    unit_rad,
)
from drivers.codecs.pdo import Mapped
from drivers.codecs.sdo import Abort, Entry
from drivers.codecs.sdo_server import AccessError
from drivers.interfaces import CanSettings
from sim.canopen.dictionary import ObjectDictionary
from sim.canopen.node import SimulatedNode
from sim.interfaces import Sensing

DATA_SHEET = Path(__file__).parent / "eds" / "cia410.eds"

_SERIAL, _DEVICE_TYPE = Entry(0x1018, 4), Entry(0x1000)
_SLOPES = (LONGITUDINAL_16, LONGITUDINAL_32), (LATERAL_16, LATERAL_32)
_SIXTEEN_BIT = {
    _DEVICE_TYPE: 0x0002_019A,
    Entry(0x1A00, 1): Mapped(LONGITUDINAL_16, 16).to_number(),
    Entry(0x1A00, 2): Mapped(LATERAL_16, 16).to_number(),
}
_FIRST_PERIOD_S = 0.01
_CONVERSION_S = 0.001  # asked again so soon, it has no new sample yet
#: The filter's memory, after a silence: the mean over a long one would be of angles long past.
_LONGEST_PERIOD_S = 1.0


class SimulatedCia410(SimulatedNode):
    """Two slopes: longitudinal is that of the body's x axis, lateral that of its y axis.

    Args:
        sensing: What it feels; only the specific force counts.
        node: Its number on the bus, 1 to 127.
        serial_number: What 1018h:4 says.
        sixteen_bit_only: Whether it is an older make, without 6110h and 6120h.
    """

    def __init__(
        self,
        sensing: Sensing,
        node: int = 6,
        serial_number: int = 4_100_023,
        sixteen_bit_only: bool = False,
    ) -> None:
        older = sixteen_bit_only
        absent = {LONGITUDINAL_32.index, LATERAL_32.index} if older else set()
        values = {_SERIAL: serial_number} | (_SIXTEEN_BIT if older else {})
        data_sheet = DATA_SHEET.read_text("ascii")
        super().__init__(ObjectDictionary(data_sheet, node, values, absent), node)
        self._sensing = sensing
        self._sampled_s = -math.inf
        self._slopes_rad = [0.0, 0.0]
        self._unit_rad = unit_rad(self._objects.number(RESOLUTION))
        self._objects.on_write(RESOLUTION, self._set_resolution)
        for axis, entries in enumerate(_SLOPES):
            for entry in entries:
                if entry in self._objects:
                    self._objects.on_read(entry, self._reading(axis, entry))

    @classmethod
    def configured(cls, sensing: Sensing, settings: CanSettings) -> Self:
        """Make it as a configuration says."""
        return cls(sensing) if settings.node is None else cls(sensing, settings.node)

    def _reset_application(self) -> None:
        self._unit_rad = unit_rad(self._objects.number(RESOLUTION))

    def _set_resolution(self, resolution: int) -> None:
        if resolution not in RESOLUTIONS:
            raise AccessError(Abort.VALUE)
        self._unit_rad = unit_rad(resolution)

    def _reading(self, axis: int, entry: Entry) -> Callable[[], int]:
        highest = self._objects.variable(entry).highest

        def read() -> int:
            count = round(self._sample()[axis] / self._unit_rad)
            return max(-highest, min(count, highest))

        return read

    def _sample(self) -> list[float]:
        """Return both slopes, rad, freshly sampled unless that was but a moment ago."""
        now_s = asyncio.get_running_loop().time()
        since_s = now_s - self._sampled_s
        if since_s >= _CONVERSION_S:
            period_s = _FIRST_PERIOD_S if math.isinf(since_s) else min(since_s, _LONGEST_PERIOD_S)
            felt = self._sensing.sense(np.array([now_s]), period_s)
            self._slopes_rad = slopes(felt.specific_force_g)[0].tolist()
            self._sampled_s = now_s
        return self._slopes_rad
