"""A CiA 410 inclinometer as accelerometer: its slopes are turned into specific force.

After every SYNC the device sends both slopes of one moment. The driver produces the SYNC. Where
the bus has another producer, or the device knows no synchronous PDO, it sends by its own timer.
"""

import asyncio
import contextlib
from contextlib import AbstractAsyncContextManager
from typing import ClassVar, Self

import numpy as np

from drivers.arrival_account import ArrivalAccount
from drivers.canopen.identity import node_of, read_identity, require_profile
from drivers.canopen.node import CanopenNode
from drivers.canopen.sync_clock import SyncClock
from drivers.canopen.tpdo_setup import TpdoSetup
from drivers.codecs.canopen import SYNC, TPDO, NmtCommand
from drivers.codecs.cia410 import (
    LATERAL_16,
    LATERAL_32,
    LONGITUDINAL_16,
    LONGITUDINAL_32,
    PROFILE,
    RESOLUTION,
    specific_force,
    unit_rad,
)
from drivers.codecs.pdo import BY_EVENT, EVERY_SYNC, Mapped, decode_pdo, signed
from drivers.errors import DriverError, LinkTimeoutError, ProtocolError, RefusedError
from drivers.interfaces import (
    CanArrivals,
    CanLink,
    CanSettings,
    Counters,
    FloatArray,
    Identity,
    IntArray,
    Listener,
    NoiseSpecification,
    Role,
    SampleBlock,
    Transport,
)
from drivers.stream import SensorStream

_PERIOD_S = 0.01
_QUIET_S = 0.05  # in which a SYNC of somebody else would have come
_PATIENCE_S = 1.0
_GRACE_S = 0.5  # a bus that is off stays so; whoever measures shall know soon

#: A good MEMS inclinometer: 0.0004 deg/sqrt(Hz).
_NOISE = NoiseSpecification(0.0, 0.0, force_noise_g_sqrt_s=7e-6)


class Cia410:
    """One inclinometer on a bus; longitudinal is x, lateral is y, and z points up.

    Args:
        link: The bus.
        node: The device's number.
        gravity_g: Local gravity in standard gravities: slopes know only the direction.
    """

    roles: ClassVar[frozenset[Role]] = frozenset({"accelerometer"})
    transport: ClassVar[Transport] = "can"

    def __init__(self, link: CanLink, node: int, gravity_g: float = 1.0) -> None:
        self._pdo = TPDO[0] + node
        self._node = CanopenNode(link, node, pdos=(self._pdo, SYNC))
        self._gravity_g = gravity_g
        self._counters = Counters()
        self._setup = TpdoSetup(self._node)
        self._sync = SyncClock(self._node, _PERIOD_S, self._counters)
        self._by_arrival: ArrivalAccount | None = None  # where it sends by its timer
        self._mapping: tuple[Mapped, Mapped] | None = None
        self._unit_rad = 0.0
        self._heard_sync = False
        self._identity: Identity | None = None
        self._malformed = 0
        self._stream = SensorStream(
            self._node,
            f"the inclinometer at {self._node.name}",
            self._decode,
            self._bring_up,
            self._counters,
            _GRACE_S,
        )

    @classmethod
    def configured(cls, link: CanLink, settings: CanSettings) -> Self:
        """Make it as a configuration says.

        Raises:
            ValueError: No node number is given.
        """
        return cls(link, node_of(settings), settings.gravity_g)

    @property
    def link_name(self) -> str:
        """Return node and bus."""
        return self._node.name

    @property
    def identity(self) -> Identity:
        """Return who answered; known once open."""
        if self._identity is None:
            msg = f"the inclinometer at {self._node.name} is not open yet"
            raise RuntimeError(msg)
        return self._identity

    @property
    def counters(self) -> Counters:
        """Return samples, damaged ones, those that did not come, and reconnections."""
        self._counters.crc_errors = self._malformed + self._node.error_frames
        return self._counters

    @property
    def sample_period_s(self) -> float:
        """Return the time between samples."""
        return _PERIOD_S

    @property
    def noise(self) -> NoiseSpecification:
        """Return a good MEMS inclinometer's: CiA 410 has no object for it."""
        return _NOISE

    def listen(self) -> AbstractAsyncContextManager[Listener]:
        """Begin to listen; samples that came before are not delivered."""
        return self._stream.listen()

    async def open(self) -> Self:
        """Open the bus, identify the node, and have it send its slopes.

        Raises:
            TransportError: The interface is absent or down, or the node does not answer.
            ProtocolError: It is no inclinometer, or sends nothing.
        """
        try:
            await self._node.open()
            await self._bring_up()
        except BaseException:
            await self.close()
            raise
        self._stream.start()
        return self

    async def close(self) -> None:
        """Leave the PDO as it was found and release the bus; never raises DriverError."""
        await self._stream.stop()
        await self._sync.stop()
        with contextlib.suppress(DriverError):
            await self._setup.restore()
        await self._node.close()

    async def _bring_up(self) -> None:
        await self._sync.stop()
        await require_profile(self._node, PROFILE, "inclinometer")
        identity = await read_identity(self._node)
        if self._identity not in {None, identity}:
            msg = f"The {self._node.name} is another device than before: begin again with it."
            raise ProtocolError(msg)
        self._identity = identity
        self._unit_rad = unit_rad(await self._node.number(RESOLUTION))
        self._mapping = await self._slopes()
        await self._have_it_send(self._mapping)
        await self._hear_it()
        if self._by_arrival is None and self._heard_sync:  # somebody began in the same moment
            await self._sync.stop()
            await self._have_it_send_by_timer(self._mapping)
            await self._hear_it()

    async def _slopes(self) -> tuple[Mapped, Mapped]:
        """Return the finer pair of objects that the device has."""
        if await self._node.number_if_present(LONGITUDINAL_32) is not None:
            return Mapped(LONGITUDINAL_32, 32), Mapped(LATERAL_32, 32)
        return Mapped(LONGITUDINAL_16, 16), Mapped(LATERAL_16, 16)

    async def _have_it_send(self, mapping: tuple[Mapped, Mapped]) -> None:
        """After every SYNC of ours, if nobody else sends it; else by the device's own timer."""
        self._by_arrival = None
        if not await self._is_synchronised_already():
            with contextlib.suppress(RefusedError):
                await self._setup.apply(mapping, EVERY_SYNC, None)
                return
        await self._have_it_send_by_timer(mapping)

    async def _have_it_send_by_timer(self, mapping: tuple[Mapped, Mapped]) -> None:
        await self._setup.apply(mapping, BY_EVENT, round(1000 * _PERIOD_S))
        self._by_arrival = ArrivalAccount(None, _PERIOD_S, self._counters)
        self._by_arrival.restart()

    async def _is_synchronised_already(self) -> bool:
        try:
            arrivals = await self._node.read(_QUIET_S)
        except LinkTimeoutError:
            return False
        return any(frame.can_id == SYNC for frame in arrivals.frames)

    async def _hear_it(self) -> None:
        """Start it and wait for its slopes; note whether somebody else sends SYNC too."""
        self._heard_sync = False
        await self._node.command(NmtCommand.START)
        if self._by_arrival is None:
            self._sync.start()
        deadline_s = asyncio.get_running_loop().time() + _PATIENCE_S
        while self._decode(await self._first()) is None:  # by it, the account begins
            if asyncio.get_running_loop().time() > deadline_s:  # somebody's SYNC comes, no answer
                raise self._mute()
        self._sync.count_from_here()

    async def _first(self) -> CanArrivals:
        try:
            return await self._node.read(_PATIENCE_S)
        except LinkTimeoutError:
            raise self._mute() from None

    def _mute(self) -> LinkTimeoutError:
        return LinkTimeoutError(
            f"The {self._node.name} answers, but sends no slopes. Check the transmission type"
            " and the identifier of its first PDO (1800h)."
        )

    def _values(self, arrivals: CanArrivals) -> tuple[IntArray, list[float]] | None:
        """Return the slopes in counts, shape ``(k, 2)``, and their arrivals; None without any."""
        counts, times_s = [], []
        for frame, time_s in zip(*arrivals, strict=True):
            self._heard_sync |= frame.can_id == SYNC
            if frame.can_id != self._pdo or self._mapping is None:
                continue
            values = decode_pdo(self._mapping, frame.data)
            if values is None:
                self._malformed += 1
                continue
            counts.append([signed(values[entry], bits) for entry, bits in self._mapping])
            times_s.append(time_s)
        return (np.array(counts, np.int64), times_s) if counts else None

    def _decode(self, arrivals: CanArrivals) -> SampleBlock | None:
        found = self._values(arrivals)
        if found is None:
            return None
        slopes: FloatArray = found[0] * np.float64(self._unit_rad)
        arrived_s = np.array(found[1])
        if self._by_arrival is None:
            tick, time_s = self._sync.place(arrived_s)
        else:
            tick, time_s = self._by_arrival.place(None, arrived_s, self._malformed)
        force = specific_force(slopes[:, 0], slopes[:, 1]) * self._gravity_g
        absent = np.full(force.shape, np.nan)
        return SampleBlock(
            tick=tick,
            time_s=time_s,
            rate_rad_s=absent,
            specific_force_g=force,
            rate_valid=np.zeros(force.shape, np.bool_),
            force_valid=np.isfinite(force),
            temperature_deg_c=np.full(len(tick), np.nan),
        )
