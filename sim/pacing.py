"""The free-running sample clock of a streaming device."""

import asyncio
from collections.abc import AsyncIterator

import numpy as np

from drivers.interfaces import FloatArray


async def bursts(rate_hz: float, burst_s: float) -> AsyncIterator[FloatArray]:
    """Yield the times of the samples that are due, about every ``burst_s``, for ever.

    Serial converters hand over bytes in bursts; so does this. Sample times stand exactly
    ``1/rate_hz`` apart whatever the scheduling: a late wake-up makes a longer burst.

    Args:
        rate_hz: Sample rate.
        burst_s: Time between bursts, at least one sample.

    Yields:
        Loop times of consecutive samples, shape ``(k,)``, k >= 1.
    """
    loop = asyncio.get_running_loop()
    start_s, sent = loop.time(), 0
    while True:
        wake_s = start_s + max(sent + 1, sent + burst_s * rate_hz) / rate_hz
        await asyncio.sleep(wake_s - loop.time())
        due = int((loop.time() - start_s) * rate_hz + 1e-6)
        if due > sent:
            yield start_s + np.arange(sent + 1, due + 1) / rate_hz
            sent = due
