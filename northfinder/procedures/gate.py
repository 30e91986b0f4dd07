"""Where a run waits between two visits while it is paused."""

import asyncio


class Gate:
    """Closed from a pause to its resumption; both from the loop that the run is on."""

    def __init__(self) -> None:
        self._opened = asyncio.Event()
        self._opened.set()

    @property
    def is_open(self) -> bool:
        """Say whether a run may go on."""
        return self._opened.is_set()

    def close(self) -> None:
        """Hold the run before its next visit."""
        self._opened.clear()

    def open(self) -> None:
        """Let the run go on."""
        self._opened.set()

    async def wait_until_open(self) -> None:
        """Wait until the run may go on."""
        await self._opened.wait()
