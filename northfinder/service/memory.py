"""Memory of a service that stands for months: what a run or a download used is given back.

Otherwise glibc keeps, for each thread, what was freed between pieces still in use: no leak, but it
grows for hours. (Arrow's allocator did so too: :mod:`northfinder.records.arrow`.)
"""

import asyncio
import ctypes
import gc
import platform

from starlette.concurrency import run_in_threadpool

_EVERY_S = 10.0
_ARENA_MAX = -8  # malloc.h: M_ARENA_MAX


def set_the_start_apart() -> None:
    """Take what the start has made out of every later collection: it stays until the end.

    A collection holds up the reading of the instruments: with a certificate's figures among the
    garbage 0.25 to 0.3 s before, 0.1 to 0.2 s since. It also comes sooner: it waits for a quarter
    of what is looked at.
    """
    gc.collect()
    gc.freeze()


async def keep_giving_back() -> None:
    """Give back what is free, for ever: a few milliseconds each time."""
    if platform.libc_ver()[0] != "glibc":
        return  # other C libraries do it themselves
    libc = ctypes.CDLL(None)
    libc.mallopt(_ARENA_MAX, 2)
    while True:
        await asyncio.sleep(_EVERY_S)
        await run_in_threadpool(libc.malloc_trim, 0)
