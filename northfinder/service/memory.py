"""Memory of a service that stands for months: what a run or a download used is given back.

Otherwise glibc keeps, for each thread, what was freed between pieces still in use: no leak, but it
grows for hours. (Arrow's allocator did so too: :mod:`northfinder.records.arrow`.)
"""

import asyncio
import ctypes
import platform

from starlette.concurrency import run_in_threadpool

_EVERY_S = 10.0
_ARENA_MAX = -8  # malloc.h: M_ARENA_MAX


async def keep_giving_back() -> None:
    """Give back what is free, for ever: a few milliseconds each time."""
    if platform.libc_ver()[0] != "glibc":
        return  # other C libraries do it themselves
    libc = ctypes.CDLL(None)
    libc.mallopt(_ARENA_MAX, 2)
    while True:
        await asyncio.sleep(_EVERY_S)
        await run_in_threadpool(libc.malloc_trim, 0)
