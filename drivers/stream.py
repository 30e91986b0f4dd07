"""A sensor's stream: read the link for ever, hand every block to whoever listens."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable

from drivers.errors import DriverError, LinkTimeoutError, TransportError
from drivers.interfaces import Chunk, Counters, Link, Listener, SampleBlock

SILENCE_S = 1.0  # the slowest KVH rate is 1 Hz, but a north-seek runs at 100 Hz and more
_RECONNECT_S = 5.0  # a USB converter that was pulled and pushed back in
_RETRY_S = 0.25
_QUEUE_BLOCKS = 4096  # minutes of bursts; a listener so far behind has stopped listening


class _QueueListener:
    """A bounded queue of blocks; a failure ends it."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._queue: asyncio.Queue[SampleBlock | DriverError] = asyncio.Queue(_QUEUE_BLOCKS)

    def put(self, item: SampleBlock | DriverError) -> None:
        if self._queue.full():
            self._queue.get_nowait()
            item = DriverError(f"a listener of {self._name} fell {_QUEUE_BLOCKS} blocks behind")
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


class SensorStream:
    """Reads a sensor's link in a task of its own and publishes its blocks.

    A device that falls silent fails every listener; one that comes back, or whose port does,
    is brought up again (it may have lost its configuration) and the stream goes on.

    Args:
        link: The open link; during :meth:`start` to :meth:`stop` nobody else reads it.
        name: The instrument in an error message: ``KVH gyro on /dev/ttyUSB0``.
        decode: Turns a chunk into a block, or ``None`` where it completes no sample.
        bring_up: Identifies and configures the device once the link is open again.
        counters: Counts the reconnections.
    """

    def __init__(
        self,
        link: Link,
        name: str,
        decode: Callable[[Chunk], SampleBlock | None],
        bring_up: Callable[[], Awaitable[None]],
        counters: Counters,
    ) -> None:
        self._link = link
        self._name = name
        self._decode = decode
        self._bring_up = bring_up
        self._counters = counters
        self._listeners: set[_QueueListener] = set()
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to read."""
        self._task = asyncio.create_task(self._run(), name=self._name)

    async def stop(self) -> None:
        """Stop reading; the link stays open."""
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task
            self._task = None

    @contextlib.asynccontextmanager
    async def listen(self) -> AsyncIterator[Listener]:
        """Receive every block published from now on."""
        listener = _QueueListener(self._name)
        self._listeners.add(listener)
        try:
            yield listener
        finally:
            self._listeners.discard(listener)

    async def _run(self) -> None:
        while True:
            try:
                self._publish(await self._link.read(SILENCE_S))
            except LinkTimeoutError:
                msg = f"{self._name} has been silent for {SILENCE_S:g} s; check power and cable"
                self._fail(LinkTimeoutError(msg))
                await self._return_of_device()
            except TransportError as error:
                await self._reconnect(error)

    def _publish(self, chunk: Chunk) -> None:
        block = self._decode(chunk)
        if block is not None:
            for listener in self._listeners:
                listener.put(block)

    def _fail(self, error: DriverError) -> None:
        for listener in self._listeners:
            listener.put(error)

    async def _return_of_device(self) -> None:
        """Wait for a silent device's next byte, then bring it up as after a power cycle."""
        while True:
            with contextlib.suppress(LinkTimeoutError):
                await self._link.read(SILENCE_S)
                break
        await self._restore()

    async def _reconnect(self, cause: TransportError) -> None:
        """Open the link again until it works; listeners are failed after a grace time."""
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + _RECONNECT_S
        while True:
            with contextlib.suppress(TransportError):
                await self._link.open()
                break
            if loop.time() >= deadline_s:
                self._fail(cause)
                deadline_s = float("inf")
            await asyncio.sleep(_RETRY_S)
        await self._restore()

    async def _restore(self) -> None:
        try:
            await self._bring_up()
        except TransportError as error:
            await self._reconnect(error)
        except DriverError as error:
            self._fail(error)
        else:
            self._counters.reconnects += 1
