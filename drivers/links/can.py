"""CAN interfaces, whatever python-can opens: ``socketcan``, ``slcan``, ``virtual``, a maker's own.

One reader thread per bus hands frames to the event loop in short bursts; every driver on the bus
has a port of its own. python-can's own asyncio reader waits for ever on a dead bus, so it is not
used.
"""

import asyncio
import contextlib
import errno
import socket
import threading
import time
from collections.abc import Mapping
from typing import Any

import can

from drivers.errors import TransportError
from drivers.interfaces import CanFrame
from drivers.links.can_port import CanPort

_WAIT_S = 0.05
_GATHER_S = 0.005
#: However many frames wait: where a busy computer reads them only as fast as they come, a burst
#: that ended with the last of them would keep the drivers waiting until they call nodes silent.
_LONGEST_BURST_S = 0.02
_BUFFER_BYTES = 1 << 22
_SO_RCVBUFFORCE = 33  # Linux; Python has no name for it
#: Long beside the pauses of a busy computer: pyserial calls a write late although it is done.
_SEND_S = 1.0
_OLDEST_S = 10.0  # what seems to have waited longer has no timestamp of the system's time

#: The interface is down or gone. The kernel says so once, to whoever uses the socket next: where
#: that is a sender, the reader waits for ever.
_GONE = {errno.ENETDOWN, errno.ENODEV, errno.ENXIO}
#: linux/can/error.h: classes of error frames, in their identifier.
_BUS_OFF = 0x40
_ERRORS: tuple[type[Exception], ...] = (can.CanError, OSError)
_SENDING_ERRORS: tuple[type[Exception], ...] = (*_ERRORS, ValueError)
_OPENING_ERRORS: tuple[type[Exception], ...] = (*_SENDING_ERRORS, TypeError, ImportError)


class CanBus:
    """A real bus, opened while any port is on it.

    Args:
        interface: One of python-can's: ``socketcan``, ``slcan``, ``pcan``, ``virtual``.
        channel: Which one: ``can0``, ``/dev/ttyACM0``, ``PCAN_USBBUS1``.
        options: What else python-can shall be given: ``{"bitrate": 500000}``.
    """

    def __init__(self, interface: str, channel: str, options: Mapping[str, Any]) -> None:
        self._interface = interface
        self._channel = channel
        self._options = dict(options)
        self._ports: list[CanPort] = []
        self._opening = asyncio.Lock()
        self._bus: can.BusABC | None = None
        self._reader: threading.Thread | None = None
        self._closing = threading.Event()
        self._error_frames = 0
        self._failed = False

    @property
    def name(self) -> str:
        """Return interface and channel."""
        return f"{self._interface} {self._channel}"

    @property
    def error_frames(self) -> int:
        """Return how many errors the controller has reported since the bus was opened."""
        return self._error_frames

    async def join(self, port: CanPort) -> None:
        """Hand every frame to this port too, from now on; the first opens the bus.

        Raises:
            TransportError: The interface is absent, down, busy or unknown.
        """
        async with self._opening:
            self._ports.append(port)
            try:
                if self._failed:  # whoever opens again shall not wait for the others to leave
                    await self._close()
                if self._bus is None:
                    await self._open()
                self._filter()
            except BaseException:
                self._ports.remove(port)
                raise

    async def leave(self, port: CanPort) -> None:
        """Hand it nothing any more; the last closes the bus."""
        async with self._opening:
            self._ports.remove(port)
            if not self._ports:
                await self._close()

    def send(self, frame: CanFrame, sender: CanPort) -> None:  # noqa: ARG002 -- a bus in memory needs to know
        """Put a frame on the bus.

        Raises:
            TransportError: The bus is off or gone, or takes nothing.
        """
        if self._bus is None:
            msg = f"{self.name} is not open"
            raise TransportError(msg)
        message = can.Message(
            arbitration_id=frame.can_id,
            is_extended_id=frame.extended,
            is_remote_frame=frame.remote,
            is_fd=len(frame.data) > 8,
            data=frame.data,
        )
        try:
            self._bus.send(message, timeout=_SEND_S)
        except _SENDING_ERRORS as error:
            reason = error.__cause__ or error  # slcan says no more than that it could not write
            if isinstance(reason, OSError) and reason.errno in _GONE:
                self._fail(f"has failed ({reason}); check interface and cable")
            msg = f"{self.name} takes no frame ({reason}); check cable and termination"
            raise TransportError(msg) from error

    async def _open(self) -> None:
        loop = asyncio.get_running_loop()
        self._error_frames, self._failed = 0, False
        self._closing = threading.Event()
        self._bus = await loop.run_in_executor(None, self._open_bus)
        self._reader = threading.Thread(
            target=self._read_for_ever,
            args=(self._bus, self._closing, loop),
            name=f"reader of {self.name}",
            daemon=True,
        )
        self._reader.start()

    def _open_bus(self) -> can.BusABC:
        try:
            bus = can.Bus(interface=self._interface, channel=self._channel, **self._options)
        except _OPENING_ERRORS as error:
            msg = f"{self.name} cannot be opened ({error}); check interface and link"
            raise TransportError(msg) from error
        _enlarge_buffer(bus)
        return bus

    async def _close(self) -> None:
        bus, reader = self._bus, self._reader
        self._bus = self._reader = None
        self._closing.set()
        if bus is not None and reader is not None:
            await asyncio.get_running_loop().run_in_executor(None, _release, bus, reader)

    def _filter(self) -> None:
        """Have the controller or the kernel drop what no port wants."""
        if self._bus is None:
            return
        wanted = [port.filters for port in self._ports]
        if None in wanted:
            self._bus.set_filters(None)
            return
        self._bus.set_filters(
            [
                {"can_id": one.can_id, "can_mask": one.mask, "extended": one.extended}
                for filters in wanted
                for one in filters or ()
            ]
        )

    def _read_for_ever(
        self, bus: can.BusABC, closing: threading.Event, loop: asyncio.AbstractEventLoop
    ) -> None:
        while not closing.is_set():
            try:
                burst = _burst(bus)
            except _ERRORS as error:
                reason = f"has failed ({error}); check interface and cable"
                loop.call_soon_threadsafe(self._fail, reason)
                return
            if burst:
                offset_s = loop.time() - time.time()
                loop.call_soon_threadsafe(self._hand_over, burst, offset_s, loop.time())
                closing.wait(_GATHER_S)

    def _hand_over(self, burst: list[can.Message], offset_s: float, now_s: float) -> None:
        for message in burst:
            if message.is_error_frame:
                self._error_frames += 1
                if message.arbitration_id & _BUS_OFF:
                    self._fail("is bus-off; check termination, bit rate and wiring")
                continue
            frame = CanFrame(
                message.arbitration_id,
                bytes(message.data),
                message.is_extended_id,
                message.is_remote_frame,
            )
            since_s = now_s - (message.timestamp + offset_s)
            arrival_s = now_s - since_s if 0.0 <= since_s < _OLDEST_S else now_s
            for port in self._ports:
                port.receive(frame, arrival_s)

    def _fail(self, reason: str) -> None:
        self._failed = True
        for port in self._ports:
            port.fail(TransportError(f"{self.name} {reason}"))


def _enlarge_buffer(bus: can.BusABC) -> None:
    """Let the kernel keep what a busy computer has not read yet; its usual is a quarter second."""
    raw = getattr(bus, "socket", None)
    if isinstance(raw, socket.socket):
        for option in (_SO_RCVBUFFORCE, socket.SO_RCVBUF):  # the first is root's
            with contextlib.suppress(OSError):
                raw.setsockopt(socket.SOL_SOCKET, option, _BUFFER_BYTES)
                return


def _burst(bus: can.BusABC) -> list[can.Message]:
    """Return what has arrived, waiting a little for the first; a line that is no frame is none."""
    burst: list[can.Message] = []
    end_s = time.monotonic() + _WAIT_S
    while (left_s := end_s - time.monotonic()) > 0.0:
        try:
            message = bus.recv(0.0 if burst else left_s)
        except ValueError:  # slcan: noise on the serial line
            continue
        if message is None:
            break
        if not burst:
            end_s = time.monotonic() + _LONGEST_BURST_S
        burst.append(message)
    return burst


def _release(bus: can.BusABC, reader: threading.Thread) -> None:
    """Join the reader and close its bus."""
    reader.join()
    with contextlib.suppress(*_ERRORS):  # an interface that is gone cannot be closed either
        bus.shutdown()
