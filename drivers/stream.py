"""A sensor's stream: read the link for ever, hand every block to whoever listens."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Generic, Protocol, TypeVar

import numpy as np

from drivers.errors import DriverError, LinkTimeoutError, TransportError
from drivers.interfaces import Counters, Listener, SampleBlock

SILENCE_S = 1.0  # the slowest KVH rate is 1 Hz, but a north-seek runs at 100 Hz and more
_REPLUGGED_S = 5.0  # a USB converter that was pulled and pushed back in
_RETRY_S = 0.25
_QUEUE_BLOCKS = 4096  # minutes of bursts; a listener so far behind has stopped listening


class _QueueListener:
    """A bounded queue of blocks; a failure ends it."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._queue: asyncio.Queue[SampleBlock | DriverError] = asyncio.Queue(_QUEUE_BLOCKS)

    def put(self, item: SampleBlock | DriverError) -> None:
        if self._queue.full():
            self._queue = asyncio.Queue(_QUEUE_BLOCKS)
            item = DriverError(
                f"a listener of {self._name} fell {_QUEUE_BLOCKS} blocks behind and they were "
                "discarded; read faster, or stop listening"
            )
        self._queue.put_nowait(item)

    async def next(self, timeout_s: float) -> SampleBlock:
        try:
            async with asyncio.timeout(timeout_s):
                item = await self._queue.get()
        except TimeoutError:
            msg = f"{self._name} sent no valid sample for {timeout_s:g} s; check power and cable"
            raise LinkTimeoutError(msg) from None
        if isinstance(item, DriverError):
            raise item
        return item


T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class Source(Protocol[T_co]):
    """What a stream reads: a link, or a node on a bus."""

    async def open(self) -> None:
        """Open it, or open it again after a failure."""

    async def read(self, timeout_s: float) -> T_co:
        """Return what has arrived, waiting at most so long for the first of it."""


class SensorStream(Generic[T]):
    """Reads a sensor's link in a task of its own and publishes its blocks.

    A device that falls silent fails every listener at once, one whose port is gone does so after
    a grace time. Whenever it comes back it is brought up again (it may have lost its
    configuration) and the stream goes on.

    Args:
        link: The open source; during :meth:`start` to :meth:`stop` nobody else reads it.
        name: The instrument in an error message: ``KVH gyro on /dev/ttyUSB0``.
        decode: Turns a chunk into a block, or ``None`` where it completes no sample.
        bring_up: Identifies and configures the device once the link is open again.
        counters: Counts the reconnections.
        grace_s: For so long a link that is gone may come back before the listeners are told.
    """

    def __init__(  # noqa: PLR0913, PLR0917 -- the seams of one task
        self,
        link: Source[T],
        name: str,
        decode: Callable[[T], SampleBlock | None],
        bring_up: Callable[[], Awaitable[None]],
        counters: Counters,
        grace_s: float = _REPLUGGED_S,
    ) -> None:
        self._link = link
        self._name = name
        self._decode = decode
        self._bring_up = bring_up
        self._counters = counters
        self._grace_s = grace_s
        # A list: equal runs wake the listeners in equal order, which a set's would not be.
        self._listeners: list[_QueueListener] = []
        self._ailment: DriverError | None = None
        self._tick = -1
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to read."""
        self._task = asyncio.create_task(self._run(), name=self._name)

    async def stop(self) -> None:
        """Stop reading; the link stays open."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])
            if not task.cancelled():
                task.result()  # a defect that ended the stream must not end in silence

    @contextlib.asynccontextmanager
    async def listen(self) -> AsyncIterator[Listener]:
        """Receive every block published from now on; of a dead instrument, why it is."""
        listener = _QueueListener(self._name)
        if self._ailment is not None:
            listener.put(self._ailment)
        self._listeners.append(listener)
        try:
            yield listener
        finally:
            self._listeners.remove(listener)

    async def _run(self) -> None:
        while True:
            try:
                await self._read_until_silent()
                await self._wait_until_heard()
                await self._bring_up()
            except DriverError as error:
                await self._reconnect(error)
            self._counters.reconnects += 1

    async def _read_until_silent(self) -> None:
        with contextlib.suppress(LinkTimeoutError):
            while True:
                self._publish(await self._link.read(SILENCE_S))
        msg = f"{self._name} has been silent for {SILENCE_S:g} s; check power and cable"
        self._fail(LinkTimeoutError(msg))

    async def _wait_until_heard(self) -> None:
        while True:
            with contextlib.suppress(LinkTimeoutError):
                await self._link.read(SILENCE_S)
                return

    async def _reconnect(self, error: DriverError) -> None:
        """Open the link and bring the device up until both succeed.

        The listeners are told once: of a link that does not come back after a grace time, of a
        device that answers wrongly at once.
        """
        loop = asyncio.get_running_loop()
        grace_end_s = loop.time() + self._grace_s
        told = False
        while True:
            if not told and (loop.time() >= grace_end_s or not isinstance(error, TransportError)):
                self._fail(error)
                told = True
            try:
                await self._link.open()
                await self._bring_up()
            except DriverError as again:
                error = again
                await asyncio.sleep(_RETRY_S)
            else:
                return

    def _publish(self, chunk: T) -> None:
        block = self._decode(chunk)
        if block is not None:
            block = self._unheard(block)
        if block:
            self._ailment = None
            for listener in self._listeners:
                listener.put(block)

    def _unheard(self, block: SampleBlock) -> SampleBlock:
        """Leave out what came before: a line may deliver twice, and a bus send again."""
        reached = np.maximum.accumulate(np.concatenate([[self._tick], block.tick]))
        self._tick = int(reached[-1])
        fresh = np.diff(reached) > 0
        return block if fresh.all() else block.those(fresh)

    def _fail(self, error: DriverError) -> None:
        self._ailment = error
        for listener in self._listeners:
            listener.put(error)
